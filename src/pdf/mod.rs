//! Typesetting of a well-formed XHTML page on A4 as a PDF, with page numbers, table of contents,
//! outline and embedded fonts.
//!
//! The setter needs no browser and reads no clock, so the same page gives the same bytes. It
//! supports XML with the following subset of HTML and SVG, and no CSS.
//!
//! | elements | set as |
//! |---|---|
//! | `h1` `h2` `h3` `h4` `summary` | headings; `h2` and `h3` are entries of contents and outline |
//! | `nav` | the table of contents, made from the headings |
//! | `p` `ul` `li` `dl` `dt` `dd` `pre` | paragraphs, lists, definitions, preserved lines |
//! | `table` `thead` `tbody` `tr` `th` `td` | a table; rows of `thead` repeat on each page |
//! | `figure` `figcaption` | an item that is not torn apart |
//! | `svg` | a drawing |
//! | `a` `b` `strong` `i` `em` `small` `sub` `span` `br` `code` | running text; a link within the page is followed by the number of its page |
//! | `head` `script` `style` `button` `input` `label` | nothing |
//! | any other | its children |
//!
//! | class | effect |
//! |---|---|
//! | `new-page` | begins a page |
//! | `one-page` (`div`, `section`) | its drawings shrink, by 30 % at most, where it then fits on one page |
//! | `screen` | is omitted |
//! | `note` (`p`), `small` (`div`) | small type |
//! | `pairs` (`div`) | children two by two |
//! | `dense` (`table`) | small type, no rules |
//! | `n` (`th`, `td`) | aligned right; in a head, with all cells of the column |
//! | `weak` `fair` `strong` `flagged` (`td`) | four shades |
//! | `inline` (`svg`) | a drawing within a line |
//!
//! An `svg` may contain `g` (`clip-path` of one rectangle), `rect`, `line`, `path` (M L H V Z, and
//! A for half circles; both with `transform="translate(…)"` or `scale(…)`) and `text` (`rotate(-90
//! …)`), with the attributes `fill`, `stroke`, `stroke-width`, `stroke-dasharray`, `opacity`,
//! `fill-opacity`, `font-size`, `font-weight` and `text-anchor`.
//!
//! In the order of use: `fonts`, `operand` (numbers and colours), `svg` and `svg_path` (drawings as
//! operators), `drawing_stream` (a drawing compressed), `item` (what pages are filled with), `elements`
//! (questions about an element), `inline_text` and `table`, `block_items` and `blocks` (elements as items),
//! `pagination` (items on pages), `page_content` (a page as operators), `writer` (the objects of the file).

mod block_items;
mod blocks;
mod drawing_stream;
mod elements;
mod fonts;
mod inline_text;
mod item;
mod operand;
mod page_content;
mod pagination;
mod svg;
mod svg_path;
mod table;
mod writer;

use roxmltree::{Document, ParsingOptions};

use blocks::Blocks;
use drawing_stream::DrawingStreams;
use fonts::Fonts;
use item::Style;
use pagination::{MARGIN, PAGE_HEIGHT, WIDTH};

use crate::drawing_cache::DrawingCache;

/// Deepest nesting of elements. They are set recursively: each level takes some of a thread's stack.
const DEEPEST: usize = 100;

/// Sets a page as a PDF; drawings that `cache` knows are not set again.
///
/// # Errors
/// If the page is not well-formed XML, or is nested deeper than [`DEEPEST`].
pub fn pdf(html: &str, cache: &DrawingCache) -> Result<Vec<u8>, String> {
    // A large report has a million nodes; none is deeply nested.
    let options = ParsingOptions {
        allow_dtd: true,
        nodes_limit: u32::MAX,
        ..ParsingOptions::default()
    };
    let xml = Document::parse_with_options(html, options)
        .map_err(|e| format!("the page is no well-formed XML: {e}"))?;
    let depth = depth(&xml);
    if depth > DEEPEST {
        return Err(format!(
            "the page's elements are nested {depth} deep: {DEEPEST} are set at most"
        ));
    }
    let fonts = Fonts::load()?;
    let root = xml.root_element();
    let title = root
        .descendants()
        .find(|n| n.has_tag_name("title"))
        .and_then(|n| n.text())
        .unwrap_or_default()
        .trim();
    let body = root
        .children()
        .find(|n| n.has_tag_name("body"))
        .unwrap_or(root);
    let style = Style::of_size(blocks::TEXT_SIZE);
    let drawings = DrawingStreams {
        fonts: &fonts,
        cache,
        declarations: html.get(..root.range().start).unwrap_or_default(),
    };
    let made = Blocks::new(drawings, PAGE_HEIGHT).children(body, WIDTH - 2.0 * MARGIN, style);
    let document = pagination::paginate(made.items, &fonts);
    Ok(writer::write(&fonts, title, &document))
}

/// Number of levels of a document's elements.
fn depth(xml: &Document) -> usize {
    let mut depths: Vec<usize> = Vec::new();
    for node in xml.descendants() {
        let parent = node.parent().map(|parent| parent.id().get_usize());
        let above = parent.and_then(|id| depths.get(id)).copied().unwrap_or(0);
        depths.push(above + usize::from(node.is_element()));
    }
    depths.into_iter().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nested(levels: usize) -> Result<Vec<u8>, String> {
        let (open, close) = ("<div><p>text</p>".repeat(levels), "</div>".repeat(levels));
        let page = format!("<html><body>{open}{close}</body></html>");
        pdf(&page, &DrawingCache::default())
    }

    #[test]
    fn a_page_nested_too_deep_is_refused() {
        // Page, body and the innermost paragraph are three levels more.
        assert!(nested(DEEPEST - 3).is_ok());
        let refused = nested(100_000).unwrap_err();
        assert!(
            refused.contains("nested 100003 deep: 100 are set at most"),
            "{refused}"
        );
    }
}
