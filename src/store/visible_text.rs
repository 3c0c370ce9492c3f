//! Texts without characters that are invisible or reorder a line.

use std::borrow::Cow;

/// Text with such characters replaced by underscores. Line breaks, which some messages have, are
/// kept.
pub fn of(text: &str) -> Cow<'_, str> {
    let is_plain = |byte: u8| matches!(byte, b' '..=b'~' | b'\n');
    let deceives = |c: char| c != '\n' && is_invisible(c);
    // Most texts are plain; they are told from others without decoding.
    if !text.bytes().all(is_plain) && text.contains(deceives) {
        let replaced = text.chars().map(|c| if deceives(c) { '_' } else { c });
        replaced.collect::<String>().into()
    } else {
        text.into()
    }
}

/// `true` for control characters, marks of writing direction, and characters without width.
pub fn is_invisible(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_reader_sees_is_replaced_and_all_else_stays() {
        assert_eq!(of("a\u{1b}[31m\u{202e}b\u{7f}"), "a_[31m_b_");
        assert_eq!(of("München, 30°\nnext line"), "München, 30°\nnext line");
    }
}
