//! Files of a pipeline: text, parser with file and line of each error, search for the line of a name.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::written::{AircraftFile, ClassFile, ModelFile};
use super::yaml_bounds;
use crate::aero::AeroModel;
use crate::error::{Error, Result, did_you_mean};
use crate::maneuver::Class;
use crate::proof_of_match;
use crate::qualities::Specification;
use crate::store::files;

/// One file and its text.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub path: PathBuf,
    text: String,
}

/// The files of a pipeline.
#[derive(Clone, Debug)]
pub(super) struct Files {
    pub pipeline: Source,
    pub aircraft: Source,
    pub model: Source,
    pub classes: Vec<Source>,
    /// Flying qualities, where the pipeline has a specification.
    pub qualities: Option<Source>,
    /// Proof of match, where the pipeline has tolerances.
    pub proof_of_match: Option<Source>,
}

impl Source {
    pub fn read(path: PathBuf) -> Result<Source> {
        let text = files::text(&path)?;
        let source = Source { path, text };
        match yaml_bounds::excess(&source.text) {
            Some((line, what)) => Err(Error::config(&source.path, line, what)),
            None => Ok(source),
        }
    }

    /// Reads a file that may be absent.
    fn optional(path: PathBuf) -> Result<Option<Source>> {
        let is_file = files::is_file(&path);
        is_file.then(|| Source::read(path)).transpose()
    }

    #[cfg(test)]
    pub fn of(path: &str, text: &str) -> Source {
        Source {
            path: path.into(),
            text: text.to_owned(),
        }
    }

    /// Name of the file within a pipeline's folder, and its text.
    pub fn named(&self, folder: &Path) -> (String, String) {
        let name = self
            .path
            .strip_prefix(folder)
            .unwrap_or(&self.path)
            .display();
        (name.to_string(), self.text.clone())
    }

    pub fn lines(&self) -> std::str::Lines<'_> {
        self.text.lines()
    }

    pub fn parse<T: DeserializeOwned>(&self) -> Result<T> {
        serde_yaml::from_str(&self.text).map_err(|e| {
            if self.is_empty() {
                return Error::config(&self.path, Some(1), "the file is empty");
            }
            let line = e.location().map(|l| l.line());
            Error::config(&self.path, line, message(&e.to_string()))
        })
    }

    /// An error about a name, at the first line that contains it as a whole word.
    pub fn error(&self, name: &str, what: impl Into<String>) -> Error {
        Error::config(&self.path, self.line_of(name, 0), what)
    }

    /// An error about a name in the section under a key; the same word may have another meaning
    /// elsewhere.
    pub fn error_under(&self, key: &str, name: &str, what: impl Into<String>) -> Error {
        let begins = |line: &str| {
            line.trim_start()
                .strip_prefix(key)
                .is_some_and(|rest| rest.starts_with(':'))
        };
        let section = self.text.lines().position(begins);
        let line = self
            .line_of(name, section.unwrap_or(0))
            .or(section.map(|i| i + 1));
        Error::config(&self.path, line, what)
    }

    /// An error about a key, given by its path from the outermost section inwards.
    pub fn error_at(&self, path: &[String], what: impl Into<String>) -> Error {
        let mut line = None;
        for name in path {
            line = self
                .line_of(name, line.map_or(0, |l: usize| l - 1))
                .or(line);
        }
        Error::config(&self.path, line, what)
    }

    /// An error about an entry of a list: the one that has the key for the `index`-th time, from zero,
    /// after the keys of `path`. Within the entry it names the line of a word.
    pub fn error_in_entry(
        &self,
        path: &[&str],
        (key, index): (&str, usize),
        name: &str,
        what: impl Into<String>,
    ) -> Error {
        let mut first = 0;
        for outer in path {
            first = self.line_of(outer, first).map_or(first, |line| line - 1);
        }
        let lines = self.text.lines().enumerate().skip(first);
        let mut entries =
            lines.flat_map(|(i, line)| std::iter::repeat_n(i, times_as_key(key, line)));
        let entry = entries.nth(index);
        let end = entries.find(|i| Some(*i) != entry);
        let named = entry.and_then(|entry| self.line_of(name, entry));
        let is_inside = |line: &usize| end.is_none_or(|end| *line <= end);
        let line = named.filter(is_inside).or(entry.map(|i| i + 1));
        Error::config(&self.path, line.or(Some(first + 1)), what)
    }

    /// `true` for a file of blank lines and comments.
    fn is_empty(&self) -> bool {
        let mut lines = self.text.lines();
        lines.all(|line| without_comment(line).trim().is_empty())
    }

    /// The first line from number `first` (from 0) on that holds a word, counted from 1.
    fn line_of(&self, name: &str, first: usize) -> Option<usize> {
        let word = |c: char| c.is_alphanumeric() || c == '_';
        let holds = |line: &str| without_comment(line).split(|c| !word(c)).any(|w| w == name);
        self.text
            .lines()
            .enumerate()
            .skip(first)
            .find(|(_, line)| holds(line))
            .map(|(i, _)| i + 1)
    }
}

