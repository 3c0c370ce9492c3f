//! Estimates of one derivative over angle of attack with posterior, trend and wind tunnel, in the
//! manner of the paper's Figures 5-7 and 13-16.
//!
//! The plotting crate draws paper, axes, lines and band. Markers and bars of the estimates are one
//! path per class in the crate's scene. The crate itself would draw bars over hollow markers, and
//! one element per mark.

use std::fmt::Write;
use std::sync::Arc;

use kuva::backend::svg::SvgBackend;
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::plot::{BandPlot, LinePlot};
use kuva::render::annotations::ReferenceLine;
use kuva::render::color::Color;
use kuva::render::layout::{ComputedLayout, Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::render::{PathData, Primitive, Scene, render_multiple};

use super::marker::Marker;
use super::scale::Scale;
use super::style::{FONT, INK, TUNNEL_COLOUR};
use crate::report::notation::{Digits, escaped};

/// Width in units of the drawing. On a page 178 mm wide a unit is 0.84 pt: text of 14 units is
/// over 11 pt.
const WIDTH: f64 = 600.0;
const HEIGHT: f64 = 350.0;
/// Margins above and below the frame: half a line for the topmost tick label; ticks and label of
/// the x axis.
const MARGINS: (f64, f64) = (9.0, 44.0);
const TEXT: u32 = 14;

/// Number of points above which the tunnel's line has no markers, which would hide it.
const MOST_TUNNEL_MARKERS: usize = 25;

/// Content of the figure.
#[derive(Clone, Debug)]
pub struct DerivativeFigure<'a> {
    /// Id, unique in the page.
    pub id: &'a str,
    pub title: &'a str,
    /// Alternative text.
    pub description: &'a str,
    pub y_label: String,
    pub alpha: Scale,
    pub scale: Scale,
    /// Angle of attack (deg), lower and upper end of the prior's 95 % band.
    pub prior: Vec<(f64, f64, f64)>,
    /// As `prior`, of the posterior.
    pub band: Vec<(f64, f64, f64)>,
    pub posterior: Vec<(f64, f64)>,
    pub trend: Vec<(f64, f64)>,
    pub tunnel: Vec<(f64, f64)>,
    pub classes: Vec<ClassEstimates>,
}

/// Estimates of one class.
#[derive(Clone, Debug)]
pub struct ClassEstimates {
    pub marker: Marker,
    /// Word by which the page hides the class.
    pub token: String,
    /// Angle of attack (deg), value and bound of each.
    pub estimates: Vec<(f64, f64, f64)>,
}

