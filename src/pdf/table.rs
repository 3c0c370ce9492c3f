//! A table as items, a row each: columns as wide as their words want where the page has the room,
//! else narrower, at last in smaller type.

use std::sync::Arc;

use roxmltree::Node;

use super::elements::{has_class, is_for_screens};
use super::fonts::Fonts;
use super::inline_text::{Reader, Setting, Word, lines, widths};
use super::item::{Colour, INK, Item, Mark, RULE, Style};

/// Sizes of type to try, pt.
const SIZES: [f32; 5] = [7.5, 7.0, 6.5, 6.0, 5.5];
/// Between columns, pt.
const GAP: f32 = 6.0;

/// What a cell is shaded with, by its class, and whether its text is light on it.
const SHADES: [(&str, Colour, bool); 4] = [
    ("weak", [234, 241, 248], false),
    ("fair", [195, 217, 237], false),
    ("strong", [127, 176, 216], false),
    ("flagged", [11, 79, 138], true),
];

struct Cell {
    words: Vec<Word>,
    align: f32,
    shade: Option<Colour>,
}

/// The rows of a table; a dense one has no lines between them, and small type.
pub fn rows(table: Node, width: f32, fonts: &Fonts, is_dense: bool) -> Vec<Item> {
    let sizes = if is_dense { &SIZES[2..] } else { &SIZES[..] };
    let (mut size, mut grid, mut columns) = (SIZES[0], Vec::new(), Vec::new());
    for try_size in sizes {
        size = *try_size;
        grid = cells(table, fonts, size);
        let (least, most) = wanted(&grid);
        let room = width - GAP * most.len().saturating_sub(1) as f32;
        let is_narrow = least.iter().sum::<f32>() > room;
        columns = shared(&least, &most, room);
        if !is_narrow {
            break;
        }
    }
    let full: f32 = columns.iter().sum::<f32>() + GAP * columns.len().saturating_sub(1) as f32;
    let mut head: Option<Arc<Item>> = None;
    let mut items = Vec::new();
    for (is_head, row) in &grid {
        let mut item = row_item(row, &columns, size, if is_dense { 0.3 } else { 1.2 }, fonts);
        let colour = if *is_head { INK } else { RULE };
        if !is_dense {
            let thickness = if *is_head { 0.8 } else { 0.4 };
            item.marks.push(Mark::Fill {
                x: 0.0,
                y: item.height - 0.4,
                width: full,
                height: thickness,
                colour,
            });
        }
        if *is_head {
            item.keep = true;
            head = Some(Arc::new(item.clone()));
        } else {
            item.head.clone_from(&head);
        }
        items.push(item);
    }
    items
}

fn cells(table: Node, fonts: &Fonts, size: f32) -> Vec<(bool, Vec<Cell>)> {
    let rows = table.descendants().filter(|n| n.has_tag_name("tr"));
    rows.map(|row| {
        let is_head = row.parent().is_some_and(|p| p.has_tag_name("thead"));
        let own = row
            .children()
            .filter(|n| (n.has_tag_name("td") || n.has_tag_name("th")) && !is_for_screens(*n));
        (
            is_head,
            own.map(|cell| read(cell, is_head, fonts, size)).collect(),
        )
    })
    .collect()
}

fn read(cell: Node, is_head: bool, fonts: &Fonts, size: f32) -> Cell {
    let shade = SHADES.iter().find(|s| has_class(cell, s.0));
    let mut style = Style::of_size(size);
    if shade.is_some_and(|s| s.2) {
        style.colour = [255; 3];
    }
    if is_head {
        style = style.bold();
    }
    let mut reader = Reader::new(fonts);
    for child in cell.children() {
        reader.read(child, style, None);
    }
    Cell {
        words: reader.words(),
        align: if has_class(cell, "n") { 1.0 } else { 0.0 },
        shade: shade.map(|s| s.1),
    }
}

/// The least and the most that each column can use.
fn wanted(grid: &[(bool, Vec<Cell>)]) -> (Vec<f32>, Vec<f32>) {
    let columns = grid.iter().map(|row| row.1.len()).max().unwrap_or(0);
    let (mut least, mut most) = (vec![0.0_f32; columns], vec![0.0_f32; columns]);
    for (_, row) in grid {
        for ((cell, least), most) in row.iter().zip(&mut least).zip(&mut most) {
            let (word, line) = widths(&cell.words);
            *least = least.max(word);
            *most = most.max(line);
        }
    }
    (least, most)
}

/// The width of each column: what it wants, or what is left beyond the least in proportion to what
/// it wants beyond it.
fn shared(least: &[f32], most: &[f32], room: f32) -> Vec<f32> {
    let (least_sum, most_sum) = (least.iter().sum::<f32>(), most.iter().sum::<f32>());
    if most_sum <= room {
        return most.to_vec();
    }
    if least_sum >= room {
        return least.iter().map(|w| w * room / least_sum).collect();
    }
    let share = (room - least_sum) / (most_sum - least_sum);
    least
        .iter()
        .zip(most)
        .map(|(least, most)| least + share * (most - least))
        .collect()
}

/// One row, with so much room above and below its text.
fn row_item(row: &[Cell], columns: &[f32], size: f32, room: f32, fonts: &Fonts) -> Item {
    let mut item = Item::default();
    let mut x = 0.0;
    let mut shades = Vec::new();
    for (cell, width) in row.iter().zip(columns) {
        // A little more than the width, for sums of widths are not exact.
        let set = lines(
            &cell.words,
            Setting {
                width: width + 0.05,
                size,
                align: cell.align,
            },
            fonts,
        );
        let mut y = room;
        for line in &set {
            item.absorb(line, x, y);
            y += line.height;
        }
        item.height = item.height.max(y + room);
        shades.extend(cell.shade.map(|colour| (x, *width, colour)));
        x += width + GAP;
    }
    item.height = item.height.max(size * 1.35 + 2.0 * room);
    let height = item.height;
    let fills = shades.into_iter().map(|(x, width, colour)| {
        let (x, width) = (x - 0.5 * GAP, width + GAP);
        Mark::Fill {
            x,
            y: 0.0,
            width,
            height,
            colour,
        }
    });
    item.marks.splice(0..0, fills);
    item
}
