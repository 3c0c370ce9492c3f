//! Bounds of a YAML text, checked before it is parsed: the parser's time grows with the square of its nesting
//! and of its directives.

/// Largest file, bytes: eighty times the longest of the shipped pipelines.
const LARGEST: usize = 1 << 20;

/// Deepest nesting of a file. The shipped pipelines reach eight levels; the parser takes
/// milliseconds for a thousand.
const DEEPEST: usize = 1000;

/// Characters that end a line in YAML.
const BREAKS: [char; 5] = ['\n', '\r', '\u{85}', '\u{2028}', '\u{2029}'];

/// Finds the first place at which a text exceeds the bounds: its line, counted from 1, and the
/// reason. Brackets in comments count too, since only the parser can find where a comment begins.
pub fn excess(text: &str) -> Option<(Option<usize>, &'static str)> {
    if text.len() > LARGEST {
        return Some((None, "it is larger than 1 MB, more than any such file has"));
    }
    let mut open = 0_usize;
    for (line, text) in (1..).zip(text.split(BREAKS)) {
        if text.starts_with('%') {
            return Some((
                Some(line),
                "a line begins with `%`: directives are not read",
            ));
        }
        for c in text.chars() {
            match c {
                '[' | '{' => open += 1,
                ']' | '}' => open = open.saturating_sub(1),
                _ => {}
            }
            if open > DEEPEST {
                return Some((Some(line), "brackets are nested more than 1000 deep here"));
            }
        }
        // Each of these may begin another level: `- - - 1`.
        let words = text.split([' ', '\t']);
        if words.filter(|word| ["-", "?"].contains(word)).count() > DEEPEST {
            let what = "dashes or question marks are nested more than 1000 deep here";
            return Some((Some(line), what));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Option<usize> {
        excess(text).and_then(|(line, _)| line)
    }

    #[test]
    fn deep_nesting_is_found_on_its_line_wherever_the_parser_may_see_it() {
        let deep = "[".repeat(1001);
        for before in [
            "a: 1\nb: ",
            "a: 1\nb: [\" #\", ",
            "# a comment\r",
            "# a comment\u{85}",
            "a: [ \"x\n# \", ",
        ] {
            assert_eq!(line(&format!("{before}{deep}")), Some(2), "{before:?}");
        }
        let hidden = "\" #\", [\n".repeat(1001);
        assert_eq!(line(&format!("a: [{hidden}")), Some(1000));
        assert_eq!(line(&format!("a:\n{}1", "- ".repeat(1001))), Some(2));
        assert_eq!(excess(&"b: [{c: [1]}] # [[\n".repeat(400)), None);
    }

    #[test]
    fn directives_and_large_files_are_refused() {
        assert_eq!(line("a: 1\n%TAG !t! tag:x,2000:\n"), Some(2));
        assert!(excess(&"# a\n".repeat(300_000)).is_some());
        assert_eq!(excess("a: 20 % of it\n"), None);
    }
}
