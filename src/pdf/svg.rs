//! An SVG drawing as PDF operators.
//!
//! y points down, as in the SVG; the page that places the drawing inverts y.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use roxmltree::Node;

use super::fonts::{Fonts, Weight};
use super::operand::{Colour, Number, Rgb};
use super::svg_path::path_operators;

/// A drawing as operators.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    pub width: f32,
    pub height: f32,
    pub operators: String,
    /// Opacities used, percent; a page names them `A25` and so on.
    pub opacities: BTreeSet<u8>,
}

/// Inherited attributes.
#[derive(Clone, Debug, PartialEq)]
struct Style {
    fill: Option<Colour>,
    stroke: Option<Colour>,
    width: f32,
    dash: String,
    opacity: u8,
    size: f32,
    weight: Weight,
    anchor: f32,
}

impl Style {
    fn of(node: Node, inherited: &Style) -> Style {
        let mut style = inherited.clone();
        for attribute in node.attributes() {
            let value = attribute.value();
            match attribute.name() {
                "fill" => style.fill = colour(value),
                "stroke" => style.stroke = colour(value),
                "stroke-width" => style.width = value.parse().unwrap_or(style.width),
                "stroke-dasharray" => style.dash = dashes(value),
                "fill-opacity" | "opacity" => style.opacity = percent(value),
                "font-size" => {
                    style.size = value.trim_end_matches("px").parse().unwrap_or(style.size);
                }
                "font-weight" => {
                    style.weight = if value == "bold" {
                        Weight::Bold
                    } else {
                        Weight::Regular
                    }
                }
                "text-anchor" => {
                    style.anchor = [("middle", 0.5), ("end", 1.0)]
                        .iter()
                        .find(|a| a.0 == value)
                        .map_or(0.0, |a| a.1);
                }
                _ => {}
            }
        }
        style
    }
}

/// Colour of an attribute; `None` for `none`, black for an unsupported notation.
fn colour(value: &str) -> Option<Colour> {
    let hex = |digits: &str| u8::from_str_radix(digits, 16).unwrap_or(0);
    match value.strip_prefix('#') {
        Some(d) if d.len() == 6 && d.is_ascii() => {
            Some([hex(&d[..2]), hex(&d[2..4]), hex(&d[4..])])
        }
        Some(d) if d.len() == 3 && d.is_ascii() => Some([0, 1, 2].map(|i| 17 * hex(&d[i..=i]))),
        _ if value == "none" => None,
        _ if value == "white" => Some([255; 3]),
        _ => Some([0; 3]),
    }
}

/// Matrix of a `translate` or `scale`.
fn matrix(transform: &str) -> Option<String> {
    let (name, rest) = transform.split_once('(')?;
    let by: Vec<f32> = numbers(rest.strip_suffix(')')?).collect();
    let at = |i: usize| by.get(i).copied().map(Number);
    let first = at(0)?;
    match name {
        "translate" => Some(format!("1 0 0 1 {first} {}", at(1).unwrap_or(Number(0.0)))),
        "scale" => Some(format!("{first} 0 0 {} 0 0", at(1).unwrap_or(first))),
        _ => None,
    }
}

fn dashes(value: &str) -> String {
    let numbers: Vec<f32> = numbers(value).collect();
    numbers
        .iter()
        .map(|n| Number(*n).to_string())
        .collect::<Vec<_>>()
        .join(" ")
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to 0 to 100"
)]
fn percent(value: &str) -> u8 {
    (100.0 * value.parse::<f32>().unwrap_or(1.0))
        .round()
        .clamp(0.0, 100.0) as u8
}

/// Numbers of a list, separated by commas or white space.
fn numbers(text: &str) -> impl Iterator<Item = f32> {
    text.split([' ', ',', '\n', '\t'])
        .filter_map(|n| n.parse().ok())
}

