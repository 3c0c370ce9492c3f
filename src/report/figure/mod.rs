//! Figures of the report and strip charts, as SVG text.
//!
//! In the order of use:
//!
//! - `style` (colours, font), `scale` (limits and ticks of an axis), `legend`, `marker` (one per
//!   maneuver class), `verdict_bar`;
//! - `derivative_figure`: estimates over angle of attack; the only file that uses the plotting crate;
//! - `svg_writer`, and `layers` (shapes of one style as one path);
//! - `strip` and `strip_marks` (a signal over time, its marks), `strip_renderer` (of all strip
//!   charts), `strip_figure` (time histories of the report), `annotated_chart` (strip charts with shaded maneuvers);
//! - `xy_chart`: one quantity over another, with levels; `chart_axis` and `chart_labels` are its
//!   parts.

pub mod annotated_chart;
pub mod chart_axis;
mod chart_labels;
pub mod derivative_figure;
mod layers;
pub mod legend;
pub mod marker;
pub mod scale;
pub mod strip;
pub mod strip_figure;
mod strip_marks;
pub mod strip_renderer;
pub mod style;
pub mod svg_writer;
pub mod verdict_bar;
pub mod xy_chart;
