//! The page's elements as items: headings, paragraphs, lists, figures, and what stands side by
//! side.

use std::sync::Arc;

use roxmltree::Node;

use super::elements::{has_class, is_block, is_for_screens, plain_text};
use super::fonts::Fonts;
use super::inline_text::{Reader, Setting, lines};
use super::item::{Item, Mark, SOFT, Style};
use super::svg;
use super::table;

/// Size of running text, pt.
pub const TEXT: f32 = 9.0;
const SMALL: f32 = 8.0;
const CODE: f32 = 7.0;
/// Between what stands side by side, pt.
const GAP: f32 = 16.0;
/// Page units of a drawing that stands alone are so many points at most.
const LARGEST: f32 = 1.0;

/// Makes items of elements.
#[derive(Debug)]
pub struct Blocks<'a> {
    pub fonts: &'a Fonts,
    /// Anchors of elements that have opened but not put anything on the page yet.
    waiting: Vec<String>,
}

impl<'a> Blocks<'a> {
    pub fn new(fonts: &'a Fonts) -> Self {
        Blocks {
            fonts,
            waiting: Vec::new(),
        }
    }

    /// The items of an element's children, in a column of this width.
    pub fn children(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        let mut items = Vec::new();
        let mut reader = Reader::new(self.fonts);
        for child in node.children() {
            if child.is_element() && is_block(child) {
                let words = std::mem::replace(&mut reader, Reader::new(self.fonts)).words();
                self.put(
                    lines(
                        &words,
                        Setting {
                            width,
                            size: style.size,
                            align: 0.0,
                        },
                        self.fonts,
                    ),
                    &mut items,
                );
                let block = self.block(child, width, style);
                items.extend(block);
            } else {
                reader.read(child, style, None);
            }
        }
        self.put(
            lines(
                &reader.words(),
                Setting {
                    width,
                    size: style.size,
                    align: 0.0,
                },
                self.fonts,
            ),
            &mut items,
        );
        items
    }

    /// Adds items, the first of them with the anchors that wait for one.
    fn put(&mut self, mut new: Vec<Item>, items: &mut Vec<Item>) {
        if let Some(first) = new.iter_mut().find(|i| !i.is_room) {
            first
                .marks
                .extend(self.waiting.drain(..).map(|id| Mark::Anchor { id }));
        }
        items.append(&mut new);
    }

    fn block(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        if is_for_screens(node) {
            return Vec::new();
        }
        self.waiting.extend(node.attribute("id").map(str::to_owned));
        let mut items = Vec::new();
        if has_class(node, "sheet") {
            items.push(Item::page_break());
        }
        let (made, after) = self.element(node, width, style);
        if node.tag_name().name() == "nav" {
            items.extend(made);
        } else {
            self.put(made, &mut items);
            items.push(Item::room(after));
        }
        items
    }

    /// What an element makes, and the room after it.
    fn element(&mut self, node: Node, width: f32, style: Style) -> (Vec<Item>, f32) {
        match node.tag_name().name() {
            "h1" => (self.heading(node, width, 18.0, None), 4.0),
            "h2" => (self.heading(node, width, 13.0, Some(0)), 3.0),
            "h3" => (self.heading(node, width, 10.5, Some(1)), 2.0),
            "h4" | "summary" => (self.heading(node, width, TEXT, None), 1.0),
            "nav" => (
                vec![Item {
                    marks: vec![Mark::Heading {
                        level: 9,
                        title: String::new(),
                    }],
                    ..Item::default()
                }],
                0.0,
            ),
            "p" if has_class(node, "note") => (
                self.children(
                    node,
                    width,
                    Style {
                        colour: SOFT,
                        ..Style::of_size(SMALL)
                    },
                ),
                4.0,
            ),
            "p" => (self.children(node, width, style), 5.0),
            "ul" => (self.list(node, width, style), 4.0),
            "dl" => (self.definitions(node, width, style), 5.0),
            "pre" => (self.code(node, width), 5.0),
            "table" => (
                table::rows(
                    node,
                    width,
                    self.fonts,
                    has_class(node, "triangle") || has_class(node, "dense"),
                ),
                6.0,
            ),
            "svg" => (self.drawing(node, width), 1.0),
            "figcaption" => (self.children(node, width, Style::of_size(SMALL)), 1.0),
            "figure" => (vec![together(&self.children(node, width, style))], 8.0),
            "div" if has_class(node, "legend") || has_class(node, "keys") => {
                (self.children(node, width, Style::of_size(SMALL)), 2.0)
            }
            "div"
                if ["figures", "panels", "triangles"]
                    .iter()
                    .any(|c| has_class(node, c)) =>
            {
                (self.side_by_side(node, width, style), 2.0)
            }
            _ => (self.children(node, width, style), 0.0),
        }
    }

