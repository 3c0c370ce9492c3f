//! The report on paper: the page's own HTML, which is well-formed XML too, set on A4 with page
//! numbers, a table of contents and an outline, as a PDF with its fonts in it. No browser, no
//! clock: the same page is the same bytes.

mod blocks;
mod elements;
mod fonts;
mod inline_text;
mod item;
mod pagination;
mod svg;
mod table;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{ActionType, AnnotationType, PageMode};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use rayon::prelude::*;
use roxmltree::{Document, ParsingOptions};

use blocks::Blocks;
use fonts::{Fonts, Weight};
use item::{Mark, SOFT, Style};
use pagination::{HEIGHT, Heading, MARGIN, Pages, WIDTH};
use svg::number;

/// The page as a PDF.
///
/// # Errors
/// Where the page is no well-formed XML: a template of the analyst's own need not be.
pub fn pdf(html: &str) -> Result<Vec<u8>, String> {
    // No element of a page is nested without end; a large report has a million nodes.
    let options = ParsingOptions {
        allow_dtd: true,
        nodes_limit: u32::MAX,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(html, options).map_err(|e| e.to_string())?;
    let fonts = Fonts::load()?;
    let root = document.root_element();
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
    let items =
        Blocks::new(&fonts).children(body, WIDTH - 2.0 * MARGIN, Style::of_size(blocks::TEXT));
    let pages = pagination::paginate(items, &fonts);
    Ok(Writer {
        fonts: &fonts,
        title,
        pages: &pages,
    }
    .write())
}

/// Numbers of the objects.
const CATALOG: i32 = 1;
const TREE: i32 = 2;
const INFO: i32 = 3;
const OUTLINE: i32 = 4;
const FIRST_FONT: i32 = 5;
const FONT_OBJECTS: i32 = 5;
const FIRST_PAGE: i32 = FIRST_FONT + 2 * FONT_OBJECTS;

struct Writer<'a> {
    fonts: &'a Fonts,
    title: &'a str,
    pages: &'a Pages,
}

