//! Housekeeping: artefacts that no published night is made of, and nights beyond those that stay.
//! Of a store in an object store only the cache is kept house in: what other machines have
//! published is not known here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

use crate::config::Config;
use crate::error::{Error, Result};
use crate::store::{Night, Nights, Store};

/// What is, or would be, removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Litter {
    /// Artefacts with their sizes, relative to the store.
    pub artefacts: BTreeMap<String, u64>,
    pub nights: Vec<String>,
    /// Artefacts that stay.
    pub kept: usize,
}

/// Finds what no published night needs, and removes it where `remove` says so. The store may serve
/// several folders of reports; the nights of all of them count.
///
/// # Errors
/// A store in use; reports that cannot be found or a night whose manifest cannot be read, for what
/// they need is unknown; a disk that says no.
pub fn gc(config: &Config, remove: bool, wait: Duration) -> Result<Litter> {
    let store = Store::open(&config.store, wait)?;
    let keep = config.report.keep_nights;
    let own = config.reports.canonicalize().ok();
    let served: BTreeSet<PathBuf> = store.served().into_iter().chain(own.clone()).collect();
    if let Some(away) = served.iter().find(|reports| !reports.is_dir()) {
        // A disk that is not mounted today holds nights all the same.
        let what = format!(
            "the reports in {} are made of this store and cannot be found, so what they need is unknown: nothing is \
             removed; if they are gone for good, take them out of serves.json",
            away.display()
        );
        return Err(Error::store(&config.store, &what));
    }
    let open = |reports: &PathBuf| {
        if remove {
            Nights::open(reports, wait)
        } else {
            Ok(Nights::look(reports))
        }
    };
    let opened: Vec<(&PathBuf, Nights)> = served
        .iter()
        .map(|r| Ok((r, open(r)?)))
        .collect::<Result<_>>()?;
    let mut litter = Litter::default();
    let mut needed: BTreeMap<String, u64> = BTreeMap::new();
    for (reports, nights) in &opened {
        let superfluous = if own.as_ref() == Some(*reports) {
            nights.superfluous(keep)
        } else {
            Vec::new()
        };
        for name in nights
            .names()
            .iter()
            .filter(|name| !superfluous.contains(name))
        {
            needed.extend(manifest(nights, name)?.artefacts);
        }
        litter.nights.extend(superfluous);
    }
    let artefacts = store.artefacts();
    litter.kept = artefacts
        .keys()
        .filter(|name| needed.contains_key(*name))
        .count();
    litter.artefacts = artefacts
        .into_iter()
        .filter(|(name, _)| !needed.contains_key(name))
        .collect();
    if remove {
        // Nights first: one without its artefacts would be made of nothing.
        for (_, nights) in opened
            .iter()
            .filter(|(reports, _)| own.as_ref() == Some(*reports))
        {
            nights.prune(keep)?;
        }
        litter
            .artefacts
            .keys()
            .try_for_each(|name| store.remove(name))?;
    }
    Ok(litter)
}

fn manifest(nights: &Nights, name: &str) -> Result<Night> {
    nights.night(name).ok_or_else(|| {
        let what = "its manifest night.json cannot be read, so what it needs is unknown: nothing is removed; where the \
                    night is not worth keeping, remove its folder";
        Error::damaged(&nights.folder(name), &what)
    })
}
