//! Strips under each other over one time axis, in one column or several, as one small drawing: the
//! inputs of a class, a maneuver measured and computed with its residuals, rates side by side. A
//! report of five hundred maneuvers has five hundred of them, so everything alike is one path, and
//! lines are written in steps of a tenth.

use std::fmt::Write;

use super::scale::Scale;
use super::style::{EXCLUDED_COLOUR, FONT, INK};
use crate::report::notation::{Digits, escaped};

/// A drawing of strips.
#[derive(Clone, Debug)]
pub struct StripFigure {
    /// Unique in the page.
    pub id: String,
    pub title: String,
    /// What those are told who do not see it.
    pub description: String,
    /// Width of the whole, in units: text is 11 of them high.
    pub width: f64,
    pub time: Scale,
    pub columns: Vec<Vec<Strip>>,
}

/// One signal over time.
#[derive(Clone, Debug)]
pub struct Strip {
    pub name: String,
    pub unit: String,
    pub height: f64,
    pub scale: Scale,
    pub lines: Vec<StripLine>,
    /// Samples that stand out.
    pub dots: Vec<(f64, f64)>,
    /// Whose it is, for the class that a reader hides; empty for nobody's.
    pub class: String,
}

/// One line of a strip.
#[derive(Clone, Debug)]
pub struct StripLine {
    pub points: Vec<(f64, f64)>,
    pub colour: &'static str,
    pub width: f64,
    /// SVG dash array; empty for a solid line.
    pub dash: &'static str,
}

const TEXT: f64 = 11.0;
/// So wide a letter is on average, in units of its size.
const LETTER: f64 = 0.56;
/// Room for the numbers at the ticks.
const TICKS: f64 = 38.0;
/// Half a tick label above and below a strip.
const ROOM: f64 = 5.0;
/// Numbers and name of the time axis.
const AXIS: f64 = 32.0;
/// Between columns.
const GAP: f64 = 22.0;
/// So that the last number of the time axis stays inside.
const EDGE: f64 = 8.0;

/// The drawing.
#[must_use]
pub fn draw(figure: &StripFigure) -> String {
    let columns = figure.columns.len().max(1) as f64;
    let width = (figure.width - EDGE - GAP * (columns - 1.0)) / columns;
    let height = |c: &Vec<Strip>| c.iter().map(|s| s.height + 2.0 * ROOM).sum::<f64>() + AXIS;
    let total = figure.columns.iter().map(height).fold(0.0, f64::max);
    let mut svg = format!(
        r#"<svg viewBox="0 0 {} {total:.0}" role="img" aria-labelledby="{id}-t {id}-d" font-family="{FONT}" font-size="{TEXT}"><title id="{id}-t">{}</title><desc id="{id}-d">{}</desc>"#,
        figure.width,
        escaped(&figure.title),
        escaped(&figure.description),
        id = figure.id,
    );
    for (i, column) in figure.columns.iter().enumerate() {
        let names = column
            .iter()
            .flat_map(|s| [s.name.chars().count(), s.unit.chars().count()])
            .max()
            .unwrap_or(0);
        let left = i as f64 * (width + GAP) + LETTER * TEXT * names as f64 + TICKS;
        let right = i as f64 * (width + GAP) + width;
        Column {
            left,
            right,
            from: i as f64 * (width + GAP),
            time: figure.time,
        }
        .draw(&mut svg, column);
    }
    svg.push_str("</svg>");
    svg
}

/// Where one column is.
struct Column {
    /// Where its names begin.
    from: f64,
    left: f64,
    right: f64,
    time: Scale,
}