/// Draws the figure.
#[must_use]
pub fn draw(figure: &DerivativeFigure) -> String {
    let layout = || {
        layout(
            "α, deg",
            &figure.y_label,
            HEIGHT,
            figure.alpha,
            figure.scale,
        )
    };
    let mut scene = render_multiple(curves(figure), layout());
    let place = ComputedLayout::from_layout(&layout());
    let pen = EstimatePen {
        place: &place,
        scale: figure.scale,
    };
    for class in &figure.classes {
        scene.add(Primitive::GroupStart {
            transform: None,
            title: None,
            extra_attrs: Some(format!(r#"data-class="{}""#, class.token)),
        });
        pen.estimates(&mut scene, class.marker, &class.estimates);
        scene.add(Primitive::GroupEnd);
    }
    inline(
        &SvgBackend::new().render_scene(&scene),
        figure.id,
        figure.title,
        figure.description,
    )
}

fn layout(x_label: &str, y_label: &str, height: f64, x: Scale, y: Scale) -> Layout {
    let layout = Layout::new((x.min, x.max), (y.min, y.max))
        .with_width(WIDTH)
        .with_height(height)
        .with_x_axis_min(x.min)
        .with_x_axis_max(x.max)
        .with_x_tick_step(x.step)
        .with_x_tick_format(ticks(x))
        .with_y_axis_min(y.min)
        .with_y_axis_max(y.max)
        .with_y_tick_step(y.step)
        .with_y_tick_format(ticks(y))
        .with_x_label(x_label)
        .with_y_label(y_label)
        .with_label_size(TEXT)
        .with_tick_size(TEXT)
        .with_force_margins_y(MARGINS.0, MARGINS.1)
        .with_box_axes()
        .with_grid_line_width(0.5)
        .with_font_family(FONT);
    let crosses_zero = y.min < 0.0 && y.max > 0.0;
    if crosses_zero {
        layout.with_reference_line(zero_line())
    } else {
        layout
    }
}

/// Tick labels with as many decimals as the step has and a typographic minus.
fn ticks(scale: Scale) -> TickFormat {
    let digits = Digits::of_ticks(scale.decimals());
    TickFormat::Custom(Arc::new(move |value| digits.write(Some(value))))
}

fn zero_line() -> ReferenceLine {
    ReferenceLine::horizontal(0.0)
        .with_color("#777777")
        .with_stroke_width(0.8)
        .with_dasharray("none")
}

/// A plot without points: the crate draws no axes without a plot.
fn empty_plot() -> Plot {
    Plot::Scatter(ScatterPlot::new())
}

/// Bands, tunnel, trend and posterior, from back to front.
fn curves(figure: &DerivativeFigure) -> Vec<Plot> {
    let mut plots = vec![empty_plot()];
    plots.extend(band(&figure.prior, figure.scale, TUNNEL_COLOUR, 0.08));
    plots.extend(band(&figure.band, figure.scale, "#5f6670", 0.35));
    if !figure.tunnel.is_empty() {
        plots.push(Plot::Line(curve(&figure.tunnel, TUNNEL_COLOUR, 1.6, "6 4")));
    }
    if !figure.tunnel.is_empty() && figure.tunnel.len() <= MOST_TUNNEL_MARKERS {
        let marks = ScatterPlot::new()
            .with_data(figure.tunnel.clone())
            .with_color(TUNNEL_COLOUR);
        plots.push(Plot::Scatter(
            marks.with_marker(MarkerShape::Cross).with_size(4.0),
        ));
    }
    if !figure.trend.is_empty() {
        plots.push(Plot::Line(curve(&figure.trend, INK, 1.0, "2 3")));
    }
    if !figure.posterior.is_empty() {
        plots.push(Plot::Line(curve(&figure.posterior, INK, 1.8, "")));
    }
    plots
}

/// Band cut at the frame; none of fewer than two points.
fn band(ends: &[(f64, f64, f64)], scale: Scale, colour: &str, opacity: f64) -> Option<Plot> {
    let inside = |value: f64| value.clamp(scale.min, scale.max);
    let alpha: Vec<f64> = ends.iter().map(|end| end.0).collect();
    let lower: Vec<f64> = ends.iter().map(|end| inside(end.1)).collect();
    let upper: Vec<f64> = ends.iter().map(|end| inside(end.2)).collect();
    let band = BandPlot::new(alpha, lower, upper)
        .with_color(colour)
        .with_opacity(opacity);
    (ends.len() > 1).then_some(Plot::Band(band))
}

fn curve(points: &[(f64, f64)], colour: &str, width: f64, dash: &str) -> LinePlot {
    let line = LinePlot::new()
        .with_data(points.to_vec())
        .with_color(colour)
        .with_stroke_width(width);
    if dash.is_empty() {
        line
    } else {
        line.with_line_style(kuva::plot::LineStyle::Custom(dash.to_owned()))
    }
}

/// Draws estimates into the plot area.
struct EstimatePen<'a> {
    place: &'a ComputedLayout,
    scale: Scale,
}

impl EstimatePen<'_> {
    /// Draws bars behind markers, and an arrowhead at the edge for an estimate outside.
    fn estimates(&self, scene: &mut Scene, marker: Marker, estimates: &[(f64, f64, f64)]) {
        let (mut bars, mut marks, mut arrows) = (String::new(), String::new(), String::new());
        for &(alpha, value, bound) in estimates {
            let x = self.place.map_x(alpha);
            if self.scale.contains(value) {
                self.bar(&mut bars, x, value, bound);
                marker.outline(&mut marks, x, self.place.map_y(value), 3.6);
            } else {
                self.arrow(&mut arrows, x, value);
            }
        }
        stroke(scene, bars, marker.colour, 1.0, None);
        stroke(scene, marks, marker.colour, 1.2, Some(marker.fill()));
        stroke(scene, arrows, marker.colour, 1.6, None);
    }

    /// Draws one bound to either side, cut at the frame, with a cap where the bar ends inside.
    fn bar(&self, path: &mut String, x: f64, value: f64, bound: f64) {
        let (low, high) = (value - bound, value + bound);
        let y = |v: f64| self.place.map_y(v.clamp(self.scale.min, self.scale.max));
        // Writing into a String cannot fail.
        let _ = write!(path, "M{x:.1} {:.1}V{:.1}", y(low), y(high));
        for end in [low, high]
            .into_iter()
            .filter(|end| self.scale.contains(*end))
        {
            let _ = write!(path, "M{:.1} {:.1}h5", x - 2.5, y(end));
        }
    }

    fn arrow(&self, path: &mut String, x: f64, value: f64) {
        let (tip, tail) = if value > self.scale.max {
            (2.0, 8.0)
        } else {
            (-2.0, -8.0)
        };
        let edge = self
            .place
            .map_y(value.clamp(self.scale.min, self.scale.max));
        let _ = write!(
            path,
            "M{:.1} {:.1}L{x:.1} {:.1}L{:.1} {:.1}",
            x - 4.0,
            edge + tail,
            edge + tip,
            x + 4.0,
            edge + tail
        );
    }
}

