//! Figures of the report and strip charts, as SVG text.
//!
//! In the order of use: `style` (colours, font), `scale` (limits and ticks of an axis),
//! `legend`, `marker` (one per maneuver class), `verdict_bar`, `derivative_figure`
//! (estimates over angle of attack; the only file that uses the plotting crate), `svg_writer`,
//! `layers` (everything alike as one path), `strips` (signals over time, the renderer of all strip
//! charts), `strip_figure` (time histories of the report) and `annotated_chart` (strip charts with
//! shaded maneuvers).
//! `xy_chart` draws one quantity over another, with levels.

pub mod annotated_chart;
pub mod derivative_figure;
mod layers;
pub mod legend;
pub mod marker;
pub mod scale;
pub mod strip_figure;
pub mod strips;
pub mod style;
pub mod svg_writer;
pub mod verdict_bar;
pub mod xy_chart;
