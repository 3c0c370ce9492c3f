//! Running text: inline elements as words, and words as lines of a given width.

use std::sync::Arc;

use roxmltree::Node;

use super::elements::is_screen_only;
use super::fonts::{Fonts, Weight};
use super::item::{Item, PlacedMark, SOFT, Style};
use super::svg::{self, Drawing};

/// Size of a unit (px) of an inline drawing, pt.
const PX: f32 = 0.7;
/// Space after an inline drawing, pt.
const DRAWING_MARGIN: f32 = 3.0;
/// Distance of base lines, in sizes of type.
const LEADING: f32 = 1.35;
/// Distance of the base line from the top of its line, in sizes of type.
const ASCENT: f32 = 1.02;
/// Height above the base line of the middle of inline drawings, in font sizes.
const MIDDLE: f32 = 0.36;
/// Sign before the number of a link's page.
const ARROW: &str = "\u{2192}";

/// A part of a word in one style.
#[derive(Clone, Debug)]
enum Part {
    Text {
        text: String,
        style: Style,
    },
    Drawing(Arc<Drawing>),
    /// Room for the number of a link's page.
    PageOf {
        style: Style,
        width: f32,
    },
}

/// A word: parts with their links, not broken between lines.
#[derive(Clone, Debug, Default)]
pub struct Word {
    parts: Vec<(Part, Option<String>)>,
    width: f32,
    /// Space before the word, unless it begins a line.
    space: f32,
    /// `true` if the word begins a line.
    breaks: bool,
}

fn drawing_width(drawing: &Drawing) -> f32 {
    drawing.width * PX + DRAWING_MARGIN
}

/// Reader of inline elements into words.
#[derive(Debug)]
pub struct InlineReader<'a> {
    fonts: &'a Fonts,
    words: Vec<Word>,
    word: Word,
    space: f32,
    is_preserving: bool,
}

impl<'a> InlineReader<'a> {
    pub fn new(fonts: &'a Fonts) -> Self {
        InlineReader {
            fonts,
            words: Vec::new(),
            word: Word::default(),
            space: 0.0,
            is_preserving: false,
        }
    }

    /// A reader that keeps line ends and indents.
    pub fn preserving(fonts: &'a Fonts) -> Self {
        InlineReader {
            is_preserving: true,
            ..InlineReader::new(fonts)
        }
    }

    /// The words read.
    pub fn words(mut self) -> Vec<Word> {
        self.end_word();
        self.words
    }

    /// Reads a node in a style, as part of a link if `link` names its target.
    pub fn read(&mut self, node: Node, style: Style, link: Option<&str>) {
        if let (true, Some(text)) = (node.is_text(), node.text()) {
            return self.read_text(text, style, link);
        }
        if !node.is_element() || is_screen_only(node) {
            return;
        }
        let name = node.tag_name().name();
        match name {
            "svg" => self.read_drawing(node, link),
            "br" => {
                self.end_word();
                self.word.breaks = true;
            }
            _ => self.read_children(node, element_style(name, style), link),
        }
    }

    fn read_children(&mut self, node: Node, style: Style, link: Option<&str>) {
        let name = node.tag_name().name();
        let target = (name == "a")
            .then(|| node.attribute("href")?.strip_prefix('#'))
            .flatten();
        for child in node.children() {
            self.read(child, style, target.or(link));
        }
        if name == "span" {
            self.end_word_with_space(0.8 * style.size);
        }
        // On paper a link cannot be followed: the number of its page stands after it.
        if let Some(target) = target {
            self.add_page_of(target, style);
        }
    }

    fn read_text(&mut self, text: &str, style: Style, link: Option<&str>) {
        let space = self.fonts.width(style.weight, style.size, " ");
        for (i, line) in text.split('\n').enumerate() {
            if i > 0 {
                self.end_word_with_space(space);
                self.word.breaks = self.is_preserving;
            }
            let indent = if self.is_preserving {
                line.len() - line.trim_start().len()
            } else {
                0
            };
            for (i, chunk) in line.split([' ', '\t']).enumerate() {
                if i > indent {
                    self.end_word_with_space(space);
                } else if i > 0 {
                    self.add_text("\u{a0}", style, link);
                }
                if !chunk.is_empty() {
                    self.add_text(chunk, style, link);
                }
            }
        }
    }

