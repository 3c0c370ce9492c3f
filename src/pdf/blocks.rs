//! Block elements as items: headings, paragraphs, lists, figures, children side by side.

use std::sync::Arc;

use roxmltree::Node;

use super::elements::{has_class, is_block, is_screen_only, plain_text};
use super::fonts::Fonts;
use super::inline_text::{InlineReader, LineLayout, lines};
use super::item::{INK, Item, PlacedMark, SOFT, Style, indented, joined};
use super::svg;
use super::table;

/// Size of running text, pt.
pub const TEXT_SIZE: f32 = 9.0;
const SMALL_SIZE: f32 = 8.0;
const CODE_SIZE: f32 = 7.0;
/// Sizes of `h1`, `h2` and `h3`, pt.
const TITLE_SIZE: f32 = 18.0;
const CHAPTER_SIZE: f32 = 13.0;
const SECTION_SIZE: f32 = 10.5;
/// Gap between children side by side, pt.
const PAIR_GAP: f32 = 16.0;
/// Largest scale of a drawing, pt per unit of its coordinates.
const LARGEST_UNIT: f32 = 1.0;
const LIST_INDENT: f32 = 11.0;
const DEFINITION_INDENT: f32 = 90.0;
/// Space after an entry of a list, pt.
const ENTRY_GAP: f32 = 1.5;

/// Smallest scale of the drawings of an element that is to fit on one page: their text stays near 5 pt.
const LEAST_SHRINKING: f32 = 0.7;

/// Maker of items from elements.
#[derive(Debug)]
pub struct Blocks<'a> {
    fonts: &'a Fonts,
    /// Ids of open elements that have no item yet.
    pending_anchors: Vec<String>,
    /// Height of a page, pt.
    page_height: f32,
    /// Scale of drawings over that of their column.
    shrinking: f32,
    /// Height of all drawings so far, pt.
    drawn_height: f32,
}

impl<'a> Blocks<'a> {
    pub fn new(fonts: &'a Fonts, page_height: f32) -> Self {
        Blocks {
            fonts,
            pending_anchors: Vec::new(),
            page_height,
            shrinking: 1.0,
            drawn_height: 0.0,
        }
    }

    /// Items of an element's children, in a column of a width (pt).
    pub fn children(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        let mut items = Vec::new();
        let mut reader = InlineReader::new(self.fonts);
        for child in node.children() {
            if child.is_element() && is_block(child) {
                let text = std::mem::replace(&mut reader, InlineReader::new(self.fonts));
                self.add_text(text, width, style, &mut items);
                let block = self.block(child, width, style);
                items.extend(block);
            } else {
                reader.read(child, style, None);
            }
        }
        self.add_text(reader, width, style, &mut items);
        items
    }

    fn add_text(&mut self, text: InlineReader, width: f32, style: Style, items: &mut Vec<Item>) {
        let layout = LineLayout::left(width, style.size);
        let lines = lines(&text.words(), layout, self.fonts);
        self.add(lines, items);
    }

    /// Adds items, the first of them with the pending anchors.
    fn add(&mut self, mut new: Vec<Item>, items: &mut Vec<Item>) {
        if let Some(first) = new.iter_mut().find(|i| !i.is_room) {
            let anchors = self.pending_anchors.drain(..);
            first
                .marks
                .extend(anchors.map(|id| PlacedMark::Anchor { id }));
        }
        items.append(&mut new);
    }

    /// Items of a block element with the space after it.
    fn block(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        if is_screen_only(node) {
            return Vec::new();
        }
        self.pending_anchors
            .extend(node.attribute("id").map(str::to_owned));
        let mut items = Vec::new();
        if has_class(node, "new-page") {
            items.push(Item::page_break());
        }
        if node.tag_name().name() == "nav" {
            items.push(Item {
                marks: vec![PlacedMark::Contents],
                ..Item::default()
            });
        } else {
            let (made, space_after) = if has_class(node, "one-page") {
                self.on_one_page(node, width, style)
            } else {
                self.element(node, width, style)
            };
            self.add(made, &mut items);
            items.push(Item::room(space_after));
        }
        items
    }

