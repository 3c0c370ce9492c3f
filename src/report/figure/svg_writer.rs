//! Elements of an SVG drawing as text, with coordinates in tenths of a unit.

use std::fmt::Write;

use super::style::FONT;
use crate::report::notation::escaped;

/// Text of a drawing.
#[derive(Clone, Debug, Default)]
pub struct SvgWriter {
    svg: String,
}

/// Appearance of a path.
#[derive(Clone, Copy, Debug, Default)]
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
    /// Written upwards.
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

/// Point of a text that its coordinates give.
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
        if data.is_empty() {
            return;
        }
        // Writing into a String cannot fail.
        let _ = write!(self.svg, r#"<path d="{data}""#);
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
        let _ = write!(self.svg, r#"<text x="{x}" y="{y}""#);
        match style.anchor {
            Anchor::Start => {}
            Anchor::Middle => self.svg.push_str(r#" text-anchor="middle""#),
            Anchor::End => self.svg.push_str(r#" text-anchor="end""#),
        }
        if let Some(colour) = style.colour {
            let _ = write!(self.svg, r#" fill="{colour}""#);
        }
        if let Some(size) = style.size {
            let _ = write!(self.svg, r#" font-size="{size}""#);
        }
        if style.is_bold {
            self.svg.push_str(r#" font-weight="bold""#);
        }
        if style.is_vertical {
            let _ = write!(self.svg, r#" transform="rotate(-90 {x} {y})""#);
        }
        let _ = write!(self.svg, ">{}</text>", escaped(text));
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

/// Path data of a line through points, relative from each to the next. The sum of the steps stays
/// true to the points.
#[must_use]
pub fn polyline(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut data = String::new();
    let mut previous: Option<(i64, i64)> = None;
    let mut count = 0;
    for (x, y) in points {
        let (x, y) = (tenths(x), tenths(y));
        match previous {
            None => {
                let _ = write!(data, "M{} {}", from_tenths(x), from_tenths(y));
            }
            Some((from_x, from_y)) => {
                let (dx, dy) = (x - from_x, y - from_y);
                let space = if dy < 0 { "" } else { " " };
                let _ = write!(data, "l{}{space}{}", from_tenths(dx), from_tenths(dy));
            }
        }
        previous = Some((x, y));
        count += 1;
    }
    if count == 1 {
        // A single point has no length: make it visible.
        data.push_str("h.6");
    }
    data
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

#[expect(
    clippy::cast_possible_truncation,
    reason = "coordinates of a drawing are small"
)]
fn tenths(value: f64) -> i64 {
    (10.0 * value).round() as i64
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
    use super::*;

    #[test]
    fn steps_of_tenths_add_up_to_the_points() {
        let data = polyline([(0.04, 1.0), (0.08, 2.25), (10.0, -3.0)].into_iter());
        assert_eq!(data, "M0 1l.1 1.3l9.9-5.3");
        assert_eq!(polyline([(1.0, 2.0)].into_iter()), "M1 2h.6");
        assert_eq!(polyline(std::iter::empty()), "");
    }
}
