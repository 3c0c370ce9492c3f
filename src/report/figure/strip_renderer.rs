//! Renderer of strip charts: signals under each other over one time axis.
//!
//! A report of five hundred maneuvers has five hundred such drawings. To keep the file small, marks
//! of one appearance are one path, and texts of one appearance share their attributes.

use std::fmt::Write;

use super::layers::Layers;
use super::scale::Scale;
use super::strip::{FlaggedSpans, Sizes, Strip, StripLine};
use super::strip_marks::{
    EXCUSED_STYLE, LEAST_MARK_WIDTH, MISSING_STYLE, OUTSIDE_BAR, OUTSIDE_STYLE, TUBE_STYLE,
    bridged_mark, despiked_mark, missing_mark,
};
use super::style::{EXCLUDED_COLOUR, FAINT, OUTSIDE_COLOUR};
use super::svg_writer::{
    Anchor, PathStyle, SvgWriter, TextStyle, coordinate, dot, polyline, rectangle,
};
use crate::report::notation::Digits;

/// Horizontal layout of strips under each other.
#[derive(Clone, Copy, Debug)]
pub struct StripColumn {
    pub sizes: Sizes,
    /// Left end of the names.
    pub names_left: f64,
    /// Ends of the plot area.
    pub left: f64,
    pub right: f64,
    pub time: Scale,
}

/// Columns of strips in the making.
#[derive(Default)]
pub struct StripDrawing {
    axes: Axes,
    layers: Layers,
    /// Strips with attributes, and flags.
    groups: SvgWriter,
}

/// Paths and texts that belong to no strip.
#[derive(Default)]
struct Axes {
    grid: String,
    frame: String,
    tick_labels: SvgTexts,
    names: SvgTexts,
    units: SvgTexts,
    /// Tick labels and title of the time axis.
    time: SvgTexts,
}

/// Texts to be written over lines and frame.
type SvgTexts = Vec<((f64, f64), String)>;

impl StripDrawing {
    /// Writes grid, signals, frames and texts, the later over the former.
    pub fn write(self, svg: &mut SvgWriter) {
        svg.path(&self.axes.grid, PathStyle::line("#cccccc", 0.5));
        self.layers.draw(svg);
        svg.append(&self.groups);
        svg.path(&self.axes.frame, PathStyle::line("#000000", 0.8));
        let anchored = |anchor| TextStyle {
            anchor,
            ..TextStyle::default()
        };
        svg.texts(&self.axes.tick_labels, anchored(Anchor::End));
        svg.texts(&self.axes.names, TextStyle::default());
        svg.texts(&self.axes.units, TextStyle::coloured(FAINT));
        svg.texts(&self.axes.time, anchored(Anchor::Middle));
    }
}

impl StripColumn {
    /// Horizontal place of a time, kept inside the plot area.
    #[must_use]
    pub fn x(&self, time_s: f64) -> f64 {
        let share = (time_s - self.time.min) / (self.time.max - self.time.min);
        self.left + share.clamp(0.0, 1.0) * (self.right - self.left)
    }

    /// Draws strips from a height downwards, with the time axis below the last.
    pub fn draw(&self, drawing: &mut StripDrawing, strips: &[Strip], top: f64) {
        let mut y = top + self.sizes.half_gap;
        for strip in strips {
            self.axes_of_strip(&mut drawing.axes, strip, y);
            self.signals(drawing, strip, y);
            y += strip.height + 2.0 * self.sizes.half_gap;
        }
        self.time_axis(&mut drawing.axes, y - 2.0 * self.sizes.half_gap);
    }

    fn time_axis(&self, axes: &mut Axes, bottom: f64) {
        for (value, label) in ticks(self.time) {
            let x = self.x(value);
            // Writing into a String cannot fail.
            let _ = write!(axes.frame, "M{} {}v4", coordinate(x), coordinate(bottom));
            let place = (x, bottom + self.sizes.text + 4.0);
            axes.time.push((place, label));
        }
        let place = (
            0.5 * (self.left + self.right),
            bottom + 2.0 * self.sizes.text + 6.0,
        );
        axes.time.push((place, "time, s".to_owned()));
    }

