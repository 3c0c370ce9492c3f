//! Running text: the inline elements of the page as words, and words as lines of a given width.

use std::sync::Arc;

use roxmltree::Node;

use super::elements::is_for_screens;
use super::fonts::{Fonts, Weight};
use super::item::{Item, Mark, SOFT, Style};
use super::svg::{self, Drawing};

/// A page unit of a small drawing in the text (an SVG of so many px) in pt.
const PX: f32 = 0.7;
/// Distance of base lines, in sizes.
const LEADING: f32 = 1.35;

/// A part of a word that is set in one way.
#[derive(Clone, Debug)]
enum Part {
    Text {
        text: String,
        style: Style,
    },
    Drawing(Arc<Drawing>),
    /// Room for the page that a link leads to.
    PageOf {
        style: Style,
        width: f32,
    },
}

/// What is not broken: its parts with their links.
#[derive(Clone, Debug, Default)]
pub struct Word {
    parts: Vec<(Part, Option<String>)>,
    width: f32,
    /// The space before it, where it is not the first of its line.
    space: f32,
    /// Begins a new line.
    breaks: bool,
}

/// Reads inline elements into words.
#[derive(Debug)]
pub struct Reader<'a> {
    fonts: &'a Fonts,
    words: Vec<Word>,
    word: Word,
    space: f32,
    is_preserved: bool,
}

impl<'a> Reader<'a> {
    pub fn new(fonts: &'a Fonts) -> Self {
        Reader {
            fonts,
            words: Vec::new(),
            word: Word::default(),
            space: 0.0,
            is_preserved: false,
        }
    }

    pub fn words(mut self) -> Vec<Word> {
        self.end_word();
        self.words
    }

    /// Line ends are kept, as in `pre`.
    pub fn preserved(self) -> Self {
        Reader {
            is_preserved: true,
            ..self
        }
    }

    pub fn read(&mut self, node: Node, style: Style, link: Option<&str>) {
        if let (true, Some(text)) = (node.is_text(), node.text()) {
            return self.text(text, style, link);
        }
        if !node.is_element() || is_for_screens(node) {
            return;
        }
        let name = node.tag_name().name();
        let small = style.size * 0.86;
        let style = match name {
            "b" | "strong" | "th" => style.bold(),
            "i" | "em" => Style {
                slanted: true,
                ..style
            },
            "small" => Style {
                size: small,
                colour: SOFT,
                ..style
            },
            "sub" => Style {
                size: style.size * 0.75,
                rise: -0.18 * style.size,
                ..style
            },
            _ => style,
        };
        match name {
            "svg" => return self.drawing(node, link),
            "br" => {
                self.end_word();
                self.word.breaks = true;
                return;
            }
            _ => {}
        }
        let target = (name == "a")
            .then(|| node.attribute("href")?.strip_prefix('#'))
            .flatten();
        for child in node.children() {
            self.read(child, style, target.or(link));
        }
        match (name, target) {
            ("span", _) => self.pause(0.8 * style.size),
            // A reader of paper cannot follow a link: the page it leads to stands behind it.
            ("a", Some(target)) => self.page_of(target, style),
            _ => {}
        }
    }

    fn text(&mut self, text: &str, style: Style, link: Option<&str>) {
        let space = self.fonts.width(style.weight, style.size, " ");
        for (i, line) in text.split('\n').enumerate() {
            if i > 0 {
                self.pause(space);
                self.word.breaks = self.is_preserved;
            }
            let indent = if self.is_preserved {
                line.len() - line.trim_start().len()
            } else {
                0
            };
            for (i, chunk) in line.split([' ', '\t']).enumerate() {
                if i > indent {
                    self.pause(space);
                } else if i > 0 {
                    self.push("\u{a0}", style, link);
                }
                if !chunk.is_empty() {
                    self.push(chunk, style, link);
                }
            }
        }
    }

    fn push(&mut self, text: &str, style: Style, link: Option<&str>) {
        let width = self.fonts.width(style.weight, style.size, text);
        self.part(
            Part::Text {
                text: text.to_owned(),
                style,
            },
            width,
            link,
        );
    }

    fn part(&mut self, part: Part, width: f32, link: Option<&str>) {
        if self.word.parts.is_empty() {
            self.word.space = self.space;
            self.space = 0.0;
        }
        self.word.width += width;
        self.word.parts.push((part, link.map(str::to_owned)));
    }

    fn drawing(&mut self, node: Node, link: Option<&str>) {
        let drawing = svg::drawing(node, self.fonts);
        // Its margin to the word it stands before.
        let width = drawing.width * PX + 3.0;
        self.part(Part::Drawing(Arc::new(drawing)), width, link);
    }

    fn page_of(&mut self, target: &str, style: Style) {
        let style = Style {
            size: 0.72 * style.size,
            colour: SOFT,
            weight: Weight::Regular,
            rise: 0.0,
            ..style
        };
        let width = self.fonts.width(style.weight, style.size, "\u{2192}999 ");
        self.part(Part::PageOf { style, width }, width, Some(target));
    }

