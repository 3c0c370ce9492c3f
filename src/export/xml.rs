//! Writer of XML: indented elements, escaped text.

use std::fmt::Write;

/// A document being written.
#[derive(Debug, Default)]
pub(super) struct Xml {
    text: String,
    open: Vec<&'static str>,
}

/// Escapes text for an element or an attribute.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn with(attributes: &[(&str, &str)]) -> String {
    let one = |(name, value): &(&str, &str)| [" ", name, "=\"", &escaped(value), "\""].concat();
    attributes.iter().map(one).collect()
}

impl Xml {
    pub(super) fn new(declaration: &str) -> Xml {
        Xml {
            text: format!("{declaration}\n"),
            open: Vec::new(),
        }
    }

    fn line(&mut self, line: &str) {
        // Writing into a String cannot fail.
        let _ = writeln!(
            self.text,
            "{:indent$}{line}",
            "",
            indent = 2 * self.open.len()
        );
    }

    pub(super) fn open(&mut self, name: &'static str, attributes: &[(&str, &str)]) {
        self.line(&format!("<{name}{}>", with(attributes)));
        self.open.push(name);
    }

    pub(super) fn close(&mut self) {
        if let Some(name) = self.open.pop() {
            self.line(&format!("</{name}>"));
        }
    }

    pub(super) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.line(&format!("<{name}{}/>", with(attributes)));
    }

    pub(super) fn text(&mut self, name: &str, attributes: &[(&str, &str)], text: &str) {
        self.line(&format!(
            "<{name}{}>{}</{name}>",
            with(attributes),
            escaped(text)
        ));
    }

    /// Writes an element whose text is lines of numbers.
    pub(super) fn block(
        &mut self,
        name: &'static str,
        attributes: &[(&str, &str)],
        lines: &[String],
    ) {
        self.open(name, attributes);
        for line in lines {
            self.line(line);
        }
        self.close();
    }

    pub(super) fn finish(self) -> String {
        self.text
    }
}
