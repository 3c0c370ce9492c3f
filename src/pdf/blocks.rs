//! Block elements as items: headings, paragraphs, lists, figures, children side by side. Neighbours are
//! made in parallel.

use rayon::prelude::*;
use roxmltree::Node;

use super::block_items::BlockItems;
use super::drawing_stream::DrawingStreams;
use super::elements::{has_class, is_block, is_screen_only, plain_text};
use super::inline_text::{InlineReader, LineLayout, lines};
use super::item::{INK, Item, PlacedMark, SOFT, Style};
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
#[derive(Clone, Copy, Debug)]
pub struct Blocks<'a> {
    drawings: DrawingStreams<'a>,
    /// Height of a page, pt.
    page_height: f32,
    /// Scale of drawings over that of their column.
    shrinking: f32,
}

/// Part of an element's content that is made alone.
enum Piece<'d, 'x> {
    /// Neighbouring nodes of running text.
    Text(Vec<Node<'d, 'x>>),
    Block(Node<'d, 'x>),
}

/// Content of an element in pieces.
fn pieces<'d, 'x>(node: Node<'d, 'x>) -> Vec<Piece<'d, 'x>> {
    let mut pieces = Vec::new();
    for child in node.children() {
        if child.is_element() && is_block(child) {
            pieces.push(Piece::Block(child));
        } else if let Some(Piece::Text(text)) = pieces.last_mut() {
            text.push(child);
        } else {
            pieces.push(Piece::Text(vec![child]));
        }
    }
    pieces
}

impl<'a> Blocks<'a> {
    pub fn new(drawings: DrawingStreams<'a>, page_height: f32) -> Self {
        Blocks {
            drawings,
            page_height,
            shrinking: 1.0,
        }
    }

    /// Items of an element's children, in a column of a width (pt).
    pub fn children(&self, node: Node, width: f32, style: Style) -> BlockItems {
        BlockItems::in_order(self.made(&pieces(node), width, style))
    }

    /// Items of an element's children, with smaller drawings where all then fit on one page.
    fn children_on_one_page(&self, node: Node, width: f32, style: Style) -> BlockItems {
        let pieces = pieces(node);
        let mut made = self.made(&pieces, width, style);
        let drawn: f32 = made.iter().map(|part| part.drawn_height).sum();
        let items: Vec<&Item> = made.iter().flat_map(|part| &part.items).collect();
        let excess = height_on_page(&items) - self.page_height;
        let shrinking = self.shrinking * (drawn - excess) / drawn.max(1.0);
        if excess > 0.0 && shrinking >= LEAST_SHRINKING {
            let smaller = Blocks { shrinking, ..*self };
            let parts = pieces.iter().zip(&mut made);
            for (piece, part) in parts.filter(|(_, part)| part.drawn_height > 0.0) {
                *part = smaller.piece(piece, width, style);
            }
        }
        BlockItems::in_order(made)
    }

    /// Items of each piece.
    fn made(&self, pieces: &[Piece], width: f32, style: Style) -> Vec<BlockItems> {
        let pieces = pieces.par_iter();
        pieces
            .map(|piece| self.piece(piece, width, style))
            .collect()
    }

    fn piece(&self, piece: &Piece, width: f32, style: Style) -> BlockItems {
        match piece {
            Piece::Text(nodes) => {
                let reader = InlineReader::new(self.drawings.fonts);
                BlockItems::of(self.text(reader, nodes.iter().copied(), width, style))
            }
            Piece::Block(block) => self.block(*block, width, style),
        }
    }

