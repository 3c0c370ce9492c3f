//! Validity of a published night: its bytes, its artefacts, and its input, configuration and code.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::campaign_lineage::campaign_lineage;
use super::table_metadata::read_lineage;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::lineage::Lineage;
use crate::pipeline::{Conductor, IngestedFlight, Progress};
use crate::store::{ArtefactName, Digest, Kind, Night, Nights, Store, files};

/// Finding about one published file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    pub file: String,
    /// Reasons that the file is not valid; empty for a valid one.
    pub reasons: Vec<String>,
}

/// Findings about a night.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verified {
    pub night: String,
    pub files: Vec<Finding>,
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

/// Digests all input anew and compares it, the configuration and the code with the lineage that the
/// files of a night state. The night is the one named, by default the current one; with `tables`
/// only files of these names are compared.
///
/// # Errors
/// No night, no archive, or a table that the night does not have.
pub fn verify(
    config: &Config,
    night: Option<&str>,
    tables: &[String],
    progress: &dyn Progress,
) -> Result<Verified> {
    let nights = Nights::look(&config.reports);
    let night = find_night(config, &nights, night)?;
    let conductor = Conductor::look_at_every_byte(config, progress)?;
    if let Some(unknown) = tables
        .iter()
        .find(|t| !night.files.keys().any(|f| is_of(f, t)))
    {
        let what = format!("there is no table `{unknown}`");
        return Err(Error::not_found(&nights.folder(&night.name), what));
    }
    let comparison = Comparison {
        lineage: campaign_lineage(&conductor),
        damaged: nights.damaged(&night),
        nights: &nights,
        night: &night,
    };
    let is_wanted = |file: &&String| tables.is_empty() || tables.iter().any(|t| is_of(file, t));
    let files = night.files.keys().filter(is_wanted);
    Ok(Verified {
        files: files.map(|file| comparison.finding(file)).collect(),
        artefacts: damaged_artefacts(&conductor.runner.store, &night),
        night: night.name.clone(),
    })
}

fn find_night(config: &Config, nights: &Nights, name: Option<&str>) -> Result<Night> {
    let night = match name {
        Some(name) => nights.named(name),
        None => nights.current(),
    };
    night.ok_or_else(|| {
        let what = format!(
            "there is no such night here; there are {}",
            nights.names().join(", ")
        );
        Error::not_found(&config.reports, what)
    })
}

/// `true` for a file of a table: `trends` and `trends.csv` both name `trends.csv`.
fn is_of(file: &str, table: &str) -> bool {
    file == table || file.split('.').next() == Some(table)
}

/// Comparison of a night's files with today's lineage.
struct Comparison<'a> {
    lineage: Lineage,
    /// Files whose bytes changed since they were published.
    damaged: Vec<String>,
    nights: &'a Nights,
    night: &'a Night,
}

impl Comparison<'_> {
    fn finding(&self, file: &str) -> Finding {
        let reasons = if self.damaged.iter().any(|damaged| damaged == file) {
            vec!["its bytes are not those that were published".to_owned()]
        } else {
            self.differences(file)
        };
        Finding {
            file: file.to_owned(),
            reasons,
        }
    }

    /// Differences from the lineage of a file. A CSV has that of the Parquet table beside it, the
    /// report that of the night.
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

/// Artefacts of a night that are not as they were written. A record has no seal: its digest is in
/// its flight's artefact.
fn damaged_artefacts(store: &Store, night: &Night) -> Vec<ArtefactName> {
    let flights = night.artefacts.keys().filter(|a| a.is_of(Kind::Ingest));
    let flights = flights.filter_map(|name| store.load::<IngestedFlight>(name));
    let records: BTreeMap<ArtefactName, Digest> = flights
        .flat_map(|flight| flight.records().cloned().collect::<Vec<_>>())
        .map(|record| (record.name, record.digest))
        .collect();
    let has_record = |name: &ArtefactName, digest: &Digest| {
        store.fetch(name, digest).is_ok()
            && Digest::of_file(&store.path(name)).is_ok_and(|found| found == *digest)
    };
    let is_whole = |name: &ArtefactName| {
        if name.is_of(Kind::Records) {
            let digest = records.get(name);
            digest.is_some_and(|digest| has_record(name, digest))
        } else {
            store.has_sealed(name)
        }
    };
    let names: Vec<&ArtefactName> = night.artefacts.keys().collect();
    names
        .into_par_iter()
        .filter(|name| !is_whole(name))
        .cloned()
        .collect()
}