fn stroke(scene: &mut Scene, d: String, colour: &str, width: f64, fill: Option<&str>) {
    if !d.is_empty() {
        scene.add(path_of(d, colour, width, fill));
    }
}

fn path_of(d: String, colour: &str, width: f64, fill: Option<&str>) -> Primitive {
    Primitive::Path(Box::new(PathData {
        d,
        fill: fill.map(Color::from),
        stroke: Color::from(colour),
        stroke_width: width,
        opacity: None,
        stroke_dasharray: None,
    }))
}

/// Adapts a drawing of the crate to a page with other drawings. It is scaled to its column and has
/// alternative text, unique ids and at most two decimals.
fn inline(svg: &str, id: &str, title: &str, description: &str) -> String {
    let body = svg.split_once("-->").map_or(svg, |(_, body)| body);
    let height = svg
        .split_once(" height=\"")
        .and_then(|(_, rest)| rest.split_once('"'))
        .map_or("0", |(h, _)| h);
    let head = format!(
        r#"<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-labelledby="{id}-t {id}-d" font-family="{FONT}"><title id="{id}-t">{}</title><desc id="{id}-d">{}</desc>"#,
        escaped(title),
        escaped(description)
    );
    head + &shortened(&own_clips(body, id))
}

/// Names clip paths by the figure's id: the crate numbers them through the whole process.
fn own_clips(svg: &str, id: &str) -> String {
    const COUNTED: &str = "kuva-clip-";
    let mut parts = svg.split(COUNTED);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let _ = write!(
            out,
            "clip-{id}{}",
            part.trim_start_matches(|c: char| c.is_ascii_digit())
        );
    }
    out
}

/// Cuts more than nine decimals, which come from binary fractions, to two.
fn shortened(svg: &str) -> String {
    let mut parts = svg.split('.');
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let digits = part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        out.push('.');
        out.push_str(if digits > 9 {
            &part[..2]
        } else {
            &part[..digits]
        });
        out.push_str(&part[digits..]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure<'a>() -> DerivativeFigure<'a> {
        DerivativeFigure {
            id: "d3",
            title: "CN_alpha <flight>",
            description: "two estimates",
            y_label: "CN_alpha, per deg".into(),
            alpha: Scale {
                min: 0.0,
                max: 60.0,
                step: 10.0,
            },
            scale: Scale {
                min: 0.0,
                max: 0.1,
                step: 0.02,
            },
            prior: vec![(5.0, 0.02, 0.09), (60.0, 0.0, 0.2)],
            band: vec![(5.0, 0.04, 0.06), (60.0, 0.01, 0.05)],
            posterior: vec![(5.0, 0.05), (60.0, 0.03)],
            trend: vec![(5.0, 0.05), (60.0, 0.03)],
            tunnel: vec![(5.0, 0.055), (60.0, 0.02)],
            classes: vec![
                ClassEstimates {
                    marker: Marker::nth(0),
                    token: "c1".into(),
                    estimates: vec![(10.0, 0.05, 0.01), (20.0, 3.0, 0.2)],
                },
                ClassEstimates {
                    marker: Marker::nth(1),
                    token: "c2".into(),
                    estimates: vec![],
                },
            ],
        }
    }

    #[test]
    fn a_figure_does_not_depend_on_figures_drawn_before() {
        let first = draw(&figure());
        assert_eq!(first, draw(&figure()));
        assert!(first.contains("clip-d3") && !first.contains("kuva"));
    }

    #[test]
    fn estimates_have_markers_and_bars_and_outside_the_axes_arrowheads() {
        let svg = draw(&figure());
        let without = draw(&DerivativeFigure {
            classes: vec![],
            ..figure()
        });
        assert_eq!(
            svg.matches("<path").count(),
            without.matches("<path").count() + 3
        );
    }

    #[test]
    fn a_figure_without_curves_has_axes() {
        let svg = draw(&DerivativeFigure {
            prior: vec![],
            band: vec![],
            posterior: vec![],
            trend: vec![],
            tunnel: vec![],
            ..figure()
        });
        assert!(
            svg.contains(">0.04</text>") && svg.contains(">60</text>"),
            "{svg}"
        );
    }

    #[test]
    fn a_title_is_escaped() {
        assert!(draw(&figure()).contains("CN_alpha &lt;flight&gt;"));
    }

    #[test]
    fn only_decimals_of_binary_fractions_are_cut() {
        assert_eq!(
            shortened("a 12.340000000000002 0.0025 .5\""),
            "a 12.34 0.0025 .5\""
        );
    }
}
