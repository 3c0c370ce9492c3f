//! Items on pages, with repeated table heads and the table of contents.

use std::collections::BTreeMap;

use super::fonts::{Fonts, Weight};
use super::item::{Item, PlacedMark, SOFT, Style};

/// A4, pt.
pub const WIDTH: f32 = 595.0;
pub const HEIGHT: f32 = 842.0;
pub const MARGIN: f32 = 45.0;
const TOP: f32 = 45.0;
const BOTTOM: f32 = 52.0;
/// Height between the margins of a page, pt.
pub const PAGE_HEIGHT: f32 = HEIGHT - TOP - BOTTOM;

/// Marks of a page, y from its top.
#[derive(Debug, Default)]
pub struct Page {
    pub marks: Vec<PlacedMark>,
}

/// A heading with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Heading {
    pub level: usize,
    pub title: String,
    /// Number of the page, from one.
    pub page: usize,
    pub y: f32,
}

/// The document as pages.
#[derive(Debug, Default)]
pub struct PagedDocument {
    pub pages: Vec<Page>,
    pub headings: Vec<Heading>,
    /// Number of the page and y of each anchor.
    pub anchors: BTreeMap<String, (usize, f32)>,
}

/// Number of headings above which the contents list chapters only.
const MOST_ENTRIES: usize = 400;
/// Height above which an item need not stay with the next one, since it would leave a page almost
/// empty.
const HIGHEST_KEPT: f32 = 0.8 * PAGE_HEIGHT;

/// Divides items into pages.
pub fn paginate(items: Vec<Item>, fonts: &Fonts) -> PagedDocument {
    let mut items = with_contents(items, fonts);
    // Empty lines at the end need no page.
    let end = items.iter().rposition(|item| !item.marks.is_empty());
    items.truncate(end.map_or(0, |last| last + 1));
    let mut document = PagedDocument {
        pages: vec![Page::default()],
        ..PagedDocument::default()
    };
    let mut y = TOP;
    for (i, item) in items.iter().enumerate() {
        let is_full = y + item.height + kept_height(&items, i) > HEIGHT - BOTTOM;
        if y > TOP && (item.breaks || (is_full && !item.is_room)) {
            document.pages.push(Page::default());
            y = TOP;
            if let Some(head) = &item.head {
                document.put(head, y);
                y += head.height;
            }
        }
        if item.is_room && y <= TOP {
            continue;
        }
        document.put(item, y);
        y += item.height;
    }
    document
}

/// Height of the following items that an item must stay with.
fn kept_height(items: &[Item], i: usize) -> f32 {
    let mut height = 0.0;
    let mut last = items.get(i);
    for next in items.get(i + 1..).unwrap_or(&[]) {
        if !last.is_some_and(|l| l.keep || (l.is_room && height > 0.0)) || next.breaks {
            break;
        }
        height += next.height;
        last = Some(next);
    }
    if height < HIGHEST_KEPT { height } else { 0.0 }
}

impl PagedDocument {
    /// Puts the marks of an item on the last page.
    fn put(&mut self, item: &Item, y: f32) {
        let page = self.pages.len();
        for mark in &item.marks {
            match mark {
                PlacedMark::Anchor { id } => {
                    self.anchors.insert(id.clone(), (page, y));
                }
                PlacedMark::Heading { level, title } => {
                    self.headings.push(Heading {
                        level: *level,
                        title: title.clone(),
                        page,
                        y,
                    });
                }
                other => {
                    if let Some(last) = self.pages.last_mut() {
                        last.marks.push(other.clone().shifted_by(MARGIN, y));
                    }
                }
            }
        }
    }
}

/// A heading with the anchor that the table of contents refers to.
struct Entry {
    level: usize,
    title: String,
    anchor: String,
}