    fn add_text(&mut self, text: &str, style: Style, link: Option<&str>) {
        let width = self.fonts.width(style.weight, style.size, text);
        let text = text.to_owned();
        self.add(Part::Text { text, style }, width, link);
    }

    fn read_drawing(&mut self, node: Node, link: Option<&str>) {
        let drawing = svg::drawing(node, self.fonts);
        let width = drawing_width(&drawing);
        self.add(Part::Drawing(Arc::new(drawing)), width, link);
    }

    /// Reserves room behind a link for the number of its target's page, of up to three digits, which
    /// pagination fills in.
    fn add_page_of(&mut self, target: &str, style: Style) {
        let style = Style {
            size: 0.72 * style.size,
            colour: SOFT,
            weight: Weight::Regular,
            rise: 0.0,
            ..style
        };
        let width = self
            .fonts
            .width(style.weight, style.size, &format!("{ARROW}999 "));
        self.add(Part::PageOf { style, width }, width, Some(target));
    }

    fn add(&mut self, part: Part, width: f32, link: Option<&str>) {
        if self.word.parts.is_empty() {
            self.word.space = self.space;
            self.space = 0.0;
        }
        self.word.width += width;
        self.word.parts.push((part, link.map(str::to_owned)));
    }

    fn end_word_with_space(&mut self, space: f32) {
        self.end_word();
        self.space = self.space.max(space);
    }

    fn end_word(&mut self) {
        if !self.word.parts.is_empty() || self.word.breaks {
            self.words.push(std::mem::take(&mut self.word));
        }
    }
}

/// Style of an inline element within another style.
fn element_style(name: &str, outer: Style) -> Style {
    match name {
        "b" | "strong" | "th" => outer.bold(),
        "i" | "em" => Style {
            slanted: true,
            ..outer
        },
        "small" => Style {
            size: outer.size * 0.86,
            colour: SOFT,
            ..outer
        },
        "sub" => Style {
            size: outer.size * 0.75,
            rise: -0.18 * outer.size,
            ..outer
        },
        _ => outer,
    }
}

/// Layout of lines.
#[derive(Clone, Copy, Debug)]
pub struct LineLayout {
    pub width: f32,
    /// Size of type, pt.
    pub size: f32,
    /// Share of the free width before the text: 1 aligns right.
    pub align: f32,
}

impl LineLayout {
    /// Lines aligned left.
    pub fn left(width: f32, size: f32) -> LineLayout {
        LineLayout {
            width,
            size,
            align: 0.0,
        }
    }
}

/// Width of the longest word, and of the longest line without limit.
pub fn widths(words: &[Word]) -> (f32, f32) {
    let widest = words.iter().map(|w| w.width).fold(0.0, f32::max);
    let mut line = 0.0;
    let mut longest: f32 = 0.0;
    for word in words {
        line = if word.breaks || line == 0.0 {
            word.width
        } else {
            line + word.space + word.width
        };
        longest = longest.max(line);
    }
    (widest, longest)
}

/// Breaks words into lines.
pub fn lines(words: &[Word], layout: LineLayout, fonts: &Fonts) -> Vec<Item> {
    let mut lines: Vec<Vec<Word>> = Vec::new();
    let mut used = 0.0;
    for word in words.iter().flat_map(|w| split(w, layout.width, fonts)) {
        let fits = used + word.space + word.width <= layout.width + 0.01;
        match lines.last_mut() {
            Some(line) if fits && !word.breaks => {
                used += word.space + word.width;
                line.push(word);
            }
            _ => {
                used = word.width;
                lines.push(vec![Word { space: 0.0, ..word }]);
            }
        }
    }
    lines
        .iter()
        .map(|line| set_line(line, layout, fonts))
        .collect()
}

/// Splits a word that is wider than the line.
fn split(word: &Word, width: f32, fonts: &Fonts) -> Vec<Word> {
    if word.width <= width {
        return vec![word.clone()];
    }
    let mut pieces = vec![Word {
        space: word.space,
        breaks: word.breaks,
        ..Word::default()
    }];
    for (part, link) in &word.parts {
        for (part, part_width) in letters(part, fonts) {
            let is_full = pieces
                .last()
                .is_some_and(|p| !p.parts.is_empty() && p.width + part_width > width);
            if is_full {
                pieces.push(Word::default());
            }
            if let Some(piece) = pieces.last_mut() {
                piece.width += part_width;
                piece.parts.push((part, link.clone()));
            }
        }
    }
    pieces
}

