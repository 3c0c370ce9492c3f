//! What can go wrong, said so that the reader knows where it is and what to do.

use std::path::{Path, PathBuf};

use crate::schema::table;

/// An error that stops the whole run (exit code 1). What spoils one flight or one maneuver is data:
/// a [`Problem`].
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The analyst's configuration is wrong: file, line where known, what, and what was probably
    /// meant.
    #[error("{}{}: {what}", file.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Config {
        file: PathBuf,
        line: Option<usize>,
        what: String,
    },
    /// The archive as a whole cannot be used.
    #[error("{}: {what}", place.display())]
    Archive { place: PathBuf, what: String },
    /// The disk said no.
    #[error("{}: {what}: {cause}", path.display())]
    Io {
        path: PathBuf,
        what: &'static str,
        cause: std::io::Error,
    },
    /// An artefact could not be written or read back.
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
    pub fn store(path: &Path, what: &impl ToString) -> Error {
        Error::Store {
            path: path.to_owned(),
            what: what.to_string(),
        }
    }

    /// Whether the same may go well another time: a disk or a file server that says no, a store in
    /// use.
    #[must_use]
    pub fn is_passing(&self) -> bool {
        matches!(self, Error::Io { .. } | Error::Store { .. })
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
    /// With any row in this table `harvest` exits with 2.
    pub struct Problem in "problems" per "thing that was rejected or could not be made" {
        /// Stage that found the problem.
        pub stage: String,
        /// Flight, or stretch of a flight; empty where it is none.
        pub flight_id: String,
        /// File, channel, time, maneuver or derivative.
        pub place: String,
        /// Cause and, where known, remedy.
        pub reason: String,
    }
}

/// The name of `known` that `given` was probably meant to be, as a phrase to append to an error.
#[must_use]
pub fn did_you_mean<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = known
        .into_iter()
        .map(|name| {
            (
                strsim::jaro_winkler(&given.to_lowercase(), &name.to_lowercase()),
                name,
            )
        })
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match near {
        Some((score, name)) if score > 0.7 => format!("; did you mean `{name}`?"),
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
    fn a_typo_is_answered_with_the_nearest_name() {
        assert_eq!(
            did_you_mean("CN_alhpa", ["CN_0", "CN_alpha", "Cm_q"]),
            "; did you mean `CN_alpha`?"
        );
        assert_eq!(did_you_mean("xyz", ["CN_0"]), "");
    }
}
