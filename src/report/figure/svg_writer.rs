//! Elements of an SVG drawing as text, with coordinates in tenths of a unit. Lines through many points are
//! in whole quarters of a unit: half as many characters.

use std::fmt::Write;

use super::style::FONT;
use crate::report::notation::escaped;

/// Text of a drawing.
#[derive(Clone, Debug, Default)]
pub struct SvgWriter {
    svg: String,
}

/// Appearance of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathStyle<'a> {
    /// Colour and width.
    pub stroke: Option<(&'a str, f64)>,
    /// SVG dash array; empty for a solid line.
    pub dash: &'a str,
    pub fill: Option<&'a str>,
    /// Opacity of the fill, where it is not one.
    pub fill_opacity: Option<f64>,
}

impl<'a> PathStyle<'a> {
    #[must_use]
    pub fn line(colour: &'a str, width: f64) -> PathStyle<'a> {
        PathStyle {
            stroke: Some((colour, width)),
            ..PathStyle::default()
        }
    }

    #[must_use]
    pub fn filled(colour: &'a str) -> PathStyle<'a> {
        PathStyle {
            fill: Some(colour),
            ..PathStyle::default()
        }
    }
}

/// Appearance of a text.
#[derive(Clone, Copy, Debug, Default)]
pub struct TextStyle<'a> {
    /// Colour, where it is not black.
    pub colour: Option<&'a str>,
    pub anchor: Anchor,
    /// Height, where it is not that of the drawing.
    pub size: Option<f64>,
    pub is_bold: bool,
    /// `true` for a text written upwards.
    pub is_vertical: bool,
}

impl<'a> TextStyle<'a> {
    #[must_use]
    pub const fn coloured(colour: &'a str) -> TextStyle<'a> {
        TextStyle {
            colour: Some(colour),
            anchor: Anchor::Start,
            size: None,
            is_bold: false,
            is_vertical: false,
        }
    }
}

/// Point of a text at which its coordinates are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    #[default]
    Start,
    Middle,
    End,
}

/// Alternative text of a drawing.
#[derive(Clone, Copy, Debug)]
pub struct Alternative<'a> {
    /// Prefix of the elements' ids, unique in the page.
    pub id: &'a str,
    pub title: &'a str,
    pub description: &'a str,
}

impl SvgWriter {
    /// Draws a path; nothing for empty data.
    pub fn path(&mut self, data: &str, style: PathStyle) {
        self.scaled_path("", data, style);
    }