    /// Lines of running text.
    fn text<'d, 'x: 'd>(
        &self,
        mut reader: InlineReader,
        nodes: impl IntoIterator<Item = Node<'d, 'x>>,
        width: f32,
        style: Style,
    ) -> Vec<Item> {
        for node in nodes {
            reader.read(node, style, None);
        }
        let layout = LineLayout::left(width, style.size);
        lines(&reader.words(), layout, self.drawings.fonts)
    }

    /// Items of a block element with the space after it.
    fn block(&self, node: Node, width: f32, style: Style) -> BlockItems {
        if is_screen_only(node) {
            return BlockItems::default();
        }
        let mut made = BlockItems::with_anchor(node.attribute("id"));
        if has_class(node, "new-page") {
            made.items.push(Item::page_break());
        }
        if node.tag_name().name() == "nav" {
            made.items.push(Item {
                marks: vec![PlacedMark::Contents],
                ..Item::default()
            });
        } else {
            let (element, space_after) = self.element(node, width, style);
            made.add(element);
            made.items.push(Item::room(space_after));
        }
        made
    }

    /// Items of an element, and the space after it (pt).
    fn element(&self, node: Node, width: f32, style: Style) -> (BlockItems, f32) {
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
            "pre" => (BlockItems::of(self.preserved(node, width)), 5.0),
            "table" => (
                BlockItems::of(table::rows(node, width, self.drawings.fonts)),
                6.0,
            ),
            "svg" => (self.drawing(node, width), 1.0),
            "figcaption" => (self.children(node, width, small), 1.0),
            "figure" => {
                let mut made = self.children(node, width, style);
                made.items = vec![made.take_joined()];
                (made, 8.0)
            }
            "div" if has_class(node, "small") => (self.children(node, width, small), 2.0),
            "div" if has_class(node, "pairs") => (self.pairs(node, width, style), 2.0),
            _ if has_class(node, "one-page") => {
                (self.children_on_one_page(node, width, style), 0.0)
            }
            _ => (self.children(node, width, style), 0.0),
        }
    }

    /// A bold heading that stays with what follows. Level 0 is a chapter, under a rule.
    fn heading(&self, node: Node, width: f32, size: f32, level: Option<usize>) -> BlockItems {
        let mut made = self.children(node, width, Style::of_size(size).bold());
        let lines = &mut made.items;
        for line in &mut *lines {
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
        made
    }

    fn list(&self, node: Node, width: f32, style: Style) -> BlockItems {
        let mut all = BlockItems::default();
        for entry in node.children().filter(|n| n.has_tag_name("li")) {
            let made = self.children(entry, width - LIST_INDENT, style);
            let mut made = made.indented(LIST_INDENT);
            if let Some(first) = made.items.first_mut() {
                first.marks.push(PlacedMark::Text {
                    x: 2.0,
                    y: style.size * 1.02,
                    style,
                    text: "\u{2022}".to_owned(),
                });
            }
            made.items.push(Item::room(ENTRY_GAP));
            all.add(made);
        }
        all
    }

    /// Terms with their definitions beside them.
    fn definitions(&self, node: Node, width: f32, style: Style) -> BlockItems {
        let term_style = Style {
            colour: SOFT,
            ..style
        };
        let mut all = BlockItems::default();
        let mut term = None;
        for entry in node.descendants() {
            if entry.has_tag_name("dt") {
                let mut made = self.children(entry, DEFINITION_INDENT - 6.0, term_style);
                term = Some(made.take_joined());
                all.add(made);
            } else if entry.has_tag_name("dd") {
                let made = self.children(entry, width - DEFINITION_INDENT, style);
                let mut made = made.indented(DEFINITION_INDENT);
                if let Some(term) = term.take() {
                    put_beside(term, &mut made.items);
                }
                made.items.push(Item::room(ENTRY_GAP));
                all.add(made);
            }
        }
        all
    }

    fn preserved(&self, node: Node, width: f32) -> Vec<Item> {
        let reader = InlineReader::preserving(self.drawings.fonts);
        self.text(reader, node.children(), width, Style::of_size(CODE_SIZE))
    }

    fn drawing(&self, node: Node, width: f32) -> BlockItems {
        let [own_width, own_height] = svg::size(node);
        let scale = (width / own_width.max(1.0)).min(LARGEST_UNIT) * self.shrinking;
        let item = Item {
            height: own_height * scale,
            marks: vec![PlacedMark::DrawingStream {
                x: 0.0,
                y: 0.0,
                scale,
                drawing: self.drawings.of(node),
            }],
            ..Item::default()
        };
        BlockItems::of_drawing(item)
    }

    /// Children two by two, each pair as high as the higher one.
    fn pairs(&self, node: Node, width: f32, style: Style) -> BlockItems {
        let column = 0.5 * (width - PAIR_GAP);
        let children: Vec<Node> = node.children().filter(Node::is_element).collect();
        let mut all = BlockItems::default();
        for pair in children.chunks(2) {
            let mut row = Item::default();
            for (child, x) in pair.iter().zip([0.0, column + PAIR_GAP]) {
                let mut made = self.block(*child, column, style);
                let cell = made.take_joined();
                row.height = row.height.max(cell.height);
                row.absorb(cell, x, 0.0);
                all.add(made);
            }
            all.add(BlockItems::of(vec![row]));
        }
        all
    }
}

