//! The mark of each maneuver class: shape, solid or hollow, and a dark colour, so that classes stay
//! apart in print and for the colour-blind.

use std::fmt::Write;

use serde::Serialize;

/// One entry of a legend.
#[derive(Clone, Debug, Serialize)]
pub struct LegendView {
    pub key: String,
    pub label: String,
}

/// The outline of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    TriangleDown,
}

const SHAPES: [Shape; 5] = [
    Shape::Circle,
    Shape::Square,
    Shape::Triangle,
    Shape::Diamond,
    Shape::TriangleDown,
];

/// Dark enough on white paper, and apart from each other in lightness too.
const COLOURS: [&str; 6] = [
    "#111111", "#0060a8", "#b34700", "#6a2c91", "#00664b", "#7a5200",
];

/// How one class is marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    shape: Shape,
    pub hollow: bool,
    pub colour: &'static str,
}

impl Mark {
    /// The mark of the n-th class of its axis. Thirty of them differ.
    #[must_use]
    pub fn nth(n: usize) -> Mark {
        let shape = SHAPES[n % SHAPES.len()];
        Mark {
            shape,
            hollow: n % 2 == 1,
            colour: COLOURS[(n % 10 + n / 10) % COLOURS.len()],
        }
    }

    /// What it is filled with.
    #[must_use]
    pub fn fill(self) -> &'static str {
        if self.hollow { "#ffffff" } else { self.colour }
    }

    /// Appends its outline around a point to the data of an SVG path; `radius` makes all shapes
    /// look equally large.
    pub fn outline(self, path: &mut String, x: f64, y: f64, radius: f64) {
        let polygon = |path: &mut String, corners: &[(f64, f64)]| {
            for (i, (dx, dy)) in corners.iter().enumerate() {
                let pen = if i == 0 { 'M' } else { 'L' };
                // Writing into a String cannot fail.
                let _ = write!(path, "{pen}{:.1} {:.1}", x + dx * radius, y + dy * radius);
            }
            path.push('Z');
        };
        match self.shape {
            Shape::Circle => {
                let d = 2.0 * radius;
                let _ = write!(
                    path,
                    "M{:.1} {y:.1}a{radius} {radius} 0 1 0 {d} 0a{radius} {radius} 0 1 0 -{d} 0",
                    x - radius
                );
            }
            Shape::Square => polygon(path, &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
            Shape::Triangle => polygon(path, &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)]),
            Shape::Diamond => polygon(path, &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)]),
            Shape::TriangleDown => polygon(path, &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)]),
        }
    }

    /// The mark as a key for a legend.
    #[must_use]
    pub fn key(self) -> String {
        let mut path = String::new();
        self.outline(&mut path, 6.0, 6.0, 4.0);
        key(
            12,
            &format!(
                r#"<path d="{path}" fill="{}" stroke="{}" stroke-width="1.3"/>"#,
                self.fill(),
                self.colour
            ),
        )
    }
}

/// A small drawing that stands before a word of a legend.
#[must_use]
pub fn key(width: u32, content: &str) -> String {
    format!(
        r#"<svg class="key" viewBox="0 0 {width} 12" width="{width}" height="12" aria-hidden="true">{content}</svg>"#
    )
}

/// The content of a key for a line; no dashes when `dash` is empty.
#[must_use]
pub fn line(colour: &str, dash: &str, width: f64) -> String {
    let dash = if dash.is_empty() { "none" } else { dash };
    format!(
        r#"<path d="M0 6h24" stroke="{colour}" stroke-width="{width}" stroke-dasharray="{dash}" fill="none"/>"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_classes_of_one_axis_have_marks_of_their_own() {
        let marks: Vec<Mark> = (0..30).map(Mark::nth).collect();
        for (i, mark) in marks.iter().enumerate() {
            assert!(
                !marks[..i].contains(mark),
                "class {i} looks like an earlier one: {mark:?}"
            );
        }
    }

    #[test]
    fn the_first_five_differ_in_shape_alone() {
        let marks: Vec<Mark> = (0..5).map(Mark::nth).collect();
        for (i, mark) in marks.iter().enumerate() {
            assert!(marks[..i].iter().all(|m| m.shape != mark.shape));
        }
    }
}
