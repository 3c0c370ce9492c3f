//! Items: what pages are filled with, one under the other.
//!
//! An item has marks at places within it, y downwards.

use std::sync::Arc;

use super::drawing_stream::DrawingStream;
use super::fonts::Weight;
use super::operand::Colour;
use super::svg::Drawing;

pub const INK: Colour = [22, 24, 28];
pub const SOFT: Colour = [85, 91, 102];
pub const RULE: Colour = [200, 204, 210];

/// Appearance of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    pub weight: Weight,
    /// Size, pt.
    pub size: f32,
    /// Height above the base line, pt.
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

/// A mark at a place of an item.
#[derive(Clone, Debug)]
pub enum PlacedMark {
    /// A text from its base line's left end.
    Text {
        x: f32,
        y: f32,
        style: Style,
        text: String,
    },
    /// A scaled drawing within a line, from its upper left corner.
    Drawing {
        x: f32,
        y: f32,
        scale: f32,
        drawing: Arc<Drawing>,
    },
    /// A scaled drawing between paragraphs, from its upper left corner.
    DrawingStream {
        x: f32,
        y: f32,
        scale: f32,
        drawing: DrawingStream,
    },
    /// A filled rectangle.
    Fill {
        x: f32,
        y: f32,
        width: f32,
        height: f32,
        colour: Colour,
    },
    /// A rectangle that leads to an anchor.
    Link {
        x: f32,
        y: f32,
        width: f32,
        height: f32,
        target: String,
    },
    /// Target of links.
    Anchor { id: String },
    /// The number of an anchor's page after a sign, ending at a place.
    PageOf {
        x: f32,
        y: f32,
        style: Style,
        prefix: &'static str,
        target: String,
    },
    /// A heading for the outline: level from 0.
    Heading { level: usize, title: String },
    /// Place of the table of contents.
    Contents,
}

/// A line, a row or a figure: never torn apart.
#[derive(Clone, Debug, Default)]
pub struct Item {
    pub height: f32,
    pub marks: Vec<PlacedMark>,
    /// `true` if the item stays on the page of the next item.
    pub keep: bool,
    /// Repeated at the top of a page that this item begins.
    pub head: Option<Arc<Item>>,
    /// Empty space, which no page begins with.
    pub is_room: bool,
    /// `true` if the item begins a page.
    pub breaks: bool,
}

impl Item {
    /// Empty space.
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

    /// Adds the marks of another item, moved.
    pub fn absorb(&mut self, other: Item, dx: f32, dy: f32) {
        let marks = other.marks.into_iter();
        self.marks.extend(marks.map(|mark| mark.shifted_by(dx, dy)));
    }
}

impl PlacedMark {
    /// The mark moved by a distance.
    pub fn shifted_by(mut self, dx: f32, dy: f32) -> PlacedMark {
        match &mut self {
            PlacedMark::Text { x, y, .. }
            | PlacedMark::Drawing { x, y, .. }
            | PlacedMark::DrawingStream { x, y, .. }
            | PlacedMark::Fill { x, y, .. }
            | PlacedMark::Link { x, y, .. }
            | PlacedMark::PageOf { x, y, .. } => {
                *x += dx;
                *y += dy;
            }
            PlacedMark::Anchor { .. } | PlacedMark::Heading { .. } | PlacedMark::Contents => {}
        }
        self
    }
}

/// Joins items to one, which is not torn apart.
pub fn joined(items: Vec<Item>) -> Item {
    let mut all = Item::default();
    for item in items {
        let (y, height) = (all.height, item.height);
        all.absorb(item, 0.0, y);
        all.height += height;
    }
    all
}

/// Moves items to the right.
pub fn indented(mut items: Vec<Item>, indent: f32) -> Vec<Item> {
    for item in &mut items {
        let marks = std::mem::take(&mut item.marks).into_iter();
        item.marks = marks.map(|m| m.shifted_by(indent, 0.0)).collect();
    }
    items
}
