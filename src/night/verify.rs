//! Validity of a published night: its bytes, its artefacts, and its input, configuration and code.

use std::collections::BTreeSet;

use super::NONE_PUBLISHED;
use super::campaign_lineage::campaign_lineage;
use super::damaged_artefacts::{damaged_artefacts, fetch_records};
use super::published_tables::{publish_problems, publish_tables};
use super::table_metadata::read_lineage;
use crate::config::Config;
use crate::error::{Error, ProblemStage, Result};
use crate::lineage::Lineage;
use crate::pipeline::{Conductor, Progress};
use crate::store::{ArtefactName, Digest, Night, Nights, files};

/// Finding about one published file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileFinding {
    pub file: String,
    /// Reasons that the file is not valid; empty for a valid one.
    pub reasons: Vec<String>,
}

/// Findings about a night.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verified {
    pub night: String,
    pub files: Vec<FileFinding>,
    /// Artefacts that are damaged or lost. The tables made of them are still valid; the next run
    /// makes them again.
    pub artefacts: Vec<ArtefactName>,
}

impl Verified {
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.artefacts.is_empty() && self.files.iter().all(|f| f.reasons.is_empty())
    }
}

/// Digests all input anew. Compares input, configuration and code with the lineage stored in the
/// files of a night. If they agree, the tables are made again from the artefacts and compared. The
/// night is the one named, by default the current one; with `tables` only files of these names are
/// compared.
///
/// # Errors
/// No night, no archive, or a table that the night does not have.
pub fn verify(
    config: &Config,
    night: Option<&str>,
    tables: &[String],
    progress: &dyn Progress,
) -> Result<Verified> {
    let nights = Nights::read_only(&config.reports);
    let night = find_night(config, &nights, night)?;
    let conductor = Conductor::read_only_digesting_all(config, progress)?;
    if let Some(unknown) = tables
        .iter()
        .find(|t| !night.files.keys().any(|f| is_of(f, t)))
    {
        let what = format!("there is no table `{unknown}`");
        return Err(Error::not_found(&nights.folder(&night.name), what));
    }
    let lineage = campaign_lineage(&conductor);
    fetch_records(&conductor.runner.store, &night);
    let store = &conductor.runner.store;
    let artefacts = damaged_artefacts(store, &conductor.runner.contents, &night);
    let other_rows = if artefacts.is_empty() && lineage == night.lineage {
        tables_with_other_rows(&conductor, &night, &lineage)?
    } else {
        BTreeSet::new()
    };
    let comparison = FileComparison {
        lineage,
        damaged: nights.damaged(&night),
        replaced: nights.replaced(&night),
        other_rows,
        nights: &nights,
        night: &night,
    };
    let is_wanted = |file: &&String| tables.is_empty() || tables.iter().any(|t| is_of(file, t));
    let files = night.files.keys().filter(is_wanted);
    Ok(Verified {
        files: files.map(|file| comparison.finding(file)).collect(),
        artefacts,
        night: night.name.clone(),
    })
}

/// Makes the tables of a night again from the artefacts of the store, and returns the files that have
/// other bytes.
fn tables_with_other_rows(
    conductor: &Conductor,
    night: &Night,
    lineage: &Lineage,
) -> Result<BTreeSet<String>> {
    let campaign = conductor.campaign(night.until)?;
    if !conductor.runner.missing().is_empty() {
        return Ok(BTreeSet::new());
    }
    let scratch = files::scratch_folder()?;
    publish_tables(&campaign, night.until, scratch.path(), lineage)?;
    publish_problems(&campaign, night.until, scratch.path(), lineage)?;
    // A report that could not be printed is a problem of that run; places are of that archive.
    let archive = &conductor.runner.config.archive;
    let of_report = |p: &crate::error::Problem| p.stage == ProblemStage::Report;
    let has_other_problems =
        night.summary.problems.iter().any(of_report) || night.shown.get("archive") != Some(archive);
    let is_other = |(file, digest): &(&String, &Digest)| {
        let made = scratch.path().join(file);
        let is_table = files::is_file(&made) && !(has_other_problems && is_of(file, "problems"));
        is_table && Digest::of_file(&made).map_or(true, |made| made != **digest)
    };
    let other = night.files.iter().filter(is_other);
    Ok(other.map(|(file, _)| file.clone()).collect())
}

fn find_night(config: &Config, nights: &Nights, name: Option<&str>) -> Result<Night> {
    let night = match name {
        Some(name) => nights.named(name),
        None => nights.current(),
    };
    night.ok_or_else(|| {
        let damaged = nights.damaged_current().filter(|_| name.is_none());
        let names = nights.names();
        let what = match damaged {
            Some(name) => super::damaged(&name),
            None if names.is_empty() => NONE_PUBLISHED.to_owned(),
            None => format!(
                "there is no such night here; there are {}",
                names.join(", ")
            ),
        };
        Error::not_found(&config.reports, what)
    })
}

/// `true` for a file of a table: `trends` and `trends.csv` both name `trends.csv`.
fn is_of(file: &str, table: &str) -> bool {
    file == table || file.split('.').next() == Some(table)
}

/// Comparison of a night's files with today's lineage.
struct FileComparison<'a> {
    lineage: Lineage,
    /// Files whose bytes changed since they were published.
    damaged: Vec<String>,
    /// Files in whose place another file stands in the folder of reports.
    replaced: Vec<String>,
    /// Tables whose published rows differ from the rows computed from the artefacts.
    other_rows: BTreeSet<String>,
    nights: &'a Nights,
    night: &'a Night,
}

impl FileComparison<'_> {
    fn finding(&self, file: &str) -> FileFinding {
        let is_among = |files: &[String]| files.iter().any(|name| name == file);
        let reasons = if is_among(&self.damaged) {
            vec!["its bytes are not those that were published".to_owned()]
        } else if is_among(&self.replaced) {
            vec!["another file, or none, stands in its place in the folder of reports".to_owned()]
        } else if self.other_rows.contains(file) {
            vec!["the artefacts of the store make other rows of it".to_owned()]
        } else {
            self.differences(file)
        };
        FileFinding {
            file: file.to_owned(),
            reasons,
        }
    }

    /// Differences from the lineage of a file. A CSV has the lineage of the Parquet table beside
    /// it, the report the lineage of the night.
    fn differences(&self, file: &str) -> Vec<String> {
        let path = self.nights.folder(&self.night.name).join(file);
        let table = path.with_extension("parquet");
        let stated = if files::is_file(&table) {
            read_lineage(&table)
        } else {
            Ok((self.night.until, self.night.lineage.clone()))
        };
        match stated {
            Ok((stage, lineage)) => {
                let now = self.lineage.until(stage);
                let causes = now.differences(&lineage.until(stage));
                causes.into_iter().map(|cause| cause.words).collect()
            }
            Err(error) => vec![error.to_string()],
        }
    }
}
