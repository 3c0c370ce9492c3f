//! The objects of the PDF file: catalog, fonts, pages with their links, outline.

use pdf_writer::types::{ActionType, AnnotationType, PageMode};
use pdf_writer::writers::{Annotation, ExtGraphicsState, OutlineItem, Page, Resources};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use rayon::prelude::*;

use super::drawing_stream::compressed;
use super::fonts::{Fonts, Weight};
use super::page_content::{Link, PageContent};
use super::pagination::{HEIGHT, Heading, PagedDocument, WIDTH};

/// Numbers of the objects.
const CATALOG: i32 = 1;
const TREE: i32 = 2;
const INFO: i32 = 3;
const OUTLINE: i32 = 4;
const FIRST_FONT: i32 = 5;
const FONT_OBJECTS: i32 = 5;
const FIRST_PAGE: i32 = FIRST_FONT + 2 * FONT_OBJECTS;

/// Space shown above the target of a link, pt.
const ABOVE_TARGET: f32 = 6.0;

/// Writes the document.
pub fn write(fonts: &Fonts, title: &str, document: &PagedDocument) -> Vec<u8> {
    let mut pdf = Pdf::new();
    write_catalog(&mut pdf, title, document.pages.len());
    for weight in Weight::ALL {
        fonts.write(&mut pdf, weight, font_ref(weight), &compressed);
    }
    let contents: Vec<PageContent> = (1..=document.pages.len())
        .into_par_iter()
        .map(|number| PageContent::new(fonts, title, document, number))
        .collect();
    // Streams are numbered after pages and outline.
    let mut next = page_ref(document.pages.len() + 1).get() + to_i32(document.headings.len());
    for (number, content) in (1..).zip(&contents) {
        let first = next;
        next += to_i32(content.streams.len());
        let streams: Vec<Ref> = (first..next).map(Ref::new).collect();
        write_page(&mut pdf, number, content, &streams);
    }
    write_outline(&mut pdf, &document.headings, document.pages.len());
    pdf.finish()
}

fn to_i32(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

/// Reference of a page of a number from one.
fn page_ref(page: usize) -> Ref {
    Ref::new(FIRST_PAGE + to_i32(page.saturating_sub(1)))
}

fn font_ref(weight: Weight) -> Ref {
    match weight {
        Weight::Regular => Ref::new(FIRST_FONT),
        Weight::Bold => Ref::new(FIRST_FONT + FONT_OBJECTS),
    }
}

fn write_catalog(pdf: &mut Pdf, title: &str, pages: usize) {
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
        .title(TextStr(title))
        .producer(TextStr(env!("CARGO_PKG_NAME")));
    pdf.pages(Ref::new(TREE))
        .count(to_i32(pages))
        .kids((1..=pages).map(page_ref));
}

fn write_page(pdf: &mut Pdf, number: usize, content: &PageContent, streams: &[Ref]) {
    let mut page = pdf.page(page_ref(number));
    page.media_box(Rect::new(0.0, 0.0, WIDTH, HEIGHT))
        .parent(Ref::new(TREE))
        .contents_array(streams.iter().copied());
    write_resources(&mut page.resources(), content);
    write_links(&mut page, &content.links);
    page.finish();
    for (id, stream) in streams.iter().zip(&content.streams) {
        pdf.stream(*id, stream.bytes()).filter(Filter::FlateDecode);
    }
}

fn write_resources(resources: &mut Resources, content: &PageContent) {
    let mut fonts = resources.fonts();
    for weight in Weight::ALL {
        fonts.pair(Name(weight.resource().as_bytes()), font_ref(weight));
    }
    fonts.finish();
    let mut states = resources.ext_g_states();
    for percent in &content.opacities {
        states
            .insert(Name(format!("A{percent}").as_bytes()))
            .start::<ExtGraphicsState>()
            .non_stroking_alpha(f32::from(*percent) / 100.0);
    }
}

fn write_links(page: &mut Page, links: &[Link]) {
    if links.is_empty() {
        return;
    }
    let mut annotations = page.insert(Name(b"Annots")).array();
    for link in links {
        let mut annotation = annotations.push().start::<Annotation>();
        annotation.subtype(AnnotationType::Link).rect(Rect::new(
            link.x,
            HEIGHT - link.y - link.height,
            link.x + link.width,
            HEIGHT - link.y,
        ));
        annotation.border(0.0, 0.0, 0.0, None);
        let mut action = annotation.action();
        action.action_type(ActionType::GoTo);
        action.destination().page(page_ref(link.target_page)).xyz(
            0.0,
            HEIGHT - link.target_y + ABOVE_TARGET,
            None,
        );
    }
}

/// Writes the headings as a tree of two levels: chapters, and their sections folded.
fn write_outline(pdf: &mut Pdf, headings: &[Heading], pages: usize) {
    let first = page_ref(pages + 1).get();
    let id = |i: usize| Ref::new(first + to_i32(i));
    let chapters: Vec<usize> = (0..headings.len())
        .filter(|i| headings[*i].level == 0)
        .collect();
    let mut root = pdf.outline(Ref::new(OUTLINE));
    if let (Some(from), Some(to)) = (chapters.first(), chapters.last()) {
        root.first(id(*from))
            .last(id(*to))
            .count(to_i32(chapters.len()));
    }
    root.finish();
    for (place, &chapter) in chapters.iter().enumerate() {
        let end = chapters.get(place + 1).copied().unwrap_or(headings.len());
        let mut item = pdf.outline_item(id(chapter));
        describe(&mut item, &headings[chapter], Ref::new(OUTLINE));
        if let Some(before) = place.checked_sub(1).and_then(|p| chapters.get(p)) {
            item.prev(id(*before));
        }
        if end < headings.len() {
            item.next(id(end));
        }
        if end > chapter + 1 {
            item.first(id(chapter + 1))
                .last(id(end - 1))
                .count(-to_i32(end - chapter - 1));
        }
        item.finish();
        for (section, heading) in headings.iter().enumerate().take(end).skip(chapter + 1) {
            let mut item = pdf.outline_item(id(section));
            describe(&mut item, heading, id(chapter));
            if section > chapter + 1 {
                item.prev(id(section - 1));
            }
            if section + 1 < end {
                item.next(id(section + 1));
            }
        }
    }
}

fn describe(item: &mut OutlineItem, heading: &Heading, parent: Ref) {
    item.title(TextStr(&heading.title)).parent(parent);
    item.dest()
        .page(page_ref(heading.page))
        .xyz(0.0, HEIGHT - heading.y + ABOVE_TARGET, None);
}
