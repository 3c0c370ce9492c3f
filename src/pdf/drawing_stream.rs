//! Drawings between paragraphs, each as a compressed content stream of its own. An unchanged drawing of the
//! last report is neither converted nor compressed again.

use std::io::Write as _;
use std::sync::Arc;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use roxmltree::Node;

use super::fonts::Fonts;
use super::svg;
use crate::drawing_cache::DrawingCache;

/// Maker of the streams of a page's drawings.
#[derive(Clone, Copy, Debug)]
pub struct DrawingStreams<'a> {
    pub fonts: &'a Fonts,
    pub cache: &'a DrawingCache,
    /// Text before the page's root element, which declares what entities stand for.
    pub declarations: &'a str,
}

impl DrawingStreams<'_> {
    /// Stream of an `svg` element.
    pub fn of(&self, svg: Node) -> DrawingStream {
        let text = svg.document().input_text().get(svg.range());
        let drawn = text.and_then(|text| {
            let key = self.key(text);
            self.cache.get_or_draw(&key, || Some(self.converted(svg)))
        });
        DrawingStream {
            bytes: drawn.unwrap_or_else(|| Arc::new(self.converted(svg))),
        }
    }

    /// Key of the drawing of an element's text.
    fn key(&self, text: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.declarations.as_bytes());
        hasher.update(text.as_bytes());
        hasher.finalize().to_hex().to_string()
    }

    fn converted(&self, svg: Node) -> Vec<u8> {
        let drawing = svg::drawing(svg, self.fonts);
        // At most 101 opacities, in whole percent.
        let mut bytes = vec![u8::try_from(drawing.opacities.len()).unwrap_or(u8::MAX)];
        bytes.extend(&drawing.opacities);
        bytes.extend(compressed(drawing.operators.as_bytes()));
        bytes
    }
}

/// A drawing's operators, compressed.
#[derive(Clone, Debug)]
pub struct DrawingStream {
    /// Number of opacities, the opacities, and the stream.
    bytes: Arc<Vec<u8>>,
}

impl DrawingStream {
    /// Opacities used, percent.
    pub fn opacities(&self) -> &[u8] {
        self.parts().0
    }

    /// The compressed operators.
    pub fn stream(&self) -> &[u8] {
        self.parts().1
    }

    fn parts(&self) -> (&[u8], &[u8]) {
        let parts = self.bytes.split_first().and_then(|(count, rest)| {
            let count = usize::from(*count);
            rest.split_at_checked(count)
        });
        parts.unwrap_or_default()
    }
}

/// Operators of a content stream, compressed.
pub fn compressed(operators: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(4));
    // Writing into a Vec cannot fail.
    let _ = encoder.write_all(operators);
    encoder.finish().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    const DRAWING: &str =
        r#"<svg viewBox="0 0 9 9"><rect opacity=".5" width="1" height="2"/></svg>"#;
    const LIGHTER: &str =
        r#"<svg viewBox="0 0 9 9"><rect opacity=".2" width="1" height="2"/></svg>"#;

    /// Streams of the drawings of a page after some declarations.
    fn streams(cache: &DrawingCache, declarations: &str, page: &str) -> Vec<DrawingStream> {
        let page = format!("{page}</p>");
        let xml = roxmltree::Document::parse(&page).unwrap();
        let fonts = Fonts::load().unwrap();
        let streams = DrawingStreams {
            fonts: &fonts,
            cache,
            declarations,
        };
        let drawings = xml.root_element().children().filter(Node::is_element);
        drawings.map(|svg| streams.of(svg)).collect()
    }

    #[test]
    fn a_drawing_is_its_opacities_and_its_operators() {
        let streams = streams(&DrawingCache::default(), "", &format!("<p>{DRAWING}"));
        let mut operators = String::new();
        let mut decoder = flate2::read::ZlibDecoder::new(streams[0].stream());
        decoder.read_to_string(&mut operators).unwrap();
        assert_eq!(streams[0].opacities(), [50]);
        assert_eq!(operators, "/A50 gs\n0 0 0 rg\n0 0 1 2 re f\n");
    }

    #[test]
    fn each_drawing_of_a_page_is_its_own() {
        // After a byte order mark, and letters of several bytes.
        for begin in ["<p>", "\u{feff}<p>90°"] {
            let page = format!("{begin}{DRAWING}{LIGHTER}");
            let streams = streams(&DrawingCache::default(), "", &page);
            let opacities = streams.iter().map(DrawingStream::opacities);
            assert_eq!(opacities.collect::<Vec<_>>(), [[50], [20]]);
        }
    }

    #[test]
    fn a_drawing_is_converted_once_unless_declarations_change() {
        let cache = DrawingCache::default();
        let page = format!("<p>{DRAWING}");
        let made = |declarations| streams(&cache, declarations, &page).remove(0).bytes;
        let first = made("");
        assert!(Arc::ptr_eq(&first, &made("")));
        assert!(!Arc::ptr_eq(&first, &made("<!DOCTYPE p>")));
    }
}