/// Height of items that begin a page: without empty space before the first and after the last.
fn height_on_page(items: &[&Item]) -> f32 {
    let is_set = |item: &&Item| !item.is_room;
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
    use super::super::fonts::Fonts;
    use super::super::pagination::{PAGE_HEIGHT, paginate};
    use super::*;
    use crate::drawing_cache::DrawingCache;

    /// Items of a page in a column of 400 pt on pages of a height, pt.
    fn items(page: &str, page_height: f32) -> Vec<Item> {
        let xml = roxmltree::Document::parse(page).unwrap();
        let fonts = Fonts::load().unwrap();
        let drawings = DrawingStreams {
            fonts: &fonts,
            cache: &DrawingCache::default(),
            declarations: "",
        };
        let blocks = Blocks::new(drawings, page_height);
        let made = blocks.children(xml.root_element(), 400.0, Style::of_size(TEXT_SIZE));
        made.items
    }

    /// Height of the drawing, and of everything, of an element of one page of 300 pt with a drawing of 270 pt.
    fn heights(paragraphs: usize) -> (f32, f32) {
        let page = format!(
            r#"<html><div class="one-page"><svg viewBox="0 0 300 270"/>{}</div></html>"#,
            "<p>text</p>".repeat(paragraphs)
        );
        let items = items(&page, 300.0);
        let drawing = items.iter().find(|item| {
            item.marks
                .iter()
                .any(|m| matches!(m, PlacedMark::DrawingStream { .. }))
        });
        let all: Vec<&Item> = items.iter().collect();
        (drawing.unwrap().height, height_on_page(&all))
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

    #[test]
    fn each_of_many_elements_of_one_page_has_its_page() {
        let element = |k: u16| {
            let drawing = 560.0 + 0.3 * f32::from(k);
            format!(
                r#"<div class="new-page one-page"><svg viewBox="0 0 300 {drawing}"/>{}</div>"#,
                "<p>text</p>".repeat(12)
            )
        };
        let elements: String = (0..500).map(element).collect();
        let items = items(&format!("<html>{elements}</html>"), PAGE_HEIGHT);
        let set_high = |item: &&Item| item.height > 500.0 && item.height < 559.0;
        assert!(items.iter().filter(set_high).count() > 0, "some shrink");
        let document = paginate(items, &Fonts::load().unwrap());
        assert_eq!(document.pages.len(), 500);
    }

    #[test]
    fn an_element_without_an_item_has_its_anchor_at_the_next_item() {
        let page =
            r#"<html><div id="a"></div><div><p id="b">text</p></div><div id="c">text</div></html>"#;
        let anchors: Vec<Vec<String>> = items(page, 300.0)
            .into_iter()
            .map(|item| item.marks)
            .filter(|marks| !marks.is_empty())
            .map(|marks| {
                let ids = marks.into_iter().filter_map(|mark| match mark {
                    PlacedMark::Anchor { id } => Some(id),
                    _ => None,
                });
                ids.collect()
            })
            .collect();
        assert_eq!(anchors, [vec!["b", "a"], vec!["c"]]);
    }
}