/// Number of times that a line gives a key.
fn times_as_key(key: &str, line: &str) -> usize {
    let line = without_comment(line);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let places = line.match_indices(key);
    let given = places.filter(|(i, _)| {
        let starts = !line[..*i].ends_with(is_word);
        let rest = line[i + key.len()..].trim_start_matches('"').trim_start();
        starts && rest.starts_with(':')
    });
    given.count()
}

/// A line without its comment.
pub(super) fn without_comment(line: &str) -> &str {
    if line.trim_start().starts_with('#') {
        ""
    } else {
        line.split(" #").next().unwrap_or_default()
    }
}

/// Message of the parser without the place, with which the error begins. For an unknown key or word
/// it ends with a suggestion.
fn message(parser: &str) -> String {
    let what = parser
        .rsplit_once(" at line ")
        .map_or(parser, |(what, _)| what);
    for pair in ["a tuple of size 2", "sequence of 2 elements"] {
        if let Some((head, _)) = what.split_once(&format!(", expected {pair}")) {
            let (key, _) = head.split_once(": invalid ").unwrap_or((head, ""));
            return format!("{key} must be a list of two numbers, such as [10, 40]");
        }
    }
    let Some((head, expected)) = what
        .split_once(", expected ")
        .filter(|(head, _)| head.contains("unknown "))
    else {
        return what.to_owned();
    };
    let given = head.split('`').rev().nth(1).unwrap_or_default();
    format!(
        "{what}{}",
        did_you_mean(given, expected.split('`').skip(1).step_by(2))
    )
}

impl Files {
    /// All files, in the order in which they are explained.
    pub fn all(&self) -> impl Iterator<Item = &Source> {
        [&self.pipeline, &self.aircraft, &self.model]
            .into_iter()
            .chain(&self.classes)
            .chain(&self.qualities)
            .chain(&self.proof_of_match)
    }

    pub fn read(folder: &Path) -> Result<Files> {
        if !files::is_file(&folder.join("pipeline.yaml")) {
            let what = "no pipeline here: a pipeline is a folder with pipeline.yaml, aircraft.yaml, model.yaml and maneuvers/";
            return Err(Error::config(folder, None, what));
        }
        let maneuvers = folder.join("maneuvers");
        let classes = if files::is_folder(&maneuvers) {
            files::with_extension(&maneuvers, "yaml")?
        } else {
            Vec::new()
        };
        if classes.is_empty() {
            let what = "no maneuver class: each is a file `<class>.yaml` here, such as those of pipelines/navion; it names \
                        the surfaces or controls that step, which have a line in aircraft.yaml and in model.yaml";
            return Err(Error::config(&maneuvers, None, what));
        }
        Ok(Files {
            qualities: Source::optional(folder.join("qualities.yaml"))?,
            proof_of_match: Source::optional(folder.join("match.yaml"))?,
            pipeline: Source::read(folder.join("pipeline.yaml"))?,
            aircraft: Source::read(folder.join("aircraft.yaml"))?,
            model: Source::read(folder.join("model.yaml"))?,
            classes: classes
                .into_iter()
                .map(Source::read)
                .collect::<Result<_>>()?,
        })
    }

    pub fn aircraft(&self) -> Result<AircraftFile> {
        self.aircraft.parse()
    }

    pub fn model(&self) -> Result<AeroModel> {
        let file = self.model.parse::<ModelFile>()?;
        file.aero_model()
            .map_err(|(name, what)| self.model.error(&name, format!("{name}: {what}")))
    }

    pub fn qualities(&self) -> Result<Option<Specification>> {
        self.qualities.as_ref().map(Source::parse).transpose()
    }

    pub fn proof_of_match(&self) -> Result<Option<proof_of_match::Specification>> {
        self.proof_of_match.as_ref().map(Source::parse).transpose()
    }

    pub fn classes(&self) -> Result<Vec<Class>> {
        let mut classes = Vec::<Class>::new();
        for source in &self.classes {
            let file: ClassFile = source.parse()?;
            let own = [&file.estimated, &file.held, &file.inactive];
            let overrides = file
                .overrides
                .iter()
                .map(|o| [&o.estimated, &o.held, &o.inactive]);
            for lists in std::iter::once(own).chain(overrides) {
                let mut names: Vec<&String> = lists.into_iter().flatten().collect();
                names.sort();
                if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
                    let name = twice[0];
                    return Err(source.error(
                        name,
                        format!("`{name}` stands twice among estimated, held and inactive"),
                    ));
                }
            }
            let class = Class::from(file);
            if classes.iter().any(|c| c.name == class.name) {
                return Err(source.error(
                    &class.name,
                    format!("class `{}` is defined twice", class.name),
                ));
            }
            classes.push(class);
        }
        Ok(classes)
    }
}
