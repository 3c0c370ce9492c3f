//! Items of neighbouring elements, and what their surroundings need of them.

use super::item::{Item, PlacedMark, indented, joined};

/// Items of some elements.
#[derive(Debug, Default)]
pub struct BlockItems {
    pub items: Vec<Item>,
    /// Ids of elements without an item; the next item is their place.
    anchors: Vec<String>,
    /// Height of all drawings, pt.
    pub drawn_height: f32,
}

impl BlockItems {
    pub fn of(items: Vec<Item>) -> BlockItems {
        BlockItems {
            items,
            ..BlockItems::default()
        }
    }

    pub fn of_drawing(item: Item) -> BlockItems {
        BlockItems {
            drawn_height: item.height,
            ..BlockItems::of(vec![item])
        }
    }

    /// Items of neighbours one after the other.
    pub fn in_order(parts: Vec<BlockItems>) -> BlockItems {
        let mut all = BlockItems::default();
        for part in parts {
            all.add(part);
        }
        all
    }

    /// The beginning of an element with this id, if it has one.
    pub fn with_anchor(id: Option<&str>) -> BlockItems {
        BlockItems {
            anchors: id.map(str::to_owned).into_iter().collect(),
            ..BlockItems::default()
        }
    }

    /// Adds what follows. Its first item is the place of the anchors without one.
    pub fn add(&mut self, mut next: BlockItems) {
        if let Some(first) = next.items.iter_mut().find(|i| !i.is_room) {
            let anchors = self.anchors.drain(..);
            first
                .marks
                .extend(anchors.map(|id| PlacedMark::Anchor { id }));
        }
        self.items.append(&mut next.items);
        self.anchors.append(&mut next.anchors);
        self.drawn_height += next.drawn_height;
    }

    /// Takes the items out, joined to one. Anchors without an item stay.
    pub fn take_joined(&mut self) -> Item {
        joined(std::mem::take(&mut self.items))
    }

    /// The items moved to the right.
    pub fn indented(self, indent: f32) -> BlockItems {
        BlockItems {
            items: indented(self.items, indent),
            ..self
        }
    }
}