    /// Draws data of [`polyline`]; nothing for empty data.
    pub fn lines(&mut self, data: &str, style: PathStyle) {
        let dashes = style.dash.split_whitespace().filter_map(|d| d.parse().ok());
        let dashes: Vec<String> = dashes.map(|d: f64| coordinate(QUARTERS * d)).collect();
        let style = PathStyle {
            stroke: style
                .stroke
                .map(|(colour, width)| (colour, QUARTERS * width)),
            dash: &dashes.join(" "),
            ..style
        };
        self.scaled_path(r#" transform="scale(.25)""#, data, style);
    }

    fn scaled_path(&mut self, transform: &str, data: &str, style: PathStyle) {
        if data.is_empty() {
            return;
        }
        // Writing into a String cannot fail.
        let _ = write!(self.svg, r#"<path{transform} d="{data}""#);
        if let Some((colour, width)) = style.stroke {
            let _ = write!(self.svg, r#" stroke="{colour}" stroke-width="{width}""#);
        }
        if !style.dash.is_empty() {
            let _ = write!(self.svg, r#" stroke-dasharray="{}""#, style.dash);
        }
        let _ = write!(self.svg, r#" fill="{}""#, style.fill.unwrap_or("none"));
        if let Some(opacity) = style.fill_opacity {
            let _ = write!(self.svg, r#" fill-opacity="{opacity}""#);
        }
        self.svg.push_str("/>");
    }

    /// Writes a text at a point of its base line.
    pub fn text(&mut self, (x, y): (f64, f64), text: &str, style: TextStyle) {
        let (x, y) = (coordinate(x), coordinate(y));
        // Writing into a String cannot fail.
        let _ = write!(self.svg, r#"<text x="{x}" y="{y}""#);
        self.text_style(style);
        if style.is_vertical {
            let _ = write!(self.svg, r#" transform="rotate(-90 {x} {y})""#);
        }
        let _ = write!(self.svg, ">{}</text>", escaped(text));
    }

    /// Writes horizontal texts of one appearance, whose attributes they share.
    pub fn texts(&mut self, texts: &[((f64, f64), String)], style: TextStyle) {
        if texts.is_empty() {
            return;
        }
        self.svg.push_str("<g");
        self.text_style(style);
        self.svg.push('>');
        for (place, text) in texts {
            self.text(*place, text, TextStyle::default());
        }
        self.svg.push_str("</g>");
    }

    /// Writes the attributes of a text's appearance.
    fn text_style(&mut self, style: TextStyle) {
        match style.anchor {
            Anchor::Start => {}
            Anchor::Middle => self.svg.push_str(r#" text-anchor="middle""#),
            Anchor::End => self.svg.push_str(r#" text-anchor="end""#),
        }
        // Writing into a String cannot fail.
        if let Some(colour) = style.colour {
            let _ = write!(self.svg, r#" fill="{colour}""#);
        }
        if let Some(size) = style.size {
            let _ = write!(self.svg, r#" font-size="{size}""#);
        }
        if style.is_bold {
            self.svg.push_str(r#" font-weight="bold""#);
        }
    }

    /// Opens a group with attributes, and with a tooltip unless that is empty.
    pub fn open_group(&mut self, attributes: &[(&str, &str)], tooltip: &str) {
        self.svg.push_str("<g");
        for (name, value) in attributes {
            let _ = write!(self.svg, r#" {name}="{}""#, escaped(value));
        }
        self.svg.push('>');
        if !tooltip.is_empty() {
            let _ = write!(self.svg, "<title>{}</title>", escaped(tooltip));
        }
    }

    pub fn close_group(&mut self) {
        self.svg.push_str("</g>");
    }

    /// Appends the elements of another drawing.
    pub fn append(&mut self, other: &SvgWriter) {
        self.svg.push_str(&other.svg);
    }

    /// The drawing as an element of an HTML page, as wide as its column.
    #[must_use]
    pub fn inline(self, size: (f64, f64), text_size: f64, alternative: Alternative) -> String {
        self.element("", size, text_size, alternative)
    }

    /// The drawing as a file.
    #[must_use]
    pub fn file(self, size: (f64, f64), text_size: f64, alternative: Alternative) -> String {
        let (width, height) = size;
        let attributes = format!(
            r#" xmlns="http://www.w3.org/2000/svg" width="{width:.0}" height="{height:.0}""#
        );
        self.element(&attributes, size, text_size, alternative) + "\n"
    }

    fn element(
        self,
        attributes: &str,
        (width, height): (f64, f64),
        text_size: f64,
        alternative: Alternative,
    ) -> String {
        let id = alternative.id;
        format!(
            concat!(
                r#"<svg{attributes} viewBox="0 0 {width:.0} {height:.0}" role="img" "#,
                r#"aria-labelledby="{id}-t {id}-d" font-family="{FONT}" font-size="{text_size}">"#,
                r#"<title id="{id}-t">{title}</title><desc id="{id}-d">{description}</desc>"#,
                "{svg}</svg>"
            ),
            attributes = attributes,
            width = width,
            height = height,
            id = id,
            FONT = FONT,
            text_size = text_size,
            title = escaped(alternative.title),
            description = escaped(alternative.description),
            svg = self.svg,
        )
    }
}

/// Coordinates of [`polyline`] in a unit of the drawing.
const QUARTERS: f64 = 4.0;

/// Path data of a line through points for [`SvgWriter::lines`], relative from each to the next. A
/// point is left out if the line stays within [`TOLERANCE`] of it. Steps are rounded so that their
/// sum stays true.
#[must_use]
pub fn polyline(points: impl Iterator<Item = (f64, f64)>) -> String {
    let quarters = |value: f64| rounded(QUARTERS * value);
    let points: Vec<(i64, i64)> = points.map(|(x, y)| (quarters(x), quarters(y))).collect();
    let points = simplified(&points);
    let Some(&(x, y)) = points.first() else {
        return String::new();
    };
    let mut data = format!("M{x} {y}");
    for (step, pair) in points.windows(2).enumerate() {
        let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let command = if step == 0 { "l" } else { separator(dx) };
        // Writing into a String cannot fail.
        let _ = write!(data, "{command}{dx}{}{dy}", separator(dy));
    }
    if points.len() == 1 {
        // A single point has no length: make it visible.
        data.push_str("h2");
    }
    data
}

/// Text before a number that follows another: a sign separates them.
fn separator(number: i64) -> &'static str {
    if number < 0 { "" } else { " " }
}

/// Largest distance of an omitted point from the line, in quarters of a unit: a quarter of a pixel,
/// and half of the thinnest line.
const TOLERANCE: f64 = 1.0;

/// First and last point, and every point that the line between two kept points would miss by more
/// than [`TOLERANCE`] (Ramer, Douglas and Peucker).
fn simplified(points: &[(i64, i64)]) -> Vec<(i64, i64)> {
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut is_kept = vec![false; points.len()];
    (is_kept[0], is_kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let stretch = Stretch::between(points[from], points[to]);
        let (mut farthest, mut largest) = (from, 0.0);
        for (at, point) in (from + 1..to).zip(&points[from + 1..]) {
            let distance = stretch.distance(*point);
            if distance >= largest {
                (farthest, largest) = (at, distance);
            }
        }
        if largest > stretch.distance_of_tolerance() {
            is_kept[farthest] = true;
            open.extend([(from, farthest), (farthest, to)]);
        }
    }
    let kept = points.iter().zip(is_kept).filter(|(_, kept)| *kept);
    kept.map(|(point, _)| *point).collect()
}

/// Stretch between two points. Its distances are squares times that of its length: whole numbers, without
/// a division.
struct Stretch {
    from: (i64, i64),
    dx: f64,
    dy: f64,
    /// Square of the length; one for a point.
    square: f64,
}

impl Stretch {
    fn between(from: (i64, i64), to: (i64, i64)) -> Stretch {
        let (dx, dy) = ((to.0 - from.0) as f64, (to.1 - from.1) as f64);
        Stretch {
            from,
            dx,
            dy,
            square: f64::max(dx * dx + dy * dy, 1.0),
        }
    }

    fn distance(&self, point: (i64, i64)) -> f64 {
        let Stretch {
            from,
            dx,
            dy,
            square,
        } = *self;
        let (x, y) = ((point.0 - from.0) as f64, (point.1 - from.1) as f64);
        let along = x * dx + y * dy;
        if along <= 0.0 {
            square * (x * x + y * y)
        } else if along >= square {
            square * ((x - dx).powi(2) + (y - dy).powi(2))
        } else {
            (x * dy - y * dx).powi(2)
        }
    }

    fn distance_of_tolerance(&self) -> f64 {
        TOLERANCE * TOLERANCE * self.square
    }
}

/// Data for [`SvgWriter::lines`] of a square around a point.
#[must_use]
pub fn dot((x, y): (f64, f64), side: f64) -> String {
    let [x, y, side] =
        [x - 0.5 * side, y - 0.5 * side, side].map(|value| rounded(QUARTERS * value));
    format!("M{x} {y}h{side}v{side}h-{side}z")
}

/// Path data of a rectangle.
#[must_use]
pub fn rectangle((x, y): (f64, f64), (width, height): (f64, f64)) -> String {
    let [x, y, width, height] = [x, y, width, height].map(coordinate);
    format!("M{x} {y}h{width}v{height}h-{width}z")
}

/// A coordinate rounded to tenths, as short as possible: `12`, `.5`, `-3.2`.
#[must_use]
pub fn coordinate(value: f64) -> String {
    from_tenths(tenths(value))
}

fn tenths(value: f64) -> i64 {
    rounded(10.0 * value)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "coordinates of a drawing are small"
)]
fn rounded(value: f64) -> i64 {
    value.round() as i64
}

fn from_tenths(tenths: i64) -> String {
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    let sign = if tenths < 0 { "-" } else { "" };
    match (whole, rest) {
        (whole, 0) => format!("{sign}{whole}"),
        (0, rest) => format!("{sign}.{rest}"),
        (whole, rest) => format!("{sign}{whole}.{rest}"),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn steps_of_quarters_add_up_to_the_points() {
        let data = polyline([(0.1, 1.0), (0.2, 2.3), (10.0, -3.0)].into_iter());
        assert_eq!(data, "M0 4l1 5 39-21");
        assert_eq!(polyline([(1.0, 2.0)].into_iter()), "M4 8h2");
        assert_eq!(polyline(std::iter::empty()), "");
    }

    #[test]
    fn a_dot_is_a_square_around_its_point() {
        assert_eq!(dot((10.0, 5.0), 4.0), "M32 12h16v16h-16z");
    }

    #[test]
    fn texts_alike_share_their_attributes() {
        let mut svg = SvgWriter::default();
        let end = TextStyle {
            anchor: Anchor::End,
            ..TextStyle::coloured("#555555")
        };
        svg.texts(&[((1.0, 2.0), "<".into()), ((3.0, 4.5), "b".into())], end);
        svg.texts(&[], end);
        let expected = r##"<g text-anchor="end" fill="#555555"><text x="1" y="2">&lt;</text><text x="3" y="4.5">b</text></g>"##;
        assert_eq!(svg.svg, expected);
    }

    #[test]
    fn points_on_a_straight_line_are_left_out() {
        let line = (0..100).map(|i| (f64::from(i), 5.0 + 0.1 * f64::from(i % 2)));
        assert_eq!(polyline(line), "M0 20l396 0");
        let peak = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.5), (3.0, 0.0), (4.0, 0.0)];
        assert_eq!(polyline(peak.into_iter()), "M0 0l8 2 8-2");
        let back = [(0.0, 0.0), (9.0, 0.0), (1.0, 0.0)];
        assert_eq!(polyline(back.into_iter()), "M0 0l36 0-32 0");
    }

    #[test]
    fn lines_are_as_wide_as_asked_for_at_their_scale() {
        let mut svg = SvgWriter::default();
        svg.lines(
            &polyline([(0.0, 1.0), (2.0, 3.0)].into_iter()),
            PathStyle::line("#111111", 0.6),
        );
        let expected = r##"<path transform="scale(.25)" d="M0 4l8 8" stroke="#111111" stroke-width="2.4" fill="none"/>"##;
        assert_eq!(svg.svg, expected);
    }

    /// Square of the distance of a point from the stretch between two others.
    fn distance_squared(point: (i64, i64), from: (i64, i64), to: (i64, i64)) -> f64 {
        let vector = |a: (i64, i64), b: (i64, i64)| ((b.0 - a.0) as f64, (b.1 - a.1) as f64);
        let ((x, y), (dx, dy)) = (vector(from, point), vector(from, to));
        let squared = f64::max(dx * dx + dy * dy, f64::MIN_POSITIVE);
        let share = ((x * dx + y * dy) / squared).clamp(0.0, 1.0);
        (x - share * dx).powi(2) + (y - share * dy).powi(2)
    }

    proptest! {
        #[test]
        fn no_point_is_missed_by_more_than_the_tolerance(
            points in proptest::collection::vec((-50_i64..50, -50_i64..50), 1..60),
        ) {
            let kept = simplified(&points);
            prop_assert_eq!(kept.first(), points.first());
            prop_assert_eq!(kept.last(), points.last());
            for point in &points {
                let least = kept
                    .windows(2)
                    .map(|ends| distance_squared(*point, ends[0], ends[1]))
                    .fold(if kept.len() == 1 { 0.0 } else { f64::INFINITY }, f64::min);
                let most = TOLERANCE * TOLERANCE * (1.0 + 1e-12);
                prop_assert!(least <= most, "{point:?}: {least}");
            }
        }
    }
}