/// Replaces the mark of the contents by a line for each heading.
fn with_contents(mut items: Vec<Item>, fonts: &Fonts) -> Vec<Item> {
    let is_place = |item: &Item| item.marks.iter().any(|m| matches!(m, PlacedMark::Contents));
    let Some(place) = items.iter().position(is_place) else {
        return items;
    };
    let entries = anchor_headings(&mut items);
    let has_sections = entries.len() <= MOST_ENTRIES;
    let lines: Vec<Item> = entries
        .iter()
        .filter(|entry| has_sections || entry.level == 0)
        .map(|entry| contents_line(entry, fonts))
        .collect();
    let title = Item {
        height: 16.0,
        marks: vec![PlacedMark::Text {
            x: 0.0,
            y: 10.5,
            style: Style::of_size(10.5).bold(),
            text: "Contents".to_owned(),
        }],
        keep: true,
        ..Item::default()
    };
    let mut contents = vec![Item::room(8.0), title];
    contents.extend(in_columns(&lines));
    items.splice(place..=place, contents);
    items
}

/// Adds an anchor to each heading and lists them.
fn anchor_headings(items: &mut [Item]) -> Vec<Entry> {
    let mut entries = Vec::new();
    for item in items {
        let heading = item.marks.iter().find_map(|m| match m {
            PlacedMark::Heading { level, title } => Some((*level, title.clone())),
            _ => None,
        });
        if let Some((level, title)) = heading {
            let anchor = format!("contents {}", entries.len());
            item.marks.push(PlacedMark::Anchor { id: anchor.clone() });
            entries.push(Entry {
                level,
                title,
                anchor,
            });
        }
    }
    entries
}

/// Gap between the columns of the contents, pt.
const COLUMN_GAP: f32 = 20.0;
const COLUMN: f32 = 0.5 * (WIDTH - 2.0 * MARGIN - COLUMN_GAP);
/// Width reserved for the page number in a line of the contents, pt.
const NUMBER_WIDTH: f32 = 26.0;

/// A line of the contents: heading, cut to the column, and page number.
fn contents_line(entry: &Entry, fonts: &Fonts) -> Item {
    const LINE_HEIGHT: f32 = 11.0;
    const BASE: f32 = 8.5;
    let style = match entry.level {
        0 => Style::of_size(8.5).bold(),
        _ => Style::of_size(7.5),
    };
    let x = 9.0 * entry.level as f32;
    let (mut text, most) = (entry.title.clone(), COLUMN - x - NUMBER_WIDTH);
    while fonts.width(style.weight, style.size, &text) > most && !text.is_empty() {
        text.pop();
    }
    let number_style = Style {
        weight: Weight::Regular,
        colour: SOFT,
        ..style
    };
    Item {
        height: LINE_HEIGHT,
        marks: vec![
            PlacedMark::Text {
                x,
                y: BASE,
                style,
                text,
            },
            PlacedMark::PageOf {
                x: COLUMN,
                y: BASE,
                style: number_style,
                prefix: "",
                target: entry.anchor.clone(),
            },
            PlacedMark::Link {
                x,
                y: 0.0,
                width: COLUMN - x,
                height: LINE_HEIGHT,
                target: entry.anchor.clone(),
            },
        ],
        ..Item::default()
    }
}

/// Arranges lines in two columns per page, the left one first.
fn in_columns(lines: &[Item]) -> Vec<Item> {
    /// Lines of a column below the title of the document, and on a page of contents alone.
    const FIRST: usize = 54;
    const WHOLE: usize = 66;
    let mut rows = Vec::new();
    let mut rest = lines;
    let mut most = FIRST;
    while !rest.is_empty() {
        let (page, later) = rest.split_at(rest.len().min(2 * most));
        let (left, right) = page.split_at(page.len().div_ceil(2));
        for (i, item) in left.iter().enumerate() {
            let mut row = item.clone();
            if let Some(beside) = right.get(i) {
                row.absorb(beside.clone(), COLUMN + COLUMN_GAP, 0.0);
            }
            rows.push(row);
        }
        rest = later;
        most = WHOLE;
    }
    rows
}