/// Width and height of an `svg` element in its own coordinates.
pub fn size(svg: Node) -> [f32; 2] {
    let of = |name: &str| svg.attribute(name).and_then(|v| v.parse::<f32>().ok());
    let view: Vec<f32> = svg
        .attribute("viewBox")
        .map_or_else(Vec::new, |v| numbers(v).collect());
    match view[..] {
        [_, _, width, height] => [width, height],
        _ => [of("width").unwrap_or(0.0), of("height").unwrap_or(0.0)],
    }
}

/// Converts an `svg` element.
pub fn drawing(svg: Node, fonts: &Fonts) -> Drawing {
    let mut reader = SvgReader {
        fonts,
        clips: BTreeMap::new(),
        out: String::new(),
        graphics_state: String::new(),
        opacities: BTreeSet::new(),
        size: size(svg),
    };
    for clip in svg
        .descendants()
        .filter(|n| n.has_tag_name("clipPath") || n.tag_name().name() == "clipPath")
    {
        if let (Some(id), Some(rect)) = (clip.attribute("id"), clip.first_element_child()) {
            reader.clips.insert(id.to_owned(), reader.rectangle(rect));
        }
    }
    let style = Style {
        fill: Some([0; 3]),
        stroke: None,
        width: 1.0,
        dash: String::new(),
        opacity: 100,
        size: 14.0,
        weight: Weight::Regular,
        anchor: 0.0,
    };
    reader.children(svg, &Style::of(svg, &style));
    let [width, height] = reader.size;
    Drawing {
        width,
        height,
        operators: reader.out,
        opacities: reader.opacities,
    }
}

struct SvgReader<'a> {
    fonts: &'a Fonts,
    clips: BTreeMap<String, String>,
    out: String,
    /// Operators of the current graphics state, which are not repeated.
    graphics_state: String,
    opacities: BTreeSet<u8>,
    size: [f32; 2],
}

