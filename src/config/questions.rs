//! Open questions in the files of a pipeline: values that a draft left open, and comments that mark
//! a finding as unsure.

use super::checked::Config;
use super::source::Files;
use super::source::without_comment;
use crate::error::{Error, Result};
use crate::inspection::draft::{OPEN, UNSURE};

/// A line of a file that the analyst must look at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Name of the file within the pipeline's folder.
    pub file: String,
    /// Number of the line, from 1.
    pub line: usize,
    pub text: String,
}

/// Refuses files with open questions, and lists them all.
///
/// # Errors
/// [`Error::Config`] at the first open question.
pub(super) fn none_open(files: &Files) -> Result<()> {
    let mut open = Vec::new();
    for source in files.all() {
        for (line, text) in (1..).zip(source.lines()) {
            let is_open = without_comment(text).contains(OPEN);
            if is_open {
                open.push((&source.path, line, text));
            }
        }
    }
    let Some((first, further)) = open.split_first() else {
        return Ok(());
    };
    let (path, line, text) = first;
    let lines = further.iter().map(|(path, line, text)| {
        let question = Error::config(path, Some(*line), text.trim());
        format!("\n{question}")
    });
    let count = open.len();
    let what = format!(
        "{}{}\n{count} lines have values to give: each {OPEN} stands for one, and its comment states where it matters",
        text.trim(),
        lines.collect::<String>()
    );
    Err(Error::config(path, Some(*line), what))
}

/// Lines whose comments mark a finding of the draft as unsure.
#[must_use]
pub fn doubts(config: &Config) -> Vec<Note> {
    let mut doubts = Vec::new();
    for (file, text) in &config.files {
        for (line, text) in (1..).zip(text.lines()) {
            let content = without_comment(text);
            let (_, comment) = text.split_at(content.len());
            let doubt = comment.trim_start_matches([' ', '#']).strip_prefix(UNSURE);
            if let Some(doubt) = doubt.filter(|_| !content.trim().is_empty()) {
                let text = format!("{}: {}", content.trim(), doubt.trim());
                let file = file.clone();
                doubts.push(Note { file, line, text });
            }
        }
    }
    doubts
}
