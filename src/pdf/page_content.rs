//! A page as PDF operators: its marks and its footer.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::drawing_stream::{DrawingStream, compressed};
use super::fonts::Fonts;
use super::item::{PlacedMark, RULE, SOFT, Style};
use super::operand::{Colour, Number, Rgb};
use super::pagination::{HEIGHT, MARGIN, PagedDocument, WIDTH};

/// Content streams and resources of one page.
pub struct PageContent<'a> {
    fonts: &'a Fonts,
    /// Compressed streams, which a reader joins.
    pub streams: Vec<PageStream>,
    /// Operators after the streams.
    operators: String,
    /// Opacities used, percent.
    pub opacities: BTreeSet<u8>,
    pub links: Vec<Link>,
}

/// A compressed content stream.
pub enum PageStream {
    Operators(Vec<u8>),
    Drawing(DrawingStream),
}

impl PageStream {
    pub fn bytes(&self) -> &[u8] {
        match self {
            PageStream::Operators(bytes) => bytes,
            PageStream::Drawing(drawing) => drawing.stream(),
        }
    }
}

/// A rectangle that leads to a place of the document; y from the top of the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    pub x: f32,
    pub y: f32,
    pub width: f32,
    pub height: f32,
    pub target_page: usize,
    pub target_y: f32,
}

impl<'a> PageContent<'a> {
    /// Sets the page of a number from one.
    pub fn new(
        fonts: &'a Fonts,
        title: &str,
        document: &PagedDocument,
        number: usize,
    ) -> PageContent<'a> {
        let mut content = PageContent {
            fonts,
            streams: Vec::new(),
            operators: String::new(),
            opacities: BTreeSet::from([100]),
            links: Vec::new(),
        };
        let page = number.checked_sub(1).and_then(|i| document.pages.get(i));
        for mark in page.map_or(&[][..], |p| &p.marks) {
            content.mark(mark, document);
        }
        content.footer(title, number, document.pages.len());
        content.end_stream();
        content
    }

    fn mark(&mut self, mark: &PlacedMark, document: &PagedDocument) {
        match mark {
            PlacedMark::Text { x, y, style, text } => self.text(*x, *y, *style, text),
            PlacedMark::Fill {
                x,
                y,
                width,
                height,
                colour,
            } => self.fill([*x, *y, *width, *height], *colour),
            PlacedMark::Drawing {
                x,
                y,
                scale,
                drawing,
            } => self.scaled(*x, *y, *scale, |own| {
                own.operators.push_str(&drawing.operators);
                own.opacities.extend(&drawing.opacities);
            }),
            PlacedMark::DrawingStream {
                x,
                y,
                scale,
                drawing,
            } => self.scaled(*x, *y, *scale, |own| {
                own.end_stream();
                own.streams.push(PageStream::Drawing(drawing.clone()));
                own.opacities.extend(drawing.opacities());
            }),
            PlacedMark::Link {
                x,
                y,
                width,
                height,
                target,
            } => {
                if let Some(to) = document.anchors.get(target) {
                    self.link([*x, *y, *width, *height], *to);
                }
            }
            PlacedMark::PageOf {
                x,
                y,
                style,
                prefix,
                target,
            } => {
                if let Some((page, _)) = document.anchors.get(target) {
                    self.text_ending_at(*x, *y, *style, &format!("{prefix}{page}"));
                }
            }
            PlacedMark::Anchor { .. } | PlacedMark::Heading { .. } | PlacedMark::Contents => {}
        }
    }

    fn text(&mut self, x: f32, y: f32, style: Style, text: &str) {
        let slant = if style.slanted { "0.2" } else { "0" };
        let [x, y, size] = [x, HEIGHT - y, style.size].map(Number);
        let encoded = self.fonts.glyph_numbers(style.weight, text);
        let (colour, font) = (Rgb(style.colour), style.weight.resource());
        let _ = writeln!(
            self.operators,
            "{colour} rg BT /{font} {size} Tf 1 0 {slant} 1 {x} {y} Tm <{encoded}> Tj ET"
        );
    }

    fn text_ending_at(&mut self, right: f32, y: f32, style: Style, text: &str) {
        let width = self.fonts.width(style.weight, style.size, text);
        self.text(right - width, y, style, text);
    }

    /// Draws in the scaled coordinates of a drawing, whose y points down.
    fn scaled(&mut self, x: f32, y: f32, scale: f32, draw: impl FnOnce(&mut Self)) {
        let [x, y] = [x, HEIGHT - y].map(Number);
        // Four decimals: the scale of a drawing is multiplied by its width.
        // Writing into a String cannot fail.
        let _ = writeln!(self.operators, "q {scale:.4} 0 0 -{scale:.4} {x} {y} cm");
        draw(self);
        self.operators.push_str("Q\n");
    }

    /// Ends the stream of the operators so far.
    fn end_stream(&mut self) {
        let stream = compressed(self.operators.as_bytes());
        self.streams.push(PageStream::Operators(stream));
        self.operators.clear();
    }

    fn link(&mut self, [x, y, width, height]: [f32; 4], (page, top): (usize, f32)) {
        self.links.push(Link {
            x,
            y,
            width,
            height,
            target_page: page,
            target_y: top,
        });
    }

    fn fill(&mut self, [x, y, width, height]: [f32; 4], colour: Colour) {
        let [x, y, width, height] = [x, HEIGHT - y - height, width, height].map(Number);
        let _ = writeln!(
            self.operators,
            "{} rg {x} {y} {width} {height} re f",
            Rgb(colour)
        );
    }

    /// A rule, the document's title, the number of the page.
    fn footer(&mut self, title: &str, number: usize, pages: usize) {
        let style = Style {
            colour: SOFT,
            ..Style::of_size(7.5)
        };
        let y = HEIGHT - 28.0;
        self.fill([MARGIN, y - 11.0, WIDTH - 2.0 * MARGIN, 0.4], RULE);
        self.text(MARGIN, y, style, title);
        let page = format!("page {number} of {pages}");
        self.text_ending_at(WIDTH - MARGIN, y, style, &page);
    }
}
