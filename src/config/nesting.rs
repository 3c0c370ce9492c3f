//! Depth of a YAML text, measured before it is parsed: the parser's time grows with its square.

/// Deepest nesting of a file. Those of a pipeline reach eight levels.
const DEEPEST: usize = 100;

/// Message for a text that is nested too deep.
pub const REASON: &str = "brackets, dashes or question marks are nested more than 100 deep here";

/// First line of a text, counted from 1, that is nested too deep; `None` if none is.
pub fn too_deep(text: &str) -> Option<usize> {
    let mut open = 0_usize;
    for (index, line) in text.lines().enumerate() {
        let line = without_comment(line);
        for c in line.chars() {
            match c {
                '[' | '{' => open += 1,
                ']' | '}' => open = open.saturating_sub(1),
                _ => {}
            }
            if open > DEEPEST {
                return Some(index + 1);
            }
        }
        // Each of these begins a level of its own: `- - - 1`.
        let marks = line
            .split([' ', '\t'])
            .take_while(|word| ["", "-", "?"].contains(word));
        if marks.filter(|word| !word.is_empty()).count() > DEEPEST {
            return Some(index + 1);
        }
    }
    None
}

/// A line without what follows a `#` that begins a comment.
pub fn without_comment(line: &str) -> &str {
    if line.trim_start().starts_with('#') {
        ""
    } else {
        line.split(" #").next().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deep_nesting_is_found_on_its_line_and_brackets_in_comments_do_not_count() {
        assert_eq!(too_deep(&format!("a: 1\nb: {}", "[".repeat(101))), Some(2));
        assert_eq!(too_deep(&format!("a:\n{}1", "- ".repeat(101))), Some(2));
        assert_eq!(too_deep(&"b: [{c: [1]}] # [[[[\n".repeat(1000)), None);
    }
}
