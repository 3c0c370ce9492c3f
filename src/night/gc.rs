//! Removal of artefacts that no published night needs, and of nights beyond those to keep.
//!
//! Only this machine's cache of a store in an object store is cleaned, since the nights of other
//! machines are not visible here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::config::Config;
use crate::error::{Error, Result};
use crate::store::{ArtefactName, Night, Nights, Store, files};

/// Artefacts and nights that no published night needs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GarbageReport {
    /// Artefacts with their sizes, bytes.
    pub artefacts: BTreeMap<ArtefactName, u64>,
    pub nights: Vec<String>,
    /// Number of artefacts that stay.
    pub kept: usize,
}

/// A folder of reports that is published from the store.
struct ServedReports {
    nights: Nights,
    /// `true` for the folder of this pipeline; only its nights are removed.
    is_own: bool,
}

/// Finds the artefacts and nights that no published night needs, and removes them if `remove` is
/// set. The store may serve several folders of reports; the nights of all of them count.
///
/// # Errors
/// A store in use; a disk that fails; reports that cannot be found, or a night whose manifest
/// cannot be read, because the artefacts they need are unknown.
pub fn gc(config: &Config, remove: bool, wait: Duration) -> Result<GarbageReport> {
    let store = Store::open(&config.store, wait)?;
    let served = served_reports(config, &store, remove, wait)?;
    let keep = config.report.keep_nights;
    let mut unneeded = GarbageReport::default();
    let mut needed: BTreeSet<ArtefactName> = BTreeSet::new();
    for reports in &served {
        let superfluous = if reports.is_own {
            reports.nights.superfluous(keep)
        } else {
            Vec::new()
        };
        for name in reports.nights.names() {
            if !superfluous.contains(&name) {
                needed.extend(manifest(&reports.nights, &name)?.artefacts.into_keys());
            }
        }
        unneeded.nights.extend(superfluous);
    }
    let (kept, artefacts): (BTreeMap<_, _>, BTreeMap<_, _>) = store
        .artefacts()
        .into_iter()
        .partition(|(name, _)| needed.contains(name));
    unneeded.kept = kept.len();
    unneeded.artefacts = artefacts;
    if remove {
        // Nights are removed first, since a night without its artefacts would be damaged.
        let own = served.iter().filter(|reports| reports.is_own);
        own.map(|reports| &reports.nights)
            .try_for_each(|nights| nights.prune(keep))?;
        let mut artefacts = unneeded.artefacts.keys();
        artefacts.try_for_each(|name| store.remove(name))?;
    }
    Ok(unneeded)
}

/// Opens the folders of reports that are published from the store; for removal, locked.
fn served_reports(
    config: &Config,
    store: &Store,
    remove: bool,
    wait: Duration,
) -> Result<Vec<ServedReports>> {
    let own = files::canonical(&config.reports);
    let folders: BTreeSet<PathBuf> = store.reports().into_iter().chain(own.clone()).collect();
    let open = |folder: PathBuf| {
        if !files::is_folder(&folder) {
            return Err(lost_reports(config, &folder));
        }
        let nights = if remove {
            Nights::open(&folder, wait)?
        } else {
            Nights::read_only(&folder)
        };
        Ok(ServedReports {
            nights,
            is_own: own.as_ref() == Some(&folder),
        })
    };
    folders.into_iter().map(open).collect()
}

/// Error for reports that cannot be found. They may be on a disk that is not mounted, and their
/// nights may need artefacts.
fn lost_reports(config: &Config, folder: &Path) -> Error {
    let what = format!(
        "the reports in {} are made of this store and cannot be found, so what they need is unknown: nothing is \
         removed; if they are gone for good, take them out of serves.json",
        folder.display()
    );
    Error::store(&config.store, &what)
}

fn manifest(nights: &Nights, name: &str) -> Result<Night> {
    nights.night(name).ok_or_else(|| {
        let what = "its manifest night.json cannot be read, so what it needs is unknown: nothing is removed; where the \
                    night is not worth keeping, remove its folder";
        Error::damaged(&nights.folder(name), &what)
    })
}