fn count(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

/// Page objects: each page, then its content.
fn page_ref(page: usize) -> Ref {
    Ref::new(FIRST_PAGE + 2 * count(page.saturating_sub(1)))
}

fn font_ref(weight: Weight) -> Ref {
    Ref::new(
        FIRST_FONT
            + if weight == Weight::Regular {
                0
            } else {
                FONT_OBJECTS
            },
    )
}

impl Writer<'_> {
    fn write(&self) -> Vec<u8> {
        let mut pdf = Pdf::new();
        let total = self.pages.sheets.len();
        let mut catalog = pdf.catalog(Ref::new(CATALOG));
        catalog
            .pages(Ref::new(TREE))
            .outlines(Ref::new(OUTLINE))
            .page_mode(PageMode::UseOutlines)
            .lang(TextStr("en"));
        catalog
            .viewer_preferences()
            .pair(Name(b"DisplayDocTitle"), true);
        catalog.finish();
        pdf.document_info(Ref::new(INFO))
            .title(TextStr(self.title))
            .producer(TextStr("harvest"));
        pdf.pages(Ref::new(TREE))
            .count(count(total))
            .kids((1..=total).map(page_ref));
        for weight in Weight::ALL {
            self.fonts
                .write(&mut pdf, weight, font_ref(weight), &compressed);
        }
        let set: Vec<Set> = (1..=total)
            .into_par_iter()
            .map(|page| self.set(page))
            .collect();
        for (page, set) in (1..).zip(set) {
            Self::page(&mut pdf, page, set);
        }
        self.outline(&mut pdf);
        pdf.finish()
    }

    /// What stands on a page.
    fn set(&self, number: usize) -> Set {
        let mut content = Content {
            fonts: self.fonts,
            out: String::new(),
            opacities: BTreeSet::from([100]),
        };
        let mut links = Vec::new();
        for mark in self
            .pages
            .sheets
            .get(number - 1)
            .map_or(&[][..], |p| &p.marks)
        {
            match mark {
                Mark::Link {
                    x,
                    y,
                    width,
                    height,
                    target,
                } => {
                    links.extend(
                        self.pages
                            .anchors
                            .get(target)
                            .map(|to| ([*x, *y, *width, *height], *to)),
                    );
                }
                Mark::PageOf {
                    x,
                    y,
                    style,
                    prefix,
                    target,
                } => {
                    if let Some((page, _)) = self.pages.anchors.get(target) {
                        content.right(*x, *y, *style, &format!("{prefix}{page}"));
                    }
                }
                other => content.mark(other),
            }
        }
        self.footer(&mut content, number);
        Set {
            content: compressed(content.out.as_bytes()),
            opacities: content.opacities,
            links,
        }
    }

    fn page(pdf: &mut Pdf, number: usize, set: Set) {
        let (id, content_id) = (page_ref(number), Ref::new(page_ref(number).get() + 1));
        let mut page = pdf.page(id);
        page.media_box(Rect::new(0.0, 0.0, WIDTH, HEIGHT))
            .parent(Ref::new(TREE))
            .contents(content_id);
        let mut resources = page.resources();
        let mut fonts = resources.fonts();
        for weight in Weight::ALL {
            fonts.pair(Name(weight.resource().as_bytes()), font_ref(weight));
        }
        fonts.finish();
        let mut states = resources.ext_g_states();
        for percent in &set.opacities {
            let opacity = f32::from(*percent) / 100.0;
            let name = format!("A{percent}");
            states
                .insert(Name(name.as_bytes()))
                .start::<pdf_writer::writers::ExtGraphicsState>()
                .non_stroking_alpha(opacity);
        }
        states.finish();
        resources.finish();
        if !set.links.is_empty() {
            let mut annotations = page.insert(Name(b"Annots")).array();
            for ([x, y, width, height], (target, top)) in set.links {
                let mut link = annotations
                    .push()
                    .start::<pdf_writer::writers::Annotation>();
                link.subtype(AnnotationType::Link).rect(Rect::new(
                    x,
                    HEIGHT - y - height,
                    x + width,
                    HEIGHT - y,
                ));
                link.border(0.0, 0.0, 0.0, None);
                let mut action = link.action();
                action.action_type(ActionType::GoTo);
                action
                    .destination()
                    .page(page_ref(target))
                    .xyz(0.0, HEIGHT - top + 6.0, None);
            }
        }
        page.finish();
        pdf.stream(content_id, &set.content)
            .filter(Filter::FlateDecode);
    }

    fn footer(&self, content: &mut Content, page: usize) {
        let style = Style {
            colour: SOFT,
            ..Style::of_size(7.5)
        };
        let y = HEIGHT - 28.0;
        content.mark(&Mark::Fill {
            x: MARGIN,
            y: y - 11.0,
            width: WIDTH - 2.0 * MARGIN,
            height: 0.4,
            colour: item::RULE,
        });
        content.mark(&Mark::Text {
            x: MARGIN,
            y,
            style,
            text: self.title.to_owned(),
        });
        content.right(
            WIDTH - MARGIN,
            y,
            style,
            &format!("page {page} of {}", self.pages.sheets.len()),
        );
    }

    /// The headings as a tree of two levels, the second folded.
    fn outline(&self, pdf: &mut Pdf) {
        let headings = &self.pages.headings;
        let first = FIRST_PAGE + 2 * count(self.pages.sheets.len());
        let id = |i: usize| Ref::new(first + count(i));
        let chapters: Vec<usize> = (0..headings.len())
            .filter(|i| headings[*i].level == 0)
            .collect();
        let mut root = pdf.outline(Ref::new(OUTLINE));
        if let (Some(from), Some(to)) = (chapters.first(), chapters.last()) {
            root.first(id(*from))
                .last(id(*to))
                .count(count(chapters.len()));
        }
        root.finish();
        for (place, &chapter) in chapters.iter().enumerate() {
            let end = chapters.get(place + 1).copied().unwrap_or(headings.len());
            let before = place.checked_sub(1).and_then(|p| chapters.get(p));
            let mut item = pdf.outline_item(id(chapter));
            describe(&mut item, &headings[chapter], Ref::new(OUTLINE));
            if let Some(before) = before {
                item.prev(id(*before));
            }
            if end < headings.len() {
                item.next(id(end));
            }
            if end > chapter + 1 {
                item.first(id(chapter + 1))
                    .last(id(end - 1))
                    .count(-count(end - chapter - 1));
            }
            item.finish();
            for (part, heading) in headings.iter().enumerate().take(end).skip(chapter + 1) {
                let mut item = pdf.outline_item(id(part));
                describe(&mut item, heading, id(chapter));
                if part > chapter + 1 {
                    item.prev(id(part - 1));
                }
                if part + 1 < end {
                    item.next(id(part + 1));
                }
            }
        }
    }
}

