//! A table as items, one per row.
//!
//! Columns are as wide as their text if the page is wide enough. Otherwise they are narrower, and
//! finally set in smaller type.

use std::sync::Arc;

use roxmltree::Node;

use super::elements::{has_class, is_screen_only};
use super::fonts::Fonts;
use super::inline_text::{InlineReader, LineLayout, Word, lines, widths};
use super::item::{INK, Item, PlacedMark, RULE, Style};
use super::operand::Colour;

/// Sizes of type, tried in turn, pt.
const SIZES: [f32; 5] = [7.5, 7.0, 6.5, 6.0, 5.5];
/// Gap between columns, pt.
const CELL_GAP: f32 = 6.0;

/// Classes of shaded cells with their colours, and `true` if the text is white.
const SHADES: [(&str, Colour, bool); 4] = [
    ("weak", [234, 241, 248], false),
    ("fair", [195, 217, 237], false),
    ("strong", [127, 176, 216], false),
    ("flagged", [11, 79, 138], true),
];

struct Cell {
    words: Vec<Word>,
    /// Share of the free width before the text: 1 aligns right.
    align: f32,
    shade: Option<Colour>,
}

struct Row {
    is_head: bool,
    cells: Vec<Cell>,
}

/// Sizes of a table.
struct TableLayout {
    /// Size of type, pt.
    size: f32,
    columns: Vec<f32>,
    is_dense: bool,
}

/// Items of a table's rows.
pub fn rows(table: Node, width: f32, fonts: &Fonts) -> Vec<Item> {
    let (layout, grid) = lay_out(table, width, fonts);
    let mut head: Option<Arc<Item>> = None;
    let mut items = Vec::new();
    for row in &grid {
        let mut item = layout.row(&row.cells, fonts);
        if !layout.is_dense {
            item.marks.push(layout.rule(item.height, row.is_head));
        }
        if row.is_head {
            item.keep = true;
            head = Some(Arc::new(item.clone()));
        } else {
            item.head.clone_from(&head);
        }
        items.push(item);
    }
    items
}

/// The largest type in which the longest words fit, and the table read in it.
fn lay_out(table: Node, width: f32, fonts: &Fonts) -> (TableLayout, Vec<Row>) {
    let is_dense = has_class(table, "dense");
    let sizes = if is_dense { &SIZES[2..] } else { &SIZES[..] };
    let mut layout = TableLayout {
        size: SIZES[0],
        columns: Vec::new(),
        is_dense,
    };
    let mut grid = Vec::new();
    for size in sizes {
        grid = read(table, fonts, *size);
        let (least, most) = column_widths(&grid);
        let room = width - CELL_GAP * most.len().saturating_sub(1) as f32;
        let fits = least.iter().sum::<f32>() <= room;
        layout.size = *size;
        layout.columns = share_width(&least, &most, room);
        if fits {
            break;
        }
    }
    (layout, grid)
}

fn read(table: Node, fonts: &Fonts, size: f32) -> Vec<Row> {
    let numeric = numeric_columns(table);
    let is_numeric = |column: usize| numeric.get(column).copied().unwrap_or(false);
    rows_of(table)
        .map(|row| {
            let is_head = is_head(row);
            let cells = cells_of(row)
                .enumerate()
                .map(|(column, cell)| {
                    let is_right = is_numeric(column) || has_class(cell, "n");
                    read_cell(cell, is_head, is_right, fonts, size)
                })
                .collect();
            Row { is_head, cells }
        })
        .collect()
}

fn rows_of<'a>(table: Node<'a, 'a>) -> impl Iterator<Item = Node<'a, 'a>> {
    table.descendants().filter(|n| n.has_tag_name("tr"))
}

fn is_head(row: Node) -> bool {
    row.parent().is_some_and(|p| p.has_tag_name("thead"))
}

fn cells_of<'a>(row: Node<'a, 'a>) -> impl Iterator<Item = Node<'a, 'a>> {
    row.children()
        .filter(|n| n.has_tag_name("td") || n.has_tag_name("th"))
        .filter(|n| !is_screen_only(*n))
}

/// Columns whose head is aligned right, and therefore their cells.
fn numeric_columns(table: Node) -> Vec<bool> {
    let head = rows_of(table).find(|row| is_head(*row));
    head.map_or_else(Vec::new, |row| {
        cells_of(row).map(|cell| has_class(cell, "n")).collect()
    })
}