impl SvgReader<'_> {
    fn children(&mut self, node: Node, style: &Style) {
        for child in node.children().filter(Node::is_element) {
            self.element(child, &Style::of(child, style));
        }
    }

    fn element(&mut self, node: Node, style: &Style) {
        let of = |name: &str| {
            node.attribute(name)
                .and_then(|v| v.parse::<f32>().ok())
                .unwrap_or(0.0)
        };
        match node.tag_name().name() {
            "g" | "a" => self.group(node, style),
            "rect" => {
                let outline = self.rectangle(node);
                self.paint(&outline, style);
            }
            "line" => {
                let [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map(|name| Number(of(name)));
                self.paint(
                    &format!("{x1} {y1} m {x2} {y2} l"),
                    &Style {
                        fill: None,
                        ..style.clone()
                    },
                );
            }
            "path" => {
                let outline = path_operators(node.attribute("d").unwrap_or(""));
                self.transformed(node, |own| own.paint(&outline, style));
            }
            "text" => self.text(node, style, of("x"), of("y")),
            _ => {}
        }
    }

    fn group(&mut self, node: Node, style: &Style) {
        let clip = node
            .attribute("clip-path")
            .and_then(|c| c.strip_prefix("url(#")?.strip_suffix(')'));
        let clip = clip.and_then(|id| self.clips.get(id)).cloned();
        self.transformed(node, |own| {
            let Some(clip) = clip else {
                return own.children(node, style);
            };
            own.saved(|own| {
                // Writing into a String cannot fail.
                let _ = writeln!(own.out, "{clip} W n");
                own.children(node, style);
            });
        });
    }

    /// Draws what a `translate` or `scale` of an element applies to.
    fn transformed(&mut self, node: Node, draw: impl FnOnce(&mut Self)) {
        let Some(matrix) = node.attribute("transform").and_then(matrix) else {
            return draw(self);
        };
        self.saved(|own| {
            let _ = writeln!(own.out, "{matrix} cm");
            draw(own);
        });
    }

    /// Draws in a graphics state of its own.
    fn saved(&mut self, draw: impl FnOnce(&mut Self)) {
        self.out.push_str("q\n");
        self.graphics_state.clear();
        draw(self);
        self.out.push_str("Q\n");
        self.graphics_state.clear();
    }

    fn rectangle(&self, node: Node) -> String {
        let of = |name: &str, whole: f32| match node.attribute(name) {
            Some("100%") => whole,
            Some(value) => value.parse().unwrap_or(0.0),
            None => 0.0,
        };
        let sides = [
            ("x", 0.0),
            ("y", 0.0),
            ("width", self.size[0]),
            ("height", self.size[1]),
        ];
        let [x, y, width, height] = sides.map(|(name, whole)| Number(of(name, whole)));
        format!("{x} {y} {width} {height} re")
    }

    fn paint(&mut self, outline: &str, style: &Style) {
        let operator = match (style.fill, style.stroke) {
            (Some(_), Some(_)) if style.width > 0.0 => "B",
            (None, Some(_)) if style.width > 0.0 => "S",
            (Some(_), _) => "f",
            _ => return,
        };
        if outline.is_empty() {
            return;
        }
        self.state(style);
        let _ = writeln!(self.out, "{outline} {operator}");
    }

    fn state(&mut self, style: &Style) {
        let mut state = format!("/A{} gs\n", style.opacity);
        self.opacities.insert(style.opacity);
        if let Some(fill) = style.fill {
            let _ = writeln!(state, "{} rg", Rgb(fill));
        }
        if let Some(stroke) = style.stroke {
            let _ = writeln!(
                state,
                "{} RG {} w [{}] 0 d",
                Rgb(stroke),
                Number(style.width),
                style.dash
            );
        }
        if state != self.graphics_state {
            self.out.push_str(&state);
            self.graphics_state = state;
        }
    }

    fn text(&mut self, node: Node, style: &Style, x: f32, y: f32) {
        let text: String = node
            .descendants()
            .filter(Node::is_text)
            .filter_map(|n| n.text())
            .collect();
        let back = style.anchor * self.fonts.width(style.weight, style.size, &text);
        let is_upright = node
            .attribute("transform")
            .is_some_and(|t| t.starts_with("rotate(-90"));
        let place = if is_upright {
            format!("0 -1 -1 0 {} {}", Number(x), Number(y + back))
        } else {
            format!("1 0 0 -1 {} {}", Number(x - back), Number(y))
        };
        self.state(&Style {
            stroke: None,
            ..style.clone()
        });
        let (font, size) = (style.weight.resource(), Number(style.size));
        let encoded = self.fonts.glyph_numbers(style.weight, &text);
        let _ = writeln!(
            self.out,
            "BT /{font} {size} Tf {place} Tm <{encoded}> Tj ET"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn operators(elements: &str) -> String {
        let svg = format!(r#"<svg viewBox="0 0 9 9">{elements}</svg>"#);
        let xml = roxmltree::Document::parse(&svg).unwrap();
        drawing(xml.root_element(), &Fonts::load().unwrap()).operators
    }

    #[test]
    fn a_transform_holds_for_its_element_alone() {
        let line = r##"<path transform="scale(.25)" d="M0 4l8 8" stroke="#000" stroke-width="4" fill="none"/>"##;
        let own = "/A100 gs\n0 0 0 RG 4 w [] 0 d\n0 4 m 8 12 l S\n";
        assert_eq!(
            operators(line),
            format!("q\n0.25 0 0 0.25 0 0 cm\n{own}Q\n")
        );
        let group = r#"<g transform="translate(1,2)"><rect width="1" height="1"/></g><rect width="2" height="2"/>"#;
        let first = "/A100 gs\n0 0 0 rg\n0 0 1 1 re f\n";
        let second = "/A100 gs\n0 0 0 rg\n0 0 2 2 re f\n";
        assert_eq!(
            operators(group),
            format!("q\n1 0 0 1 1 2 cm\n{first}Q\n{second}")
        );
    }
}