fn describe(item: &mut pdf_writer::writers::OutlineItem, heading: &Heading, parent: Ref) {
    item.title(TextStr(&heading.title)).parent(parent);
    item.dest()
        .page(page_ref(heading.page))
        .xyz(0.0, HEIGHT - heading.y + 6.0, None);
}

/// The operators of one page. A page that is set: its content, compressed; the opacities that it
/// uses, in percent; where its links are, and to which height of which page they lead.
struct Set {
    content: Vec<u8>,
    opacities: BTreeSet<u8>,
    links: Vec<([f32; 4], (usize, f32))>,
}

struct Content<'a> {
    fonts: &'a Fonts,
    out: String,
    opacities: BTreeSet<u8>,
}

impl Content<'_> {
    fn mark(&mut self, mark: &Mark) {
        // Writing into a String cannot fail.
        match mark {
            Mark::Text { x, y, style, text } => {
                let slant = if style.slanted { "0.2" } else { "0" };
                let [x, y, size] = [*x, HEIGHT - y, style.size].map(number);
                let encoded = self.fonts.encoded(style.weight, text);
                let (colour, font) = (rgb(style.colour), style.weight.resource());
                let _ = writeln!(
                    self.out,
                    "{colour} rg BT /{font} {size} Tf 1 0 {slant} 1 {x} {y} Tm <{encoded}> Tj ET"
                );
            }
            Mark::Drawing {
                x,
                y,
                scale,
                drawing,
            } => {
                let [x, y] = [*x, HEIGHT - y].map(number);
                // Four decimals: the scale of a drawing is multiplied by its width.
                let _ = writeln!(self.out, "q {scale:.4} 0 0 -{scale:.4} {x} {y} cm");
                self.out.push_str(&drawing.operators);
                self.out.push_str("Q\n");
                self.opacities.extend(&drawing.opacities);
            }
            Mark::Fill {
                x,
                y,
                width,
                height,
                colour,
            } => {
                let [x, y, width, height] = [*x, HEIGHT - y - height, *width, *height].map(number);
                let _ = writeln!(
                    self.out,
                    "{} rg {x} {y} {width} {height} re f",
                    rgb(*colour)
                );
            }
            Mark::Link { .. }
            | Mark::Anchor { .. }
            | Mark::PageOf { .. }
            | Mark::Heading { .. } => {}
        }
    }

    /// A text that ends at `x`.
    fn right(&mut self, x: f32, y: f32, style: Style, text: &str) {
        let x = x - self.fonts.width(style.weight, style.size, text);
        self.mark(&Mark::Text {
            x,
            y,
            style,
            text: text.to_owned(),
        });
    }
}

fn rgb(colour: item::Colour) -> String {
    colour.map(|v| number(f32::from(v) / 255.0)).join(" ")
}

fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    // Writing into a Vec cannot fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}