    fn pause(&mut self, space: f32) {
        self.end_word();
        self.space = self.space.max(space);
    }

    fn end_word(&mut self) {
        if !self.word.parts.is_empty() || self.word.breaks {
            self.words.push(std::mem::take(&mut self.word));
        }
    }
}

/// How words fill a width.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    pub width: f32,
    pub size: f32,
    /// Share of the room left over that stands before a line: 1 to set it right.
    pub align: f32,
}

/// The widest word, and all of them in one line.
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

/// The lines that words make.
pub fn lines(words: &[Word], setting: Setting, fonts: &Fonts) -> Vec<Item> {
    let mut lines: Vec<Vec<Word>> = Vec::new();
    let mut used = 0.0;
    for word in words.iter().flat_map(|w| pieces(w, setting.width, fonts)) {
        let fits = used + word.space + word.width <= setting.width + 0.01;
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
    lines.iter().map(|line| set(line, setting, fonts)).collect()
}

/// A word that is wider than the line, cut into pieces that are not.
fn pieces(word: &Word, width: f32, fonts: &Fonts) -> Vec<Word> {
    if word.width <= width {
        return vec![word.clone()];
    }
    let mut pieces = vec![Word {
        space: word.space,
        breaks: word.breaks,
        ..Word::default()
    }];
    let mut add = |part: Part, link: &Option<String>, of: f32| {
        let is_full = pieces
            .last()
            .is_some_and(|p| !p.parts.is_empty() && p.width + of > width);
        if is_full {
            pieces.push(Word::default());
        }
        if let Some(piece) = pieces.last_mut() {
            piece.width += of;
            piece.parts.push((part, link.clone()));
        }
    };
    for (part, link) in &word.parts {
        match part {
            Part::Text { text, style } => {
                for c in text.chars() {
                    let text = c.to_string();
                    let of = fonts.width(style.weight, style.size, &text);
                    add(
                        Part::Text {
                            text,
                            style: *style,
                        },
                        link,
                        of,
                    );
                }
            }
            Part::Drawing(drawing) => add(part.clone(), link, drawing.width * PX + 3.0),
            Part::PageOf { width, .. } => add(part.clone(), link, *width),
        }
    }
    pieces
}

fn set(line: &[Word], setting: Setting, fonts: &Fonts) -> Item {
    let used: f32 = line.iter().map(|w| w.space + w.width).sum();
    let mut x = (setting.width - used).max(0.0) * setting.align;
    let height = setting.size * LEADING;
    let base = setting.size * 1.02;
    let mut item = Item {
        height,
        ..Item::default()
    };
    // Neighbours that are set alike are one text, so that it can be found and copied whole.
    let mut run: Option<(f32, Style, String)> = None;
    let end = |run: &mut Option<(f32, Style, String)>, item: &mut Item| {
        if let Some((x, style, text)) = run.take() {
            item.marks.push(Mark::Text {
                x,
                y: base - style.rise,
                style,
                text,
            });
        }
    };
    for word in line {
        let blank = run
            .as_ref()
            .map(|(_, style, _)| fonts.width(style.weight, style.size, " "));
        match (&mut run, blank) {
            (Some((_, _, text)), Some(blank)) if (word.space - blank).abs() < 0.01 => {
                text.push(' ')
            }
            _ if word.space > 0.0 => end(&mut run, &mut item),
            _ => {}
        }
        x += word.space;
        for (part, link) in &word.parts {
            let from = x;
            match part {
                Part::Text { text, style } => {
                    x += fonts.width(style.weight, style.size, text);
                    match &mut run {
                        Some((_, of, all)) if of == style => all.push_str(text),
                        _ => {
                            end(&mut run, &mut item);
                            run = Some((from, *style, text.clone()));
                        }
                    }
                }
                Part::Drawing(drawing) => {
                    end(&mut run, &mut item);
                    let y = base - 0.36 * setting.size - 0.5 * drawing.height * PX;
                    item.marks.push(Mark::Drawing {
                        x,
                        y,
                        scale: PX,
                        drawing: Arc::clone(drawing),
                    });
                    x += drawing.width * PX + 3.0;
                }
                Part::PageOf { style, width } => {
                    end(&mut run, &mut item);
                    let target = link.clone().unwrap_or_default();
                    x += width;
                    let right = x - fonts.width(style.weight, style.size, " ");
                    item.marks.push(Mark::PageOf {
                        x: right,
                        y: base,
                        style: *style,
                        prefix: "\u{2192}",
                        target,
                    });
                }
            }
            if let Some(target) = link {
                let (width, target) = (x - from, target.clone());
                item.marks.push(Mark::Link {
                    x: from,
                    y: 0.0,
                    width,
                    height,
                    target,
                });
            }
        }
    }
    end(&mut run, &mut item);
    item
}