impl Column {
    fn draw(&self, svg: &mut String, strips: &[Strip]) {
        let (mut grid, mut frame) = (String::new(), String::new());
        let mut y = ROOM;
        let mut texts = String::new();
        let mut lines = String::new();
        for strip in strips {
            self.rules(&mut grid, &mut frame, strip, y);
            self.labels(&mut texts, strip, y);
            let is_owned = !strip.class.is_empty();
            if is_owned {
                // Writing into a String cannot fail.
                let _ = write!(lines, r#"<g data-class="{}">"#, strip.class);
            }
            self.lines(&mut lines, strip, y);
            lines.push_str(if is_owned { "</g>" } else { "" });
            y += strip.height + 2.0 * ROOM;
        }
        let bottom = y - 2.0 * ROOM;
        for (value, label) in ticks(self.time) {
            let x = self.x(value);
            let _ = write!(frame, "M{} {}v4", short(x), short(bottom));
            let _ = write!(
                texts,
                r#"<text x="{}" y="{}" text-anchor="middle">{label}</text>"#,
                short(x),
                short(bottom + 15.0)
            );
        }
        let (middle, below) = (0.5 * (self.left + self.right), bottom + 28.0);
        let _ = write!(
            texts,
            r#"<text x="{}" y="{}" text-anchor="middle">time, s</text>"#,
            short(middle),
            short(below)
        );
        let _ = write!(
            svg,
            r##"<path d="{grid}" stroke="#cccccc" stroke-width=".5" fill="none"/>"##
        );
        svg.push_str(&lines);
        let _ = write!(
            svg,
            r##"<path d="{frame}" stroke="#000000" stroke-width=".8" fill="none"/>"##
        );
        svg.push_str(&texts);
    }

    fn x(&self, time: f64) -> f64 {
        let share = (time - self.time.min) / (self.time.max - self.time.min);
        self.left + share.clamp(0.0, 1.0) * (self.right - self.left)
    }

    fn rules(&self, grid: &mut String, frame: &mut String, strip: &Strip, top: f64) {
        let width = self.right - self.left;
        for (value, _) in ticks(strip.scale) {
            let y = short(place(strip, top, value));
            let _ = write!(grid, "M{} {y}h{}", short(self.left), short(width));
            let _ = write!(frame, "M{} {y}h-3", short(self.left));
        }
        for (value, _) in ticks(self.time) {
            let _ = write!(
                grid,
                "M{} {}v{}",
                short(self.x(value)),
                short(top),
                short(strip.height)
            );
        }
        let (x, y, width, height) = (
            short(self.left),
            short(top),
            short(width),
            short(strip.height),
        );
        let _ = write!(frame, "M{x} {y}h{width}v{height}h-{width}z");
    }

    fn labels(&self, texts: &mut String, strip: &Strip, top: f64) {
        for (value, label) in ticks(strip.scale) {
            let (x, y) = (
                short(self.left - 5.0),
                short(place(strip, top, value) + 0.36 * TEXT),
            );
            let _ = write!(
                texts,
                r#"<text x="{x}" y="{y}" text-anchor="end">{label}</text>"#
            );
        }
        let (x, middle) = (short(self.from), top + 0.5 * strip.height);
        let base = if strip.unit.is_empty() {
            middle + 0.36 * TEXT
        } else {
            middle - 1.5
        };
        let _ = write!(
            texts,
            r#"<text x="{x}" y="{}">{}</text>"#,
            short(base),
            escaped(&strip.name)
        );
        if !strip.unit.is_empty() {
            let (y, unit) = (short(middle + TEXT), escaped(&strip.unit));
            let _ = write!(
                texts,
                r##"<text x="{x}" y="{y}" fill="#555555">{unit}</text>"##
            );
        }
    }

    fn lines(&self, svg: &mut String, strip: &Strip, top: f64) {
        for line in &strip.lines {
            let points = line
                .points
                .iter()
                .map(|&(t, value)| (self.x(t), place(strip, top, value)));
            let d = trace(points);
            if d.is_empty() {
                continue;
            }
            let dash = if line.dash.is_empty() {
                String::new()
            } else {
                format!(r#" stroke-dasharray="{}""#, line.dash)
            };
            let (colour, width) = (line.colour, line.width);
            let _ = write!(
                svg,
                r#"<path d="{d}" stroke="{colour}" stroke-width="{width}"{dash} fill="none"/>"#
            );
        }
        let mut dots = String::new();
        for &(t, value) in &strip.dots {
            let _ = write!(
                dots,
                "M{} {}h4v4h-4z",
                short(self.x(t) - 2.0),
                short(place(strip, top, value) - 2.0)
            );
        }
        if !dots.is_empty() {
            let _ = write!(svg, r#"<path d="{dots}" fill="{EXCLUDED_COLOUR}"/>"#);
        }
    }
}

fn place(strip: &Strip, top: f64, value: f64) -> f64 {
    let share = (value - strip.scale.min) / (strip.scale.max - strip.scale.min);
    top + (1.0 - share.clamp(0.0, 1.0)) * strip.height
}

/// Multiples of the step within a scale, with what is written at them.
fn ticks(scale: Scale) -> impl Iterator<Item = (f64, String)> {
    const MOST: i32 = 50;
    let digits = match scale.decimals() {
        decimals if decimals <= 6 => Digits::Decimals(decimals),
        _ => Digits::Scientific(1),
    };
    let first = (scale.min / scale.step - 1e-6).ceil();
    let last = scale.max / scale.step + 1e-6;
    let is_sound = first.is_finite() && last.is_finite();
    (0..MOST)
        .map(move |i| first + f64::from(i))
        .take_while(move |n| is_sound && *n <= last)
        .map(move |n| (n * scale.step, digits.write(Some(n * scale.step))))
}

/// A line through points, in steps of a tenth from one to the next: sums of steps stay true to the
/// points.
fn trace(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut d = String::new();
    let mut at: Option<(i64, i64)> = None;
    for (x, y) in points {
        let (x, y) = (tenths(x), tenths(y));
        match at {
            None => {
                let _ = write!(d, "M{} {}", written(x), written(y));
            }
            Some((px, py)) => {
                let (dx, dy) = (x - px, y - py);
                let space = if dy < 0 { "" } else { " " };
                let _ = write!(d, "l{}{space}{}", written(dx), written(dy));
            }
        }
        at = Some((x, y));
    }
    d
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "places in a drawing are small"
)]
fn tenths(value: f64) -> i64 {
    (10.0 * value).round() as i64
}

/// Tenths as short as they can be written: `12`, `.5`, `-3.2`.
fn written(tenths: i64) -> String {
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    let sign = if tenths < 0 { "-" } else { "" };
    match (whole, rest) {
        (whole, 0) => format!("{sign}{whole}"),
        (0, rest) => format!("{sign}.{rest}"),
        (whole, rest) => format!("{sign}{whole}.{rest}"),
    }
}

fn short(value: f64) -> String {
    written(tenths(value))
}

/// A solid line in the ink of what was computed.
#[must_use]
pub fn ink(points: Vec<(f64, f64)>, width: f64) -> StripLine {
    StripLine {
        points,
        colour: INK,
        width,
        dash: "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure() -> StripFigure {
        let scale = Scale {
            min: -1.0,
            max: 1.0,
            step: 1.0,
        };
        let points = (0..20)
            .map(|i| (f64::from(i) * 0.5, (f64::from(i) * 0.7).sin()))
            .collect();
        let strip = Strip {
            name: "q <x>".into(),
            unit: "deg/s".into(),
            height: 40.0,
            scale,
            lines: vec![ink(points, 1.0)],
            dots: vec![(2.0, 5.0)],
            class: "c1".into(),
        };
        StripFigure {
            id: "s1".into(),
            title: "rates".into(),
            description: "a & b".into(),
            width: 400.0,
            time: Scale {
                min: 0.0,
                max: 10.0,
                step: 5.0,
            },
            columns: vec![vec![strip.clone(), strip.clone()], vec![strip]],
        }
    }

    #[test]
    fn a_strip_figure_is_well_formed_and_has_alternative_text() {
        let svg = draw(&figure());
        let document = roxmltree::Document::parse(&svg).expect("well-formed");
        let said: Vec<&str> = document
            .root_element()
            .children()
            .filter_map(|n| n.text())
            .take(2)
            .collect();
        assert_eq!(said, ["rates", "a & b"]);
        assert_eq!(
            svg.matches("time, s").count(),
            2,
            "each column has its axis"
        );
        assert_eq!(svg.matches(r#"<g data-class="c1">"#).count(), 3);
    }

    #[test]
    fn steps_of_tenths_add_up_to_the_points() {
        let d = trace([(0.04, 1.0), (0.08, 2.25), (10.0, -3.0)].into_iter());
        assert_eq!(d, "M0 1l.1 1.3l9.9-5.3");
        assert_eq!(trace(std::iter::empty()), "");
    }

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
}
