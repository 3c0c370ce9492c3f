//! Rules for the files of an archive: names that belong to no flight, ids from names, the message
//! for unreadable files.

use crate::store::visible_text::is_invisible;

/// `true` for a name that other programs reserve for temporary files.
pub(super) fn is_hidden(name: &str) -> bool {
    name.starts_with(['.', '_'])
}

/// Message for a file that the Parquet reader rejects.
pub(super) fn unreadable(e: &dyn std::fmt::Display) -> String {
    format!("not a readable Parquet file (truncated, or another format?): {e}")
}

/// Id of a flight from the name of its file or folder. Characters that are invisible or reorder a
/// line are replaced. An id that a spreadsheet would take for a formula begins with an underscore.
pub(super) fn flight_id(name: &str) -> String {
    let visible = |c: char| if is_invisible(c) { '_' } else { c };
    let id: String = name.chars().map(visible).collect();
    if id.trim().is_empty() || id.starts_with(['=', '+', '-', '@', ' ']) {
        format!("_{id}")
    } else {
        id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_has_no_character_that_deceives_a_reader_or_a_spreadsheet() {
        for (name, id) in [
            ("flight_001", "flight_001"),
            ("Flug 7, München", "Flug 7, München"),
            ("a\u{1b}[31mb\nc", "a_[31mb_c"),
            ("evil\u{202e}txt", "evil_txt"),
            ("=HYPERLINK(1)", "_=HYPERLINK(1)"),
            ("-1+2", "_-1+2"),
            ("\t", "_"),
            ("  ", "_  "),
        ] {
            assert_eq!(flight_id(name), id);
        }
    }
}