    /// Grid, frame, ticks, name and unit of one strip.
    fn axes_of_strip(&self, axes: &mut Axes, strip: &Strip, top: f64) {
        let half_digit = 0.36 * self.sizes.text;
        let width = coordinate(self.right - self.left);
        let left = coordinate(self.left);
        for (value, label) in ticks(strip.scale) {
            let y = strip.y(top, value);
            let _ = write!(axes.grid, "M{left} {}h{width}", coordinate(y));
            let _ = write!(axes.frame, "M{left} {}h-3", coordinate(y));
            let place = (self.left - 5.0, y + half_digit);
            axes.tick_labels.push((place, label));
        }
        for (value, _) in ticks(self.time) {
            let [x, y, height] = [self.x(value), top, strip.height].map(coordinate);
            let _ = write!(axes.grid, "M{x} {y}v{height}");
        }
        let size = (self.right - self.left, strip.height);
        axes.frame.push_str(&rectangle((self.left, top), size));
        self.name(axes, strip, top + 0.5 * strip.height);
    }

    /// Name and unit left of a strip, around its middle.
    fn name(&self, axes: &mut Axes, strip: &Strip, middle: f64) {
        let name_y = if strip.unit.is_empty() {
            middle + 0.36 * self.sizes.text
        } else {
            middle - 1.5
        };
        let place = (self.names_left, name_y);
        axes.names.push((place, strip.name.clone()));
        if !strip.unit.is_empty() {
            let place = (self.names_left, middle + self.sizes.text);
            axes.units.push((place, strip.unit.clone()));
        }
    }

    /// Lines, dots and flags of one strip.
    fn signals(&self, drawing: &mut StripDrawing, strip: &Strip, top: f64) {
        let ends = (top, top + strip.height);
        if strip.attributes.is_empty() {
            drawing.layers.add(self.marks(strip, top));
            self.flags(&mut drawing.groups, &strip.flagged, ends);
            return;
        }
        let attributes: Vec<(&str, &str)> = strip
            .attributes
            .iter()
            .map(|(name, value)| (*name, value.as_str()))
            .collect();
        let mut own = Layers::default();
        own.add(self.marks(strip, top));
        drawing.groups.open_group(&attributes, "");
        own.draw(&mut drawing.groups);
        self.flags(&mut drawing.groups, &strip.flagged, ends);
        drawing.groups.close_group();
    }

    /// Tolerance, lines and dots of one strip, from bottom to top.
    fn marks(&self, strip: &Strip, top: f64) -> Vec<(PathStyle<'static>, String)> {
        let dots = strip
            .dots
            .iter()
            .map(|&(time_s, value)| dot((self.x(time_s), strip.y(top, value)), 4.0))
            .collect();
        let (shade, bar) = self.outside(strip, top);
        let bar_style = if strip.outside.is_excused {
            EXCUSED_STYLE
        } else {
            PathStyle::filled(OUTSIDE_COLOUR)
        };
        let mut marks = vec![
            (OUTSIDE_STYLE, shade),
            (TUBE_STYLE, self.tube(strip, top)),
            (bar_style, bar),
        ];
        marks.extend(strip.lines.iter().map(|line| {
            let style = PathStyle {
                dash: line.dash,
                ..PathStyle::line(line.colour, line.width)
            };
            (style, self.line(line, strip, top))
        }));
        marks.push((PathStyle::filled(EXCLUDED_COLOUR), dots));
        marks
    }

    /// Times outside the tolerance: a shade over the whole height, and a heavy bar along the time axis. Times that
    /// another quantity excuses have the bar alone.
    fn outside(&self, strip: &Strip, top: f64) -> (String, String) {
        let (mut shade, mut bar) = (String::new(), String::new());
        for (start_s, end_s) in &strip.outside.spans {
            let left = self.x(*start_s);
            let right = self.x(*end_s).max(left + LEAST_MARK_WIDTH);
            let bottom = top + strip.height;
            let area = |upper: f64| {
                let corners = [
                    (left, upper),
                    (right, upper),
                    (right, bottom),
                    (left, bottom),
                ];
                format!("{}z", polyline(corners.into_iter()))
            };
            if !strip.outside.is_excused {
                shade.push_str(&area(top));
            }
            bar.push_str(&area(bottom - OUTSIDE_BAR));
        }
        (shade, bar)
    }