    fn heading(&mut self, node: Node, width: f32, size: f32, level: Option<usize>) -> Vec<Item> {
        let style = Style::of_size(size).bold();
        let mut items = vec![Item::room(0.7 * size)];
        let mut heading = self.children(node, width, style);
        let title = plain_text(node);
        if let (Some(first), Some(level)) = (heading.first_mut(), level) {
            first.marks.push(Mark::Heading { level, title });
            if level == 0 {
                first.marks.push(Mark::Fill {
                    x: 0.0,
                    y: -3.0,
                    width,
                    height: 0.9,
                    colour: super::item::INK,
                });
            }
        }
        for line in &mut heading {
            line.keep = true;
        }
        items.append(&mut heading);
        items
    }

    fn list(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        const INDENT: f32 = 11.0;
        let mut items = Vec::new();
        for entry in node.children().filter(|n| n.has_tag_name("li")) {
            let mut own = indented(self.children(entry, width - INDENT, style), INDENT);
            if let Some(first) = own.first_mut() {
                let y = style.size * 1.02;
                first.marks.push(Mark::Text {
                    x: 2.0,
                    y,
                    style,
                    text: "\u{2022}".to_owned(),
                });
            }
            own.push(Item::room(1.5));
            items.extend(own);
        }
        items
    }

    /// Terms in bold with their definitions indented under them.
    fn definitions(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        const INDENT: f32 = 90.0;
        let mut items: Vec<Item> = Vec::new();
        let mut term: Option<Item> = None;
        for entry in node
            .descendants()
            .filter(|n| n.has_tag_name("dt") || n.has_tag_name("dd"))
        {
            if entry.has_tag_name("dt") {
                let words = self.children(
                    entry,
                    INDENT - 6.0,
                    Style {
                        colour: SOFT,
                        ..style
                    },
                );
                term = Some(together(&words));
                continue;
            }
            let mut own = indented(self.children(entry, width - INDENT, style), INDENT);
            if let Some(term) = term.take() {
                let missing = term.height - own.iter().map(|i| i.height).sum::<f32>();
                if own.is_empty() || missing > 0.0 {
                    own.push(Item {
                        height: missing.max(0.0),
                        ..Item::default()
                    });
                }
                if let Some(first) = own.first_mut() {
                    first.absorb(&term, 0.0, 0.0);
                }
            }
            own.push(Item::room(1.5));
            items.extend(own);
        }
        items
    }

    fn code(&mut self, node: Node, width: f32) -> Vec<Item> {
        let mut reader = Reader::new(self.fonts).preserved();
        let style = Style::of_size(CODE);
        for child in node.children() {
            reader.read(child, style, None);
        }
        lines(
            &reader.words(),
            Setting {
                width,
                size: CODE,
                align: 0.0,
            },
            self.fonts,
        )
    }

    fn drawing(&mut self, node: Node, width: f32) -> Vec<Item> {
        let drawing = svg::drawing(node, self.fonts);
        let scale = (width / drawing.width.max(1.0)).min(LARGEST);
        let height = drawing.height * scale;
        let mark = Mark::Drawing {
            x: 0.0,
            y: 0.0,
            scale,
            drawing: Arc::new(drawing),
        };
        vec![Item {
            height,
            marks: vec![mark],
            ..Item::default()
        }]
    }

    /// Two by two, each pair as high as the higher of the two.
    fn side_by_side(&mut self, node: Node, width: f32, style: Style) -> Vec<Item> {
        let column = 0.5 * (width - GAP);
        let children: Vec<Node> = node.children().filter(Node::is_element).collect();
        let mut items = Vec::new();
        for pair in children.chunks(2) {
            let cells: Vec<Item> = pair
                .iter()
                .map(|child| together(&self.block(*child, column, style)))
                .collect();
            let mut row = Item {
                height: cells.iter().map(|c| c.height).fold(0.0, f32::max),
                ..Item::default()
            };
            for (cell, x) in cells.iter().zip([0.0, column + GAP]) {
                row.absorb(cell, x, 0.0);
            }
            items.push(row);
        }
        items
    }
}

/// Items as one that is not torn apart.
pub fn together(items: &[Item]) -> Item {
    let mut all = Item::default();
    for item in items {
        let y = all.height;
        all.absorb(item, 0.0, y);
        all.height += item.height;
    }
    all
}

fn indented(mut items: Vec<Item>, by: f32) -> Vec<Item> {
    for item in &mut items {
        item.marks = item.marks.iter().map(|m| m.moved(by, 0.0)).collect();
    }
    items
}
