//! Items on pages: where each begins, what heads it, the table of contents with the pages it tells.

use std::collections::BTreeMap;

use super::fonts::{Fonts, Weight};
use super::item::{Item, Mark, SOFT, Style};

/// A4, pt.
pub const WIDTH: f32 = 595.0;
pub const HEIGHT: f32 = 842.0;
pub const MARGIN: f32 = 45.0;
const TOP: f32 = 45.0;
const BOTTOM: f32 = 52.0;

/// A mark on a page: y from its top.
#[derive(Debug, Default)]
pub struct Page {
    pub marks: Vec<Mark>,
}

/// A heading where it came to stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Heading {
    pub level: usize,
    pub title: String,
    pub page: usize,
    pub y: f32,
}

/// The document on its pages.
#[derive(Debug, Default)]
pub struct Pages {
    pub sheets: Vec<Page>,
    pub headings: Vec<Heading>,
    /// Page and place of each anchor.
    pub anchors: BTreeMap<String, (usize, f32)>,
}

/// Level of the mark that the table of contents takes the place of.
const CONTENTS: usize = 9;
/// The contents list so many entries at most: then the headings of the first level alone.
const MOST_ENTRIES: usize = 400;

/// Puts the items on pages.
pub fn paginate(items: Vec<Item>, fonts: &Fonts) -> Pages {
    let items = with_contents(items, fonts);
    let mut pages = Pages {
        sheets: vec![Page::default()],
        ..Pages::default()
    };
    let mut y = TOP;
    for (i, item) in items.iter().enumerate() {
        let is_full = y + item.height + kept(&items, i) > HEIGHT - BOTTOM;
        if y > TOP && (item.breaks || (is_full && !item.is_room)) {
            pages.sheets.push(Page::default());
            y = TOP;
            if let Some(head) = &item.head {
                pages.put(head, y);
                y += head.height;
            }
        }
        if item.is_room && y <= TOP {
            continue;
        }
        pages.put(item, y);
        y += item.height;
    }
    pages
}

/// The height of what an item must stay with: what follows up to the first that is kept no more.
fn kept(items: &[Item], i: usize) -> f32 {
    let mut height = 0.0;
    let mut last = items.get(i);
    for next in items.get(i + 1..).unwrap_or(&[]) {
        if !last.is_some_and(|l| l.keep || (l.is_room && height > 0.0)) || next.breaks {
            break;
        }
        height += next.height;
        last = Some(next);
    }
    // What is higher than a page cannot be kept.
    if height < 0.8 * (HEIGHT - TOP - BOTTOM) {
        height
    } else {
        0.0
    }
}

impl Pages {
    fn put(&mut self, item: &Item, y: f32) {
        let page = self.sheets.len();
        for mark in &item.marks {
            match mark {
                Mark::Anchor { id } => {
                    self.anchors.insert(id.clone(), (page, y));
                }
                Mark::Heading { level, title } => {
                    self.headings.push(Heading {
                        level: *level,
                        title: title.clone(),
                        page,
                        y,
                    });
                }
                other => {
                    if let Some(last) = self.sheets.last_mut() {
                        last.marks.push(other.moved(MARGIN, y));
                    }
                }
            }
        }
    }
}

/// The items with a line for each heading where the contents belong, and an anchor at each heading
/// for it.
fn with_contents(mut items: Vec<Item>, fonts: &Fonts) -> Vec<Item> {
    let is_place = |item: &Item| {
        item.marks.iter().any(|m| {
            matches!(
                m,
                Mark::Heading {
                    level: CONTENTS,
                    ..
                }
            )
        })
    };
    let Some(at) = items.iter().position(is_place) else {
        return items;
    };
    let mut entries = Vec::new();
    for item in &mut items {
        let found = item.marks.iter().find_map(|m| match m {
            Mark::Heading { level, title } if *level < CONTENTS => Some((*level, title.clone())),
            _ => None,
        });
        if let Some((level, title)) = found {
            let id = format!("contents {}", entries.len());
            item.marks.push(Mark::Anchor { id: id.clone() });
            entries.push((level, title, id));
        }
    }
    let few = entries.len() <= MOST_ENTRIES;
    let lines: Vec<Item> = entries
        .iter()
        .filter(|e| few || e.0 == 0)
        .map(|(level, title, id)| line(*level, title, id, fonts))
        .collect();
    let mut contents = vec![Item::room(8.0)];
    let style = Style::of_size(10.5).bold();
    let title = Mark::Text {
        x: 0.0,
        y: 10.5,
        style,
        text: "Contents".to_owned(),
    };
    contents.push(Item {
        height: 16.0,
        marks: vec![title],
        keep: true,
        ..Item::default()
    });
    contents.extend(in_columns(&lines));
    items.splice(at..=at, contents);
    items
}

const COLUMN: f32 = 0.5 * (WIDTH - 2.0 * MARGIN - 20.0);

fn line(level: usize, title: &str, id: &str, fonts: &Fonts) -> Item {
    let style = Style::of_size(if level == 0 { 8.5 } else { 7.5 });
    let style = if level == 0 { style.bold() } else { style };
    let x = 9.0 * level as f32;
    let (mut text, most) = (title.to_owned(), COLUMN - x - 26.0);
    while fonts.width(style.weight, style.size, &text) > most && !text.is_empty() {
        text.pop();
    }
    let target = id.to_owned();
    let height = 11.0;
    let page = Style {
        weight: Weight::Regular,
        colour: SOFT,
        ..style
    };
    Item {
        height,
        marks: vec![
            Mark::Text {
                x,
                y: 8.5,
                style,
                text,
            },
            Mark::PageOf {
                x: COLUMN,
                y: 8.5,
                style: page,
                prefix: "",
                target: target.clone(),
            },
            Mark::Link {
                x,
                y: 0.0,
                width: COLUMN - x,
                height,
                target,
            },
        ],
        ..Item::default()
    }
}

/// Lines in two columns, the left one first, so many to a page as it has room for.
fn in_columns(lines: &[Item]) -> Vec<Item> {
    /// What the first page has room for beside the title, and what one has that is all contents.
    const FIRST: usize = 54;
    const WHOLE: usize = 66;
    let mut rows = Vec::new();
    let mut rest = lines;
    let mut most = FIRST;
    while !rest.is_empty() {
        let (own, later) = rest.split_at(rest.len().min(2 * most));
        let (left, right) = own.split_at(own.len().div_ceil(2));
        for (i, item) in left.iter().enumerate() {
            let mut row = item.clone();
            if let Some(beside) = right.get(i) {
                row.absorb(beside, COLUMN + 20.0, 0.0);
            }
            rows.push(row);
        }
        rest = later;
        most = WHOLE;
    }
    rows
}
