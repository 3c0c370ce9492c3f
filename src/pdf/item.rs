//! What the pages are filled with: items, one under the other, each with marks at places within it,
//! y downwards.

use std::sync::Arc;

use super::fonts::Weight;
use super::svg::Drawing;

/// One colour of a text or a box.
pub type Colour = [u8; 3];

pub const INK: Colour = [22, 24, 28];
pub const SOFT: Colour = [85, 91, 102];
pub const RULE: Colour = [200, 204, 210];

/// How a text is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    pub weight: Weight,
    /// pt.
    pub size: f32,
    /// How far above the line of the text, pt.
    pub rise: f32,
    pub slanted: bool,
    pub colour: Colour,
}

impl Style {
    pub const fn of_size(size: f32) -> Style {
        Style {
            weight: Weight::Regular,
            size,
            rise: 0.0,
            slanted: false,
            colour: INK,
        }
    }

    pub fn bold(self) -> Style {
        Style {
            weight: Weight::Bold,
            ..self
        }
    }
}

/// Something at a place of an item.
#[derive(Clone, Debug)]
pub enum Mark {
    /// A text from its base line's left end.
    Text {
        x: f32,
        y: f32,
        style: Style,
        text: String,
    },
    /// A drawing from its upper left corner, so many times as large as it is.
    Drawing {
        x: f32,
        y: f32,
        scale: f32,
        drawing: Arc<Drawing>,
    },
    /// A filled rectangle.
    Fill {
        x: f32,
        y: f32,
        width: f32,
        height: f32,
        colour: Colour,
    },
    /// What leads to an anchor when it is pointed at.
    Link {
        x: f32,
        y: f32,
        width: f32,
        height: f32,
        target: String,
    },
    /// Where links lead.
    Anchor { id: String },
    /// The page of an anchor, after a sign, with its right end here.
    PageOf {
        x: f32,
        y: f32,
        style: Style,
        prefix: &'static str,
        target: String,
    },
    /// A heading for the outline: level from 0.
    Heading { level: usize, title: String },
}

/// What stands together: a line, a row, a figure.
#[derive(Clone, Debug, Default)]
pub struct Item {
    pub height: f32,
    pub marks: Vec<Mark>,
    /// Stays with what follows.
    pub keep: bool,
    /// Stands again at the top of a page that the item begins.
    pub head: Option<Arc<Item>>,
    /// Nothing but room, which no page begins with.
    pub is_room: bool,
    /// A new page begins here.
    pub breaks: bool,
}

impl Item {
    pub fn room(height: f32) -> Item {
        Item {
            height,
            is_room: true,
            ..Item::default()
        }
    }

    pub fn page_break() -> Item {
        Item {
            breaks: true,
            is_room: true,
            ..Item::default()
        }
    }

    /// The marks of another item moved by so much.
    pub fn absorb(&mut self, other: &Item, dx: f32, dy: f32) {
        self.marks
            .extend(other.marks.iter().map(|mark| mark.moved(dx, dy)));
    }
}

impl Mark {
    pub fn moved(&self, dx: f32, dy: f32) -> Mark {
        let mut mark = self.clone();
        match &mut mark {
            Mark::Text { x, y, .. }
            | Mark::Drawing { x, y, .. }
            | Mark::Fill { x, y, .. }
            | Mark::Link { x, y, .. }
            | Mark::PageOf { x, y, .. } => {
                *x += dx;
                *y += dy;
            }
            Mark::Anchor { .. } | Mark::Heading { .. } => {}
        }
        mark
    }
}
