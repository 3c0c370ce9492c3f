//! Whether what is published still holds: its bytes, what it is made of, and what it was made from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::publish::stated;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::lineage::{Lineage, Stage};
use crate::pipeline::{Progress, Run};
use crate::store::{Contents, Digest, Night, Nights, Store, archive};

/// What is said of one published file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    pub file: String,
    /// Why it does not hold; empty where it does.
    pub reasons: Vec<String>,
}

/// What is said of a night.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verified {
    pub night: String,
    pub files: Vec<Finding>,
    /// Artefacts that are damaged or gone. What was made of them still holds; the next run makes
    /// them again.
    pub artefacts: Vec<String>,
}

impl Verified {
    #[must_use]
    pub fn holds(&self) -> bool {
        self.artefacts.is_empty() && self.files.iter().all(|f| f.reasons.is_empty())
    }
}

/// Takes the fingerprints of all input anew, trusting none that was remembered, and holds them, the
/// configuration and the code against what the files of a night state: that of the name `night`,
/// unless given the one that holds. With `tables`, only of files of these names.
///
/// # Errors
/// No night, no archive, or a table without a name among the files.
pub fn verify(
    config: &Config,
    night: Option<&str>,
    tables: &[String],
    progress: &dyn Progress,
) -> Result<Verified> {
    let nights = Nights::look(&config.reports);
    let night = match night {
        Some(name) => nights
            .night(name)
            .or_else(|| nights.night(&format!("{name:0>4}"))),
        None => nights.current(),
    };
    let night = night.ok_or_else(|| {
        Error::not_found(
            &config.reports,
            format!(
                "there is no such night here; there are {}",
                nights.names().join(", ")
            ),
        )
    })?;
    let files = archive::find(&config.archive)?;
    let store = Store::look(&config.store).sharing(config.shared_store.as_deref())?;
    let run = Run::new(config, store, Contents::forgetful(), &files, progress)?;
    let damaged = nights.damaged(&night);
    let stem = |file: &str| file.split('.').next().unwrap_or_default().to_owned();
    if let Some(unknown) = tables
        .iter()
        .find(|t| !night.files.keys().any(|f| stem(f) == **t || f == *t))
    {
        return Err(Error::not_found(
            &nights.folder(&night.name),
            format!("there is no table `{unknown}`"),
        ));
    }
    let asked =
        |file: &&String| tables.is_empty() || tables.iter().any(|t| stem(file) == *t || *file == t);
    let finding = |file: &String| {
        let mut reasons = Vec::new();
        if damaged.contains(file) {
            reasons.push("its bytes are not those that were published".to_owned());
        } else {
            let path = nights.folder(&night.name).join(file);
            // A CSV and the report state nothing themselves: what the table beside, or the night,
            // states holds for them.
            let beside = path.with_extension("parquet");
            let of_the_night = (night.until, night.lineage.clone());
            let stated = if beside.is_file() {
                stated(&beside)
            } else {
                Ok(of_the_night)
            };
            match stated {
                Ok((stage, lineage)) => reasons.extend(differences(&run.lineage, &lineage, stage)),
                Err(error) => reasons.push(error.to_string()),
            }
        }
        Finding {
            file: file.clone(),
            reasons,
        }
    };
    Ok(Verified {
        files: night.files.keys().filter(asked).map(finding).collect(),
        artefacts: run.damaged(&night),
        night: night.name,
    })
}

impl Run<'_> {
    /// The artefacts of a night that are not as they were written; a record is held against its
    /// flight's artefact.
    fn damaged(&self, night: &Night) -> Vec<String> {
        let records: BTreeMap<PathBuf, Digest> = night
            .artefacts
            .keys()
            .flat_map(|name| self.recorded(name))
            .collect();
        let is_whole = |name: &String| {
            if !name.starts_with("records/") {
                return self.store.is_whole(name);
            }
            let path = self.store.folder().join(name);
            let fetched = |digest: &Digest| self.store.fetch(&path, Some(digest)).is_ok();
            let holds = |digest: &Digest| {
                fetched(digest) && Digest::of_file(&path).is_ok_and(|f| f == *digest)
            };
            records.get(Path::new(name)).is_some_and(holds)
        };
        night
            .artefacts
            .par_iter()
            .map(|(name, _)| name)
            .filter(|name| !is_whole(name))
            .cloned()
            .collect()
    }
}

/// What is no longer as a table of a stage states.
fn differences(now: &Lineage, stated: &Lineage, stage: Stage) -> Vec<String> {
    now.until(stage)
        .differences(&stated.until(stage))
        .into_iter()
        .map(|cause| cause.words)
        .collect()
}
