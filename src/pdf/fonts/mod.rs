//! The two embedded faces, regular and bold: a subset of Arimo (SIL Open Font License,
//! `fonts/OFL.txt`) with Latin, Greek and mathematical signs.

use std::collections::BTreeSet;

use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Buf, Filter, Finish, Name, Pdf, Rect, Ref, Str};
use ttf_parser::Face;

const REGULAR: &[u8] = include_bytes!("Arimo-Regular.ttf");
const BOLD: &[u8] = include_bytes!("Arimo-Bold.ttf");

/// Hexadecimal digits.
const DIGITS: &[u8; 16] = b"0123456789abcdef";

/// Weight of a text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    #[default]
    Regular,
    Bold,
}

impl Weight {
    pub const ALL: [Weight; 2] = [Weight::Regular, Weight::Bold];

    /// Name among a page's resources.
    pub fn resource(self) -> &'static str {
        match self {
            Weight::Regular => "R",
            Weight::Bold => "B",
        }
    }
}

/// One face: its file, and the widths of its characters.
#[derive(Clone, Debug)]
struct FontFace {
    name: &'static str,
    file: &'static [u8],
    /// Glyph and width in thousandths of the size, at the code of a character.
    glyphs: Vec<Option<(u16, f32)>>,
    widths: Vec<f32>,
    bounds: Rect,
    ascent: f32,
    descent: f32,
}

/// Both faces.
#[derive(Clone, Debug)]
pub struct Fonts {
    regular: FontFace,
    bold: FontFace,
}

impl Fonts {
    /// Reads the built-in faces.
    ///
    /// # Errors
    /// Never for the built-in faces.
    pub fn load() -> Result<Fonts, String> {
        Ok(Fonts {
            regular: FontFace::read("Arimo", REGULAR)?,
            bold: FontFace::read("Arimo-Bold", BOLD)?,
        })
    }

    fn face(&self, weight: Weight) -> &FontFace {
        match weight {
            Weight::Regular => &self.regular,
            Weight::Bold => &self.bold,
        }
    }

    /// Width of a text, in the unit of the size.
    pub fn width(&self, weight: Weight, size: f32, text: &str) -> f32 {
        let face = self.face(weight);
        text.chars().map(|c| face.glyph(c).1).sum::<f32>() * size / 1000.0
    }

    /// Numbers of a text's glyphs, hexadecimal.
    pub fn glyph_numbers(&self, weight: Weight, text: &str) -> String {
        let face = self.face(weight);
        let mut digits = String::with_capacity(4 * text.len());
        for c in text.chars() {
            let (glyph, _) = face.glyph(c);
            for shift in [12, 8, 4, 0] {
                digits.push(char::from(DIGITS[usize::from(glyph >> shift) % 16]));
            }
        }
        digits
    }

    /// Writes a face as five objects from `first` on.
    pub fn write(
        &self,
        pdf: &mut Pdf,
        weight: Weight,
        first: Ref,
        compressed: &dyn Fn(&[u8]) -> Vec<u8>,
    ) {
        self.face(weight).write(pdf, first, compressed);
    }
}

impl FontFace {
    fn read(name: &'static str, file: &'static [u8]) -> Result<FontFace, String> {
        let face = Face::parse(file, 0).map_err(|e| format!("the font {name}: {e}"))?;
        let unit = 1000.0 / f32::from(face.units_per_em());
        let width = |glyph: u16| {
            f32::from(
                face.glyph_hor_advance(ttf_parser::GlyphId(glyph))
                    .unwrap_or(0),
            ) * unit
        };
        let mut glyphs = Vec::new();
        for subtable in face
            .tables()
            .cmap
            .into_iter()
            .flat_map(|t| t.subtables)
            .filter(ttf_parser::cmap::Subtable::is_unicode)
        {
            subtable.codepoints(|code| {
                if let (Some(c), Some(glyph)) = (char::from_u32(code), subtable.glyph_index(code)) {
                    let place = c as usize;
                    glyphs.resize(glyphs.len().max(place + 1), None);
                    glyphs[place] = Some((glyph.0, width(glyph.0)));
                }
            });
        }
        let b = face.global_bounding_box();
        let scaled = |v: i16| f32::from(v) * unit;
        Ok(FontFace {
            name,
            file,
            glyphs,
            widths: (0..face.number_of_glyphs()).map(width).collect(),
            bounds: Rect::new(
                scaled(b.x_min),
                scaled(b.y_min),
                scaled(b.x_max),
                scaled(b.y_max),
            ),
            ascent: scaled(face.ascender()),
            descent: scaled(face.descender()),
        })
    }