fn read_cell(cell: Node, is_head: bool, is_right: bool, fonts: &Fonts, size: f32) -> Cell {
    let shade = SHADES.iter().find(|(class, ..)| has_class(cell, class));
    let mut style = Style::of_size(size);
    if shade.is_some_and(|(_, _, has_white_text)| *has_white_text) {
        style.colour = [255; 3];
    }
    if is_head {
        style = style.bold();
    }
    let mut reader = InlineReader::new(fonts);
    for child in cell.children() {
        reader.read(child, style, None);
    }
    Cell {
        words: reader.words(),
        align: if is_right { 1.0 } else { 0.0 },
        shade: shade.map(|(_, colour, _)| *colour),
    }
}

/// Width of the longest word and of the longest line of each column.
fn column_widths(grid: &[Row]) -> (Vec<f32>, Vec<f32>) {
    let columns = grid.iter().map(|row| row.cells.len()).max().unwrap_or(0);
    let (mut least, mut most) = (vec![0.0_f32; columns], vec![0.0_f32; columns]);
    for row in grid {
        for ((cell, least), most) in row.cells.iter().zip(&mut least).zip(&mut most) {
            let (word, line) = widths(&cell.words);
            *least = least.max(word);
            *most = most.max(line);
        }
    }
    (least, most)
}

/// Divides a width among columns. Each gets the most it can use, or else its least width and a
/// proportional share of the remaining room.
fn share_width(least: &[f32], most: &[f32], room: f32) -> Vec<f32> {
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

impl TableLayout {
    /// Width of the table, pt.
    fn width(&self) -> f32 {
        self.columns.iter().sum::<f32>() + CELL_GAP * self.columns.len().saturating_sub(1) as f32
    }

    /// Rule below a row.
    fn rule(&self, row_height: f32, is_head: bool) -> PlacedMark {
        PlacedMark::Fill {
            x: 0.0,
            y: row_height - 0.4,
            width: self.width(),
            height: if is_head { 0.8 } else { 0.4 },
            colour: if is_head { INK } else { RULE },
        }
    }

    fn row(&self, cells: &[Cell], fonts: &Fonts) -> Item {
        let room = if self.is_dense { 0.3 } else { 1.2 };
        let mut item = Item::default();
        let mut shades = Vec::new();
        let mut x = 0.0;
        for (cell, width) in cells.iter().zip(&self.columns) {
            // A little more than the width, for sums of widths are not exact.
            let layout = LineLayout {
                width: width + 0.05,
                size: self.size,
                align: cell.align,
            };
            let mut y = room;
            for line in lines(&cell.words, layout, fonts) {
                let height = line.height;
                item.absorb(line, x, y);
                y += height;
            }
            item.height = item.height.max(y + room);
            shades.extend(cell.shade.map(|colour| (x, *width, colour)));
            x += width + CELL_GAP;
        }
        item.height = item.height.max(self.size * 1.35 + 2.0 * room);
        let height = item.height;
        let fills = shades
            .into_iter()
            .map(|(x, width, colour)| PlacedMark::Fill {
                x: x - 0.5 * CELL_GAP,
                y: 0.0,
                width: width + CELL_GAP,
                height,
                colour,
            });
        item.marks.splice(0..0, fills);
        item
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_aligned_as_the_head_of_their_column() {
        let page = r#"<table><thead><tr><th>a</th><th class="n">b</th></tr></thead>
            <tbody><tr><td>x</td><td>1</td></tr><tr><td class="n">2</td><td>3</td></tr></tbody></table>"#;
        let xml = roxmltree::Document::parse(page).unwrap();
        let rows = read(xml.root_element(), &Fonts::load().unwrap(), 7.0);
        let aligned = |row: &Row| row.cells.iter().map(|c| c.align > 0.5).collect::<Vec<_>>();
        let expected = [vec![false, true], vec![false, true], vec![true, true]];
        assert_eq!(rows.iter().map(aligned).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn columns_share_the_width_that_is_left() {
        let (least, most) = ([10.0, 20.0], [20.0, 60.0]);
        assert_eq!(share_width(&least, &most, 100.0), most);
        assert_eq!(share_width(&least, &most, 55.0), [15.0, 40.0]);
        assert_eq!(share_width(&least, &most, 15.0), [5.0, 10.0]);
    }
}