    /// Items of an element, with smaller drawings where it then fits on one page.
    fn on_one_page(&mut self, node: Node, width: f32, style: Style) -> (Vec<Item>, f32) {
        let (anchors, drawn_before) = (self.pending_anchors.clone(), self.drawn_height);
        let made = self.element(node, width, style);
        let drawn = self.drawn_height - drawn_before;
        let excess = height_on_page(&made.0) - self.page_height;
        let shrinking = self.shrinking * (drawn - excess) / drawn.max(1.0);
        if excess <= 0.0 || shrinking < LEAST_SHRINKING {
            return made;
        }
        self.pending_anchors = anchors;
        let usual = std::mem::replace(&mut self.shrinking, shrinking);
        let smaller = self.element(node, width, style);
        self.shrinking = usual;
        smaller
    }

    /// Items of an element, and the space after it (pt).
    fn element(&mut self, node: Node, width: f32, style: Style) -> (Vec<Item>, f32) {
        let small = Style::of_size(SMALL_SIZE);
        let note = Style {
            colour: SOFT,
            ..small
        };
        match node.tag_name().name() {
            "h1" => (self.heading(node, width, TITLE_SIZE, None), 4.0),
            "h2" => (self.heading(node, width, CHAPTER_SIZE, Some(0)), 3.0),
            "h3" => (self.heading(node, width, SECTION_SIZE, Some(1)), 2.0),
            "h4" | "summary" => (self.heading(node, width, TEXT_SIZE, None), 1.0),
            "p" if has_class(node, "note") => (self.children(node, width, note), 4.0),
            "p" => (self.children(node, width, style), 5.0),
            "ul" => (self.list(node, width, style), 4.0),
            "dl" => (self.definitions(node, width, style), 5.0),
            "pre" => (self.preserved(node, width), 5.0),
            "table" => (table::rows(node, width, self.fonts), 6.0),
            "svg" => (self.drawing(node, width), 1.0),
            "figcaption" => (self.children(node, width, small), 1.0),
            "figure" => (vec![joined(self.children(node, width, style))], 8.0),
            "div" if has_class(node, "small") => (self.children(node, width, small), 2.0),
            "div" if has_class(node, "pairs") => (self.pairs(node, width, style), 2.0),
            _ => (self.children(node, width, style), 0.0),
        }
    }

    /// A bold heading that stays with what follows. Level 0 is a chapter, under a rule.
    fn heading(&mut self, node: Node, width: f32, size: f32, level: Option<usize>) -> Vec<Item> {
        let mut lines = self.children(node, width, Style::of_size(size).bold());
        for line in &mut lines {
            line.keep = true;
        }
        if let (Some(first), Some(level)) = (lines.first_mut(), level) {
            let title = plain_text(node);
            first.marks.push(PlacedMark::Heading { level, title });
            if level == 0 {
                first.marks.push(PlacedMark::Fill {
                    x: 0.0,
                    y: -3.0,
                    width,
                    height: 0.9,
                    colour: INK,
                });
            }
        }
        lines.insert(0, Item::room(0.7 * size));
        lines
    }

    fn list(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        let mut items = Vec::new();
        for entry in node.children().filter(|n| n.has_tag_name("li")) {
            let lines = self.children(entry, width - LIST_INDENT, style);
            let mut lines = indented(lines, LIST_INDENT);
            if let Some(first) = lines.first_mut() {
                first.marks.push(PlacedMark::Text {
                    x: 2.0,
                    y: style.size * 1.02,
                    style,
                    text: "\u{2022}".to_owned(),
                });
            }
            lines.push(Item::room(ENTRY_GAP));
            items.extend(lines);
        }
        items
    }

    /// Terms with their definitions beside them.
    fn definitions(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        let term_style = Style {
            colour: SOFT,
            ..style
        };
        let mut items: Vec<Item> = Vec::new();
        let mut term = None;
        for entry in node.descendants() {
            if entry.has_tag_name("dt") {
                let lines = self.children(entry, DEFINITION_INDENT - 6.0, term_style);
                term = Some(joined(lines));
            } else if entry.has_tag_name("dd") {
                let lines = self.children(entry, width - DEFINITION_INDENT, style);
                let mut lines = indented(lines, DEFINITION_INDENT);
                if let Some(term) = term.take() {
                    put_beside(term, &mut lines);
                }
                lines.push(Item::room(ENTRY_GAP));
                items.extend(lines);
            }
        }
        items
    }