    /// Glyph and width of a character; the empty box if the face lacks it.
    fn glyph(&self, c: char) -> (u16, f32) {
        let missing = (0, self.widths.first().copied().unwrap_or(500.0));
        let known = self.glyphs.get(c as usize).copied().flatten();
        known.unwrap_or(missing)
    }

    /// Writes the face, from the reference `first` on.
    fn write(&self, pdf: &mut Pdf, first: Ref, compressed: &dyn Fn(&[u8]) -> Vec<u8>) {
        let [cid, descriptor, file, unicode] = [1, 2, 3, 4].map(|i| Ref::new(first.get() + i));
        let name = Name(self.name.as_bytes());
        pdf.type0_font(first)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(unicode);
        let system = SystemInfo {
            registry: Str(b"Adobe"),
            ordering: Str(b"Identity"),
            supplement: 0,
        };
        self.write_cid_font(pdf, (cid, descriptor), system);
        self.write_descriptor(pdf, (descriptor, file));
        let bytes = compressed(self.file);
        let length = i32::try_from(self.file.len()).unwrap_or(i32::MAX);
        pdf.stream(file, &bytes)
            .filter(Filter::FlateDecode)
            .pair(Name(b"Length1"), length);
        pdf.cmap(unicode, &compressed(&self.unicode_map(system)))
            .filter(Filter::FlateDecode);
    }

    /// Writes the widths of the glyphs.
    fn write_cid_font(&self, pdf: &mut Pdf, (cid, descriptor): (Ref, Ref), system: SystemInfo) {
        let mut font = pdf.cid_font(cid);
        font.subtype(CidFontType::Type2)
            .base_font(Name(self.name.as_bytes()))
            .system_info(system)
            .font_descriptor(descriptor);
        font.default_width(0.0)
            .cid_to_gid_map_predefined(Name(b"Identity"));
        font.widths().consecutive(0, self.widths.iter().copied());
        font.finish();
    }

    /// Writes the face's measures.
    fn write_descriptor(&self, pdf: &mut Pdf, (descriptor, file): (Ref, Ref)) {
        let is_bold = self.name.ends_with("Bold");
        pdf.font_descriptor(descriptor)
            .name(Name(self.name.as_bytes()))
            .flags(FontFlags::SYMBOLIC)
            .bbox(self.bounds)
            .italic_angle(0.0)
            .ascent(self.ascent)
            .descent(self.descent)
            .cap_height(688.0)
            .stem_v(if is_bold { 140.0 } else { 80.0 })
            .font_file2(file);
    }

    /// Characters of the glyphs, for readers that copy text.
    fn unicode_map(&self, system: SystemInfo) -> Buf {
        let mut map = UnicodeCmap::new(Name(b"Unicode"), system);
        // Hyphen and soft hyphen share a glyph, which stands for the hyphen: it comes first.
        let mut mapped = BTreeSet::new();
        for (code, glyph) in (0..).zip(&self.glyphs) {
            if let (Some(c), Some((glyph, _))) = (char::from_u32(code), glyph)
                && mapped.insert(*glyph)
            {
                map.pair(*glyph, c);
            }
        }
        map.finish()
    }
}
