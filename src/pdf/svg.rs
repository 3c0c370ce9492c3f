//! A drawing: the part of SVG that the report's figures are made of (groups, clips, rectangles,
//! lines, paths, text), as operators of a PDF page. y points down, as in the SVG; who places the
//! drawing turns it over.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use roxmltree::Node;

use super::fonts::{Fonts, Weight};

/// A drawing ready to be placed.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    pub width: f32,
    pub height: f32,
    pub operators: String,
    /// Opacities it uses, in percent; a page names them `A25` and so on.
    pub opacities: BTreeSet<u8>,
}

/// What elements inherit.
#[derive(Clone, Debug, PartialEq)]
struct Style {
    fill: Option<[u8; 3]>,
    stroke: Option<[u8; 3]>,
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
                    style.size = value.trim_end_matches("px").parse().unwrap_or(style.size)
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

/// The colour of an attribute; none for `none`, black for what is not understood.
fn colour(value: &str) -> Option<[u8; 3]> {
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

fn dashes(value: &str) -> String {
    let numbers: Vec<f32> = numbers(value).collect();
    numbers
        .iter()
        .map(|n| number(*n))
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

/// The numbers of a list, whatever stands between them.
fn numbers(text: &str) -> impl Iterator<Item = f32> {
    text.split([' ', ',', '\n', '\t'])
        .filter_map(|n| n.parse().ok())
}

/// A number as short as a PDF may have it: two decimals at most.
pub fn number(value: f32) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() || text == "-0" || !value.is_finite() {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

/// The drawing of an `svg` element.
pub fn drawing(svg: Node, fonts: &Fonts) -> Drawing {
    let of = |name: &str| svg.attribute(name).and_then(|v| v.parse::<f32>().ok());
    let view: Vec<f32> = svg
        .attribute("viewBox")
        .map_or_else(Vec::new, |v| numbers(v).collect());
    let [width, height] = match view[..] {
        [_, _, width, height] => [width, height],
        _ => [of("width").unwrap_or(0.0), of("height").unwrap_or(0.0)],
    };
    let mut pen = Pen {
        fonts,
        clips: BTreeMap::new(),
        out: String::new(),
        set: String::new(),
        opacities: BTreeSet::new(),
        size: [width, height],
    };
    for clip in svg
        .descendants()
        .filter(|n| n.has_tag_name("clipPath") || n.tag_name().name() == "clipPath")
    {
        if let (Some(id), Some(rect)) = (clip.attribute("id"), clip.first_element_child()) {
            pen.clips.insert(id.to_owned(), pen.rectangle(rect));
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
    pen.children(svg, &Style::of(svg, &style));
    Drawing {
        width,
        height,
        operators: pen.out,
        opacities: pen.opacities,
    }
}

struct Pen<'a> {
    fonts: &'a Fonts,
    clips: BTreeMap<String, String>,
    out: String,
    /// The graphics state that was set last, so that it is not set again.
    set: String,
    opacities: BTreeSet<u8>,
    size: [f32; 2],
}

impl Pen<'_> {
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
                let [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map(|name| number(of(name)));
                self.paint(
                    &format!("{x1} {y1} m {x2} {y2} l"),
                    &Style {
                        fill: None,
                        ..style.clone()
                    },
                );
            }
            "path" => {
                let outline = path(node.attribute("d").unwrap_or(""));
                self.paint(&outline, style);
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
        let moved = node
            .attribute("transform")
            .and_then(|t| t.strip_prefix("translate(")?.strip_suffix(')'));
        if clip.is_none() && moved.is_none() {
            return self.children(node, style);
        }
        self.out.push_str("q\n");
        if let Some(moved) = moved {
            let by: Vec<f32> = numbers(moved).collect();
            let at = |i: usize| number(by.get(i).copied().unwrap_or(0.0));
            // Writing into a String cannot fail.
            let _ = writeln!(self.out, "1 0 0 1 {} {} cm", at(0), at(1));
        }
        if let Some(clip) = clip {
            let _ = writeln!(self.out, "{clip} W n");
        }
        self.set.clear();
        self.children(node, style);
        self.out.push_str("Q\n");
        self.set.clear();
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
        let [x, y, width, height] = sides.map(|(name, whole)| number(of(name, whole)));
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
        let rgb = |c: [u8; 3]| c.map(|v| number(f32::from(v) / 255.0)).join(" ");
        let mut state = format!("/A{} gs\n", style.opacity);
        self.opacities.insert(style.opacity);
        if let Some(fill) = style.fill {
            let _ = writeln!(state, "{} rg", rgb(fill));
        }
        if let Some(stroke) = style.stroke {
            let _ = writeln!(
                state,
                "{} RG {} w [{}] 0 d",
                rgb(stroke),
                number(style.width),
                style.dash
            );
        }
        if state != self.set {
            self.out.push_str(&state);
            self.set = state;
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
            format!("0 -1 -1 0 {} {}", number(x), number(y + back))
        } else {
            format!("1 0 0 -1 {} {}", number(x - back), number(y))
        };
        self.state(&Style {
            stroke: None,
            ..style.clone()
        });
        let (font, size) = (style.weight.resource(), number(style.size));
        let encoded = self.fonts.encoded(style.weight, &text);
        let _ = writeln!(
            self.out,
            "BT /{font} {size} Tf {place} Tm <{encoded}> Tj ET"
        );
    }
}

/// The data of a path as PDF operators. Arcs are half circles, as in the report's marks.
fn path(d: &str) -> String {
    let mut trace = Trace::default();
    let (mut command, mut numbers) = (' ', Vec::new());
    let mut token = String::new();
    let flush = |token: &mut String, numbers: &mut Vec<f32>| {
        numbers.extend(token.parse::<f32>());
        token.clear();
    };
    for c in d.chars().chain(['M']) {
        match c {
            'e' | '0'..='9' => token.push(c),
            '.' if !token.contains('.') => token.push(c),
            '-' if token.is_empty() || token.ends_with('e') => token.push(c),
            '.' | '-' => {
                flush(&mut token, &mut numbers);
                token.push(c);
            }
            c if c.is_ascii_alphabetic() => {
                flush(&mut token, &mut numbers);
                trace.run(command, &numbers);
                numbers.clear();
                command = c;
            }
            _ => flush(&mut token, &mut numbers),
        }
    }
    trace.out
}

#[derive(Default)]
struct Trace {
    out: String,
    at: [f32; 2],
    start: [f32; 2],
}

impl Trace {
    fn run(&mut self, command: char, numbers: &[f32]) {
        let from = |at: [f32; 2]| {
            if command.is_ascii_lowercase() {
                at
            } else {
                [0.0, 0.0]
            }
        };
        match command.to_ascii_lowercase() {
            'm' | 'l' => {
                for (i, pair) in numbers.chunks_exact(2).enumerate() {
                    let base = from(self.at);
                    self.to(
                        [base[0] + pair[0], base[1] + pair[1]],
                        command.eq_ignore_ascii_case(&'m') && i == 0,
                    );
                }
            }
            'h' => {
                for x in numbers {
                    self.to([from(self.at)[0] + x, self.at[1]], false);
                }
            }
            'v' => {
                for y in numbers {
                    self.to([self.at[0], from(self.at)[1] + y], false);
                }
            }
            'a' => {
                for arc in numbers.chunks_exact(7) {
                    let base = from(self.at);
                    self.half_circle([base[0] + arc[5], base[1] + arc[6]]);
                }
            }
            'z' => {
                self.out.push_str(" h");
                self.at = self.start;
            }
            _ => {}
        }
    }

    fn to(&mut self, point: [f32; 2], is_move: bool) {
        let operator = if is_move { 'm' } else { 'l' };
        if !self.out.is_empty() {
            self.out.push(' ');
        }
        let _ = write!(
            self.out,
            "{} {} {operator}",
            number(point[0]),
            number(point[1])
        );
        self.at = point;
        if is_move {
            self.start = point;
        }
    }

    /// A half circle, clockwise from left to right as drawn with y down, in two Bézier curves.
    fn half_circle(&mut self, end: [f32; 2]) {
        /// Handles of a quarter circle, in radii.
        const HANDLE: f32 = 0.5523;
        let [x, y] = self.at;
        let centre = [0.5 * (x + end[0]), 0.5 * (y + end[1])];
        // From the centre to the start, and a quarter turn on.
        let a = [x - centre[0], y - centre[1]];
        let b = [a[1], -a[0]];
        for (u, v) in [(a, b), (b, [-a[0], -a[1]])] {
            let at = |p: f32, q: f32| {
                [
                    centre[0] + p * u[0] + q * v[0],
                    centre[1] + p * u[1] + q * v[1],
                ]
            };
            for point in [at(1.0, HANDLE), at(HANDLE, 1.0), at(0.0, 1.0)] {
                let _ = write!(self.out, " {} {}", number(point[0]), number(point[1]));
            }
            self.out.push_str(" c");
        }
        self.at = end;
    }
}
