//! Contents of a draft, and the form of texts in YAML.

use crate::inspection::controls::inputs::{ControlAxis, InputColumn};
use crate::inspection::findings::{Channel, Inspection, Role};

/// Word in place of a value that the analyst must give. The configuration lists all of them.
pub const OPEN: &str = "FILL_IN";

/// Beginning of a comment on a finding that is not sure. `harvest check` lists these comments.
pub const UNSURE: &str = "unsure:";

/// Name, archive and findings from which a draft is made.
#[derive(Clone, Copy, Debug)]
pub struct Draft<'a> {
    /// Name of the pipeline.
    pub name: &'a str,
    /// Archive as `pipeline.yaml` names it.
    pub archive: &'a str,
    pub inspection: &'a Inspection,
}

/// A file of the draft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DraftFile {
    /// Path within the pipeline's folder.
    pub path: String,
    pub text: String,
}

impl Draft<'_> {
    /// Inputs that move, with their channels.
    pub fn inputs(&self) -> impl Iterator<Item = (&Channel, &InputColumn)> {
        let channels = self.inspection.channels.iter().filter(|c| c.moves);
        channels.filter_map(|channel| match &channel.role {
            Role::Input(input) => Some((channel, input)),
            _ => None,
        })
    }

    /// Surfaces that move and act on the longitudinal or on the lateral axis.
    #[must_use]
    pub fn surfaces(&self, is_longitudinal: bool) -> Vec<(&Channel, &InputColumn)> {
        let of_axis = |axis: ControlAxis| (axis == ControlAxis::Pitch) == is_longitudinal;
        let inputs = self.inputs();
        inputs
            .filter(|(_, input)| input.kind.is_surface() && of_axis(input.axis))
            .collect()
    }

    #[must_use]
    pub fn has(&self, signal: &str) -> bool {
        self.inspection.channels.iter().any(|c| c.signal == signal)
    }
}

/// Name of a signal without its unit, as it stands in the names of derivatives.
pub fn short(signal: &str) -> &str {
    let unit = crate::units::Unit::of_signal(signal);
    unit.suffix
        .and_then(|suffix| signal.strip_suffix(suffix))
        .unwrap_or(signal)
}

/// A text as a YAML scalar: plain where that is safe, otherwise in quotes.
pub fn scalar(text: &str) -> String {
    let is_plain = text
        .chars()
        .all(|c| c.is_ascii_alphanumeric() || "_/. ".contains(c));
    let begins_plain = text.starts_with(|c: char| c.is_ascii_alphabetic());
    let is_word = ["y", "n", "yes", "no", "on", "off", "true", "false", "null"]
        .contains(&text.to_lowercase().as_str());
    if is_plain && begins_plain && !is_word && !text.ends_with(' ') {
        return text.to_owned();
    }
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"");
    let visible = |c: char| if c.is_control() { ' ' } else { c };
    format!("\"{}\"", escaped.chars().map(visible).collect::<String>())
}

/// A text for a comment: one line.
pub fn comment(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
