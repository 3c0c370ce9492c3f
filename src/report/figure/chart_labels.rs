//! Frame of a chart, and labels inside it that do not cover each other.

/// Half the width of a page, where text of 11 units is over 7 pt.
pub const SIZE: (f64, f64) = (400.0, 240.0);
pub const TEXT: f64 = 11.0;
/// Left, top, right and bottom margin of the frame.
pub const MARGINS: [f64; 4] = [52.0, 8.0, 10.0, 36.0];
/// Width of a letter over its height: an upper estimate.
const LETTER: f64 = 0.6;
/// Share of the text's height above the base line.
pub const ASCENT: f64 = 0.8;
/// Distance of a label from the side of its box.
const LABEL_GAP: f64 = 4.0;

/// Distances of a label from its point; the first at which it is free counts.
pub const LABEL_GAPS: [f64; 5] = [3.0, 6.0, 12.0, 20.0, 30.0];

/// Left, top, right and bottom of an area.
pub type Area = [f64; 4];

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Areas of the labels written so far.
#[derive(Debug, Default)]
pub struct Labels {
    areas: Vec<Area>,
}

impl Labels {
    /// Takes the first place inside the frame that overlaps neither a label nor one of the areas to avoid.
    /// Returns the left end of the text's base line.
    pub fn place(
        &mut self,
        text: &str,
        corners: &[(f64, f64)],
        avoided: &[Area],
    ) -> Option<(f64, f64)> {
        let [left, top, right, bottom] = frame();
        let width = width_of(text);
        let areas = corners.iter().map(|(x, y)| [*x, *y, x + width, y + TEXT]);
        let is_free = |area: &Area| {
            area[0] >= left
                && area[1] >= top
                && area[2] <= right
                && area[3] <= bottom
                && !self.areas.iter().chain(avoided).any(|a| overlap(a, area))
        };
        let area = areas.into_iter().find(is_free)?;
        self.areas.push(area);
        Some((area[0], area[1] + ASCENT * TEXT))
    }
}

/// Frame inside the margins.
pub fn frame() -> Area {
    [
        MARGINS[0],
        MARGINS[1],
        SIZE.0 - MARGINS[2],
        SIZE.1 - MARGINS[3],
    ]
}

/// Width of a text: an upper estimate.
pub fn width_of(text: &str) -> f64 {
    LETTER * TEXT * text.chars().count() as f64
}

/// Upper left ends of a label in the corners of a box: top right, bottom left, top left, bottom right.
pub fn corners_inside(label: &str, [from, upper, to, lower]: &Area) -> [(f64, f64); 4] {
    let width = width_of(label);
    let (left, right) = (from + LABEL_GAP, to - LABEL_GAP - width);
    let (top, bottom) = (upper + LABEL_GAP, lower - LABEL_GAP - TEXT);
    [(right, top), (left, bottom), (left, top), (right, bottom)]
}