/// A text as its letters, any other part as it is, with their widths.
fn letters(part: &Part, fonts: &Fonts) -> Vec<(Part, f32)> {
    match part {
        Part::Text { text, style } => text
            .chars()
            .map(|c| {
                let text = c.to_string();
                let width = fonts.width(style.weight, style.size, &text);
                (
                    Part::Text {
                        text,
                        style: *style,
                    },
                    width,
                )
            })
            .collect(),
        Part::Drawing(drawing) => vec![(part.clone(), drawing_width(drawing))],
        Part::PageOf { width, .. } => vec![(part.clone(), *width)],
    }
}

/// A text that grows while its neighbours have the same style, so that readers of the file can find
/// and copy it whole.
#[derive(Clone, Debug)]
struct TextRun {
    x: f32,
    style: Style,
    text: String,
}

/// A line in the making.
struct LineSetter<'a> {
    fonts: &'a Fonts,
    size: f32,
    x: f32,
    run: Option<TextRun>,
    item: Item,
}

/// Sets one line.
fn set_line(line: &[Word], layout: LineLayout, fonts: &Fonts) -> Item {
    let used: f32 = line.iter().map(|w| w.space + w.width).sum();
    let mut setter = LineSetter {
        fonts,
        size: layout.size,
        x: (layout.width - used).max(0.0) * layout.align,
        run: None,
        item: Item {
            height: layout.size * LEADING,
            ..Item::default()
        },
    };
    for word in line {
        setter.set_space(word.space);
        for (part, link) in &word.parts {
            setter.set_part(part, link.as_deref());
        }
    }
    setter.end_run();
    setter.item
}

impl LineSetter<'_> {
    fn base(&self) -> f32 {
        self.size * ASCENT
    }

    fn end_run(&mut self) {
        if let Some(run) = self.run.take() {
            self.item.marks.push(PlacedMark::Text {
                x: run.x,
                y: self.base() - run.style.rise,
                style: run.style,
                text: run.text,
            });
        }
    }

    /// Moves on by a space, which continues the run if it is as wide as its blank.
    fn set_space(&mut self, space: f32) {
        let blank = self
            .run
            .as_ref()
            .map(|run| self.fonts.width(run.style.weight, run.style.size, " "));
        match (&mut self.run, blank) {
            (Some(run), Some(blank)) if (space - blank).abs() < 0.01 => run.text.push(' '),
            _ if space > 0.0 => self.end_run(),
            _ => {}
        }
        self.x += space;
    }

    fn set_part(&mut self, part: &Part, link: Option<&str>) {
        let from = self.x;
        match part {
            Part::Text { text, style } => self.set_text(text, *style),
            Part::Drawing(drawing) => self.set_drawing(drawing),
            Part::PageOf { style, width } => {
                self.set_page_of(*style, *width, link.unwrap_or_default());
            }
        }
        if let Some(target) = link {
            self.item.marks.push(PlacedMark::Link {
                x: from,
                y: 0.0,
                width: self.x - from,
                height: self.item.height,
                target: target.to_owned(),
            });
        }
    }

    fn set_text(&mut self, text: &str, style: Style) {
        match &mut self.run {
            Some(run) if run.style == style => run.text.push_str(text),
            _ => {
                self.end_run();
                self.run = Some(TextRun {
                    x: self.x,
                    style,
                    text: text.to_owned(),
                });
            }
        }
        self.x += self.fonts.width(style.weight, style.size, text);
    }

    fn set_drawing(&mut self, drawing: &Arc<Drawing>) {
        self.end_run();
        self.item.marks.push(PlacedMark::Drawing {
            x: self.x,
            y: self.base() - MIDDLE * self.size - 0.5 * drawing.height * PX,
            scale: PX,
            drawing: Arc::clone(drawing),
        });
        self.x += drawing_width(drawing);
    }

    fn set_page_of(&mut self, style: Style, width: f32, target: &str) {
        self.end_run();
        self.x += width;
        self.item.marks.push(PlacedMark::PageOf {
            x: self.x - self.fonts.width(style.weight, style.size, " "),
            y: self.base(),
            style,
            prefix: ARROW,
            target: target.to_owned(),
        });
    }
}