    /// Area of a tolerance; empty without one.
    fn tube(&self, strip: &Strip, top: f64) -> String {
        if strip.tube.is_empty() {
            return String::new();
        }
        let place = |time_s: f64, value: f64| (self.x(time_s), strip.y(top, value));
        let upper = strip.tube.iter().map(|(t, _, upper)| place(*t, *upper));
        let lower = strip.tube.iter().map(|(t, lower, _)| place(*t, *lower));
        format!("{}z", polyline(upper.chain(lower.rev())))
    }

    fn line(&self, line: &StripLine, strip: &Strip, top: f64) -> String {
        line.pieces
            .iter()
            .map(|piece| {
                polyline(
                    piece
                        .iter()
                        .map(|&(time_s, value)| (self.x(time_s), strip.y(top, value))),
                )
            })
            .collect()
    }

    /// Bridged samples at the bottom of the strip, despiked ones at its top, missing ones as hollow
    /// bars.
    fn flags(&self, svg: &mut SvgWriter, spans: &FlaggedSpans, (top, bottom): (f64, f64)) {
        let ends = |(start_s, end_s): &(f64, f64)| (self.x(*start_s), self.x(*end_s));
        let bridged: String = spans
            .bridged
            .iter()
            .map(|span| bridged_mark(ends(span), bottom))
            .collect();
        let despiked: String = spans
            .despiked
            .iter()
            .map(|(start_s, end_s)| despiked_mark(self.x(0.5 * (start_s + end_s)), top))
            .collect();
        let missing: String = spans
            .missing
            .iter()
            .map(|span| missing_mark(ends(span), bottom))
            .collect();
        flag_group(
            svg,
            "mark bridged",
            &bridged,
            PathStyle::filled(EXCLUDED_COLOUR),
        );
        flag_group(
            svg,
            "mark despiked",
            &despiked,
            PathStyle::filled(EXCLUDED_COLOUR),
        );
        flag_group(svg, "mark missing", &missing, MISSING_STYLE);
    }
}

fn flag_group(svg: &mut SvgWriter, class: &str, data: &str, style: PathStyle) {
    if !data.is_empty() {
        svg.open_group(&[("class", class)], "");
        svg.path(data, style);
        svg.close_group();
    }
}

/// Multiples of the step within a scale, with their labels.
fn ticks(scale: Scale) -> impl Iterator<Item = (f64, String)> {
    /// Limit for a step that is tiny beside the range.
    const MOST_TICKS: i32 = 50;
    let digits = Digits::of_ticks(scale.decimals());
    let first = (scale.min / scale.step - 1e-6).ceil();
    let last = scale.max / scale.step + 1e-6;
    let is_finite = first.is_finite() && last.is_finite();
    (0..MOST_TICKS)
        .map(move |i| first + f64::from(i))
        .take_while(move |n| is_finite && *n <= last)
        .map(move |n| (n * scale.step, digits.write(Some(n * scale.step))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_the_multiples_of_the_step_inside() {
        let labels = |min, max, step| {
            ticks(Scale { min, max, step })
                .map(|t| t.1)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            labels(-1.0, 1.2, 0.5),
            ["\u{2212}1.0", "\u{2212}0.5", "0.0", "0.5", "1.0"]
        );
        assert!(labels(f64::NAN, 1.0, 0.5).is_empty());
    }

    #[test]
    fn times_outside_a_tolerance_have_a_shade_and_a_bar_and_excused_ones_the_bar_alone() {
        let scale = |max| Scale {
            min: 0.0,
            max,
            step: 1.0,
        };
        let column = StripColumn {
            sizes: Sizes::COMPACT,
            names_left: 0.0,
            left: 100.0,
            right: 200.0,
            time: scale(10.0),
        };
        let mut strip = Strip::of_lines("q", "", 40.0, scale(1.0), vec![]);
        strip.outside.spans = vec![(2.0, 5.0)];
        // In quarters of a unit: from 120 to 150, the shade 40 and the bar 6 high.
        let (shade, bar) = column.outside(&strip, 0.0);
        assert_eq!(shade, "M480 0l120 0 0 160-120 0z");
        assert_eq!(bar, "M480 136l120 0 0 24-120 0z");
        strip.outside.is_excused = true;
        assert_eq!(column.outside(&strip, 0.0), (String::new(), bar));
    }
}
