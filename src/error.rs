//! Errors, by kind, and problems, which are data.

use std::path::{Path, PathBuf};

use crate::schema::{table, words};

/// An error that stops the whole run (exit code 1). A fault of one flight or maneuver is a
/// [`Problem`].
///
/// Each message names the place, the cause and, where known, the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The analyst's configuration is wrong: file, line where known, and what was probably meant.
    #[error("{}{}: {what}", file.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Config {
        file: PathBuf,
        line: Option<usize>,
        what: String,
    },
    /// The archive as a whole, or a place in an object store, cannot be used.
    #[error("{}: {what}", place.display())]
    Archive { place: PathBuf, what: String },
    /// A flight, maneuver, night, table or object that was asked for does not exist.
    #[error("{}: {what}", place.display())]
    NotFound { place: PathBuf, what: String },
    /// Another run holds the lock of the store or of the reports.
    #[error("{}: {what}", path.display())]
    Busy { path: PathBuf, what: String },
    /// The disk or file server returned an error.
    #[error("{}: {what}: {cause}", path.display())]
    Io {
        path: PathBuf,
        what: &'static str,
        cause: std::io::Error,
    },
    /// The object store did not answer, or an object was replaced meanwhile.
    #[error("{}: {what}", place.display())]
    Unavailable { place: PathBuf, what: String },
    /// A file of the store or of a night differs from what was written.
    #[error("{}: {what}", path.display())]
    Damaged { path: PathBuf, what: String },
    /// An artefact or a published file could not be made.
    #[error("{}: {what}", path.display())]
    Store { path: PathBuf, what: String },
}

pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    #[must_use]
    pub fn config(file: &Path, line: Option<usize>, what: impl Into<String>) -> Error {
        Error::Config {
            file: file.to_owned(),
            line,
            what: what.into(),
        }
    }

    #[must_use]
    pub fn not_found(place: &Path, what: impl Into<String>) -> Error {
        Error::NotFound {
            place: place.to_owned(),
            what: what.into(),
        }
    }

    #[must_use]
    pub fn damaged(path: &Path, what: &impl ToString) -> Error {
        Error::Damaged {
            path: path.to_owned(),
            what: what.to_string(),
        }
    }

    #[must_use]
    pub fn store(path: &Path, what: &impl ToString) -> Error {
        Error::Store {
            path: path.to_owned(),
            what: what.to_string(),
        }
    }

    /// `true` if a repetition may succeed without a change by the analyst.
    #[must_use]
    pub fn is_transient(&self) -> bool {
        match self {
            Error::Busy { .. }
            | Error::Io { .. }
            | Error::Unavailable { .. }
            | Error::Damaged { .. }
            | Error::Store { .. } => true,
            Error::Config { .. } | Error::Archive { .. } | Error::NotFound { .. } => false,
        }
    }

    /// For `map_err` on a disk operation: `.map_err(Error::io(path, "cannot create the folder"))`.
    pub fn io(path: &Path, what: &'static str) -> impl FnOnce(std::io::Error) -> Error {
        let path = path.to_owned();
        move |cause| Error::Io { path, what, cause }
    }
}

table! {
    /// Everything that was rejected or could not be made, while the rest of the campaign went on.
    ///
    /// `harvest` exits with 2 if a row has a stage other than `recording` and `trend`. These two
    /// are no rejections: a signal that the recording lacks, and a derivative with too few
    /// maneuvers for a trend. A flight or maneuver that is rejected for want of a signal has a row
    /// of its own.
    pub struct Problem in "problems" per "thing that was rejected or could not be made" {
        /// Stage that found the problem; `recording` for an absence in the recording.
        pub stage: ProblemStage,
        /// Flight, or stretch of a flight; empty where it is none.
        pub flight_id: String,
        /// File, channel, time, maneuver or derivative.
        pub place: String,
        /// Cause and, where known, remedy.
        pub reason: String,
    }
}

words! {
    /// Stage that found a problem.
    pub enum ProblemStage {
        /// Signals that a recording lacks, with their stand-ins and the cost; nothing is rejected.
        Recording = "recording",
        /// Flights to records.
        Ingest = "ingest",
        /// Records to maneuvers.
        Segment = "segment",
        /// Maneuvers to derivatives.
        Estimate = "estimate",
        /// Derivatives to trends.
        Trend = "trend",
        /// Tunnel and derivatives to the posterior.
        Model = "model",
        /// Posterior to the modes of the aircraft and their levels.
        Qualities = "qualities",
        /// The report.
        Report = "report",
        /// The simulator; not in the table `problems`.
        Simulate = "simulate",
    }
}

impl ProblemStage {
    /// `true` for a stage whose problems are rejections, or results that could not be made.
    #[must_use]
    pub fn is_rejection(self) -> bool {
        !matches!(self, ProblemStage::Recording | ProblemStage::Trend)
    }
}

/// Longest text that is compared as a name, bytes. The time of a comparison grows with the product
/// of the lengths, and a damaged file may have names of megabytes.
const LONGEST_NAME: usize = 200;

/// Similarity of two names from 0 to 1, ignoring case (Jaro and Winkler).
#[must_use]
pub fn similarity(a: &str, b: &str) -> f64 {
    if a.len().max(b.len()) > LONGEST_NAME {
        return 0.0;
    }
    strsim::jaro_winkler(&a.to_lowercase(), &b.to_lowercase())
}

/// Similarity, from 0 to 1, from which a name is suggested: a name of five letters with two other letters
/// reaches it.
const SUGGESTED: f64 = 0.7;

/// A phrase to append to an error: the name among `known` nearest to `given`; empty if none is
/// similar.
#[must_use]
pub fn did_you_mean<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = known
        .into_iter()
        .map(|name| (similarity(given, name), name))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match near {
        Some((score, name)) if score > SUGGESTED => format!("; did you mean `{name}`?"),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_file_and_line() {
        let e = Error::config(
            Path::new("pipelines/harv/model.yaml"),
            Some(12),
            "unknown regressor `dx`",
        );
        assert_eq!(
            e.to_string(),
            "pipelines/harv/model.yaml:12: unknown regressor `dx`"
        );
    }

    #[test]
    fn absences_and_trends_of_few_maneuvers_are_no_rejections() {
        let others = ProblemStage::ALL.into_iter().filter(|s| !s.is_rejection());
        let others: Vec<ProblemStage> = others.collect();
        assert_eq!(others, [ProblemStage::Recording, ProblemStage::Trend]);
    }

    #[test]
    fn a_typo_is_answered_with_the_nearest_name() {
        assert_eq!(
            did_you_mean("CN_alhpa", ["CN_0", "CN_alpha", "Cm_q"]),
            "; did you mean `CN_alpha`?"
        );
        assert_eq!(did_you_mean("xyz", ["CN_0"]), "");
        let long = format!("CN_0{}", "x".repeat(LONGEST_NAME));
        assert!(similarity("CN_0", "CN_0x") > 0.9);
        assert!(similarity("CN_0", &long) <= 0.0, "no name is that long");
    }
}
