//! Markers of maneuver classes: shape, filled or hollow, and a dark colour, so that classes stay
//! apart in print and for colour-blind readers.

use std::fmt::Write;

use super::legend::key;
use super::style::DARK_COLOURS;

/// Outline of a marker.
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

/// Marker of one class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marker {
    shape: Shape,
    pub hollow: bool,
    pub colour: &'static str,
}

impl Marker {
    /// Marker of the n-th class. The first thirty differ.
    #[must_use]
    pub fn nth(n: usize) -> Marker {
        let shape = SHAPES[n % SHAPES.len()];
        Marker {
            shape,
            hollow: n % 2 == 1,
            colour: DARK_COLOURS[(n % 10 + n / 10) % DARK_COLOURS.len()],
        }
    }

    /// Fill colour.
    #[must_use]
    pub fn fill(self) -> &'static str {
        if self.hollow { "#ffffff" } else { self.colour }
    }

    /// Appends the outline around a point to the data of an SVG path.
    ///
    /// Shapes of the same `radius` look equally large.
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

    /// Key of the class in a legend.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_classes_have_different_markers() {
        let marks: Vec<Marker> = (0..30).map(Marker::nth).collect();
        for (i, mark) in marks.iter().enumerate() {
            assert!(
                !marks[..i].contains(mark),
                "class {i} looks like an earlier one: {mark:?}"
            );
        }
    }

    #[test]
    fn the_first_five_markers_differ_in_shape() {
        let marks: Vec<Marker> = (0..5).map(Marker::nth).collect();
        for (i, mark) in marks.iter().enumerate() {
            assert!(marks[..i].iter().all(|m| m.shape != mark.shape));
        }
    }
}
