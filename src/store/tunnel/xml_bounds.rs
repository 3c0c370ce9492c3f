//! Bounds of an XML text, checked before it is parsed. The parser's time grows with the square of
//! an element's attributes, and entities multiply the text.

/// Largest file, bytes: a hundred times a simulator's aerodynamic model.
const LARGEST_XML: usize = 1 << 25;

/// Largest number of attributes of an element; those of DAVE-ML have some ten.
const MOST_ATTRIBUTES: usize = 1000;

/// Finds the first place at which a text exceeds the bounds: its line, counted from 1, and the
/// reason.
pub fn excess(text: &str) -> Option<(Option<usize>, &'static str)> {
    let line = |at: usize| {
        let before = text.get(..at).unwrap_or_default();
        Some(1 + before.matches('\n').count())
    };
    if text.len() > LARGEST_XML {
        return Some((None, "it is larger than 33 MB, more than any model has"));
    }
    if let Some(at) = text.find("<!ENTITY") {
        return Some((line(at), "it declares an entity; entities are not read"));
    }
    let mut at = 0;
    for element in text.split('<') {
        let values = element.match_indices('=').filter(|(equals, _)| {
            let after = element.get(equals + 1..).unwrap_or_default();
            after.trim_start().starts_with(['"', '\''])
        });
        if values.count() > MOST_ATTRIBUTES {
            return Some((line(at), "an element has more than 1000 attributes"));
        }
        at += element.len() + 1;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entities_and_floods_of_attributes_are_named_with_their_lines() {
        let line = |text: &str| excess(text).and_then(|(line, _)| line);
        assert_eq!(line("<?xml?>\n<!DOCTYPE a [<!ENTITY x \"y\">]>"), Some(2));
        let flood = "a = \"1\" ".repeat(1001);
        assert_eq!(line(&format!("<a>\n<b/>\n<c {flood}/>")), Some(3));
        let many = "<c a=\"1\" b='2'/>\n".repeat(2000);
        assert_eq!(
            excess(&format!("<a>{many}<!-- {} --></a>", "=".repeat(5000))),
            None
        );
    }
}
