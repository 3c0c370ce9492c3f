//! Housekeeping: artefacts that no published night is made of, and nights beyond those that stay.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::config::Config;
use crate::error::{Error, Result};
use crate::store::{Nights, Store};

/// What is, or would be, removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Litter {
    /// Artefacts with their sizes, relative to the store.
    pub artefacts: BTreeMap<String, u64>,
    pub nights: Vec<String>,
    /// Artefacts that stay.
    pub kept: usize,
}

/// Finds what no published night needs, and removes it where `remove` says so. The store may serve several folders of
/// reports; the nights of all of them count.
///
/// # Errors
/// A store in use; a night whose manifest cannot be read, for what it needs is unknown; a disk that says no.
pub fn gc(config: &Config, remove: bool, wait: Duration) -> Result<Litter> {
    let store = Store::open(&config.store, wait)?;
    let keep = config.report.keep_nights;
    let mut litter = Litter::default();
    let mut needed: BTreeMap<String, u64> = BTreeMap::new();
    let mut served = store.served();
    if let Ok(own) = config.reports.canonicalize() {
        served.insert(own);
    }
    let own = config.reports.canonicalize().ok();
    for reports in served.iter().filter(|reports| reports.is_dir()) {
        let nights = if remove { Nights::open(reports, wait)? } else { Nights::look(reports) };
        if own.as_ref() == Some(reports) {
            litter.nights = nights.superfluous(keep);
            if remove {
                nights.prune(keep)?;
            }
        }
        for name in nights.names().iter().filter(|name| !litter.nights.contains(name) || own.as_ref() != Some(reports))
        {
            let night = nights.night(name).ok_or_else(|| {
                let what = "its manifest night.json cannot be read, so what it needs is unknown: nothing is removed; \
                            `harvest run` publishes the night again";
                Error::store(&nights.folder(name), &what)
            })?;
            needed.extend(night.artefacts);
        }
    }
    for (name, size) in store.artefacts() {
        if needed.contains_key(&name) {
            litter.kept += 1;
        } else {
            if remove {
                store.remove(&name)?;
            }
            litter.artefacts.insert(name, size);
        }
    }
    Ok(litter)
}