    fn preserved(&mut self, node: Node, width: f32) -> Vec<Item> {
        let mut reader = InlineReader::preserving(self.fonts);
        for child in node.children() {
            reader.read(child, Style::of_size(CODE_SIZE), None);
        }
        let layout = LineLayout::left(width, CODE_SIZE);
        lines(&reader.words(), layout, self.fonts)
    }

    fn drawing(&mut self, node: Node, width: f32) -> Vec<Item> {
        let drawing = svg::drawing(node, self.fonts);
        let scale = (width / drawing.width.max(1.0)).min(LARGEST_UNIT) * self.shrinking;
        self.drawn_height += drawing.height * scale;
        vec![Item {
            height: drawing.height * scale,
            marks: vec![PlacedMark::Drawing {
                x: 0.0,
                y: 0.0,
                scale,
                drawing: Arc::new(drawing),
            }],
            ..Item::default()
        }]
    }

    /// Children two by two, each pair as high as the higher one.
    fn pairs(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        let column = 0.5 * (width - PAIR_GAP);
        let children: Vec<Node> = node.children().filter(Node::is_element).collect();
        let mut items = Vec::new();
        for pair in children.chunks(2) {
            let mut row = Item::default();
            for (child, x) in pair.iter().zip([0.0, column + PAIR_GAP]) {
                let cell = joined(self.block(*child, column, style));
                row.height = row.height.max(cell.height);
                row.absorb(cell, x, 0.0);
            }
            items.push(row);
        }
        items
    }
}

/// Height of items that begin a page: without empty space before the first and after the last.
fn height_on_page(items: &[Item]) -> f32 {
    let is_set = |item: &Item| !item.is_room;
    let first = items.iter().position(is_set).unwrap_or(0);
    let end = items.iter().rposition(is_set).map_or(0, |last| last + 1);
    let set = items.get(first..end).unwrap_or(&[]);
    set.iter().map(|item| item.height).sum()
}

/// Puts an item beside the first of some lines, with room below them if it is higher.
fn put_beside(item: Item, lines: &mut Vec<Item>) {
    let missing = item.height - lines.iter().map(|i| i.height).sum::<f32>();
    if lines.is_empty() || missing > 0.0 {
        lines.push(Item {
            height: missing.max(0.0),
            ..Item::default()
        });
    }
    if let Some(first) = lines.first_mut() {
        first.absorb(item, 0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Height of the drawing, and of everything, of an element of one page of 300 pt with a drawing of 270 pt.
    fn heights(paragraphs: usize) -> (f32, f32) {
        let page = format!(
            r#"<html><div class="one-page"><svg viewBox="0 0 300 270"/>{}</div></html>"#,
            "<p>text</p>".repeat(paragraphs)
        );
        let xml = roxmltree::Document::parse(&page).unwrap();
        let fonts = Fonts::load().unwrap();
        let mut blocks = Blocks::new(&fonts, 300.0);
        let items = blocks.children(xml.root_element(), 400.0, Style::of_size(TEXT_SIZE));
        let drawing = items.iter().find(|item| {
            item.marks
                .iter()
                .any(|m| matches!(m, PlacedMark::Drawing { .. }))
        });
        (drawing.unwrap().height, height_on_page(&items))
    }

    #[test]
    fn drawings_shrink_where_the_element_then_fits_on_one_page() {
        let (drawing, all) = heights(1);
        assert!((drawing - 270.0).abs() < 0.1 && all < 300.0, "it fits");
        let (drawing, all) = heights(4);
        assert!(
            drawing < 265.0 && (all - 300.0).abs() < 0.1,
            "{drawing} of {all}"
        );
        let (drawing, all) = heights(20);
        assert!(
            (drawing - 270.0).abs() < 0.1 && all > 500.0,
            "too much in any case"
        );
    }
}
