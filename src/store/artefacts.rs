//! The store: artefacts of the stages under their fingerprints, one run at a time.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::atomic;
use super::fingerprint::{sealed, unsealed};
use super::lock::Lock;
use crate::error::{Error, Result};

/// An opened store. While it lives no other run can open it.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    _lock: Option<Lock>,
    /// What the results of this run are made of.
    needed: Mutex<BTreeSet<PathBuf>>,
    /// What this run made.
    made: Mutex<Vec<PathBuf>>,
}

/// The folders of the store, one per kind of artefact.
pub const KINDS: &[&str] = &["ingest", "records", "segment", "estimate", "history", "joint", "predict"];

/// Names the folders of reports that the store serves.
const SERVED: &str = "serves.json";

impl Store {
    /// Opens or creates a store, waiting up to `wait` for another run to leave it, and removes what a killed run left half
    /// written.
    ///
    /// # Errors
    /// [`Error::Store`] when another run is using it, [`Error::Io`] when the disk says no.
    pub fn open(folder: &Path, wait: Duration) -> Result<Store> {
        let lock = Lock::take(&folder.join("lock"), "store", wait)?;
        atomic::sweep(folder)?;
        for kind in KINDS {
            atomic::sweep(&folder.join(kind))?;
        }
        Ok(Store { _lock: Some(lock), ..Store::look(folder) })
    }

    /// Opens or creates a store as one of many that add to it at the same time, waiting up to `wait` for a run to leave
    /// it. What lies there half written may be another's work and stays.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn join(folder: &Path, wait: Duration) -> Result<Store> {
        let lock = Lock::share(&folder.join("lock"), "store", wait)?;
        Ok(Store { _lock: Some(lock), ..Store::look(folder) })
    }

    /// A store to look into while others use it; it need not exist.
    #[must_use]
    pub fn look(folder: &Path) -> Store {
        Store { folder: folder.to_owned(), _lock: None, needed: Mutex::default(), made: Mutex::default() }
    }

    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the artefact of a kind for an item (a flight, a maneuver) with a fingerprint lies.
    #[must_use]
    pub fn path(&self, kind: &str, item: &str, fingerprint: &str, extension: &str) -> PathBuf {
        let safe: String =
            item.chars().map(|c| if c.is_alphanumeric() || "-_=.".contains(c) { c } else { '_' }).collect();
        self.folder.join(kind).join(format!("{safe}-{fingerprint}.{extension}"))
    }

    /// Where the artefact of another kind under the same name and fingerprint lies.
    #[must_use]
    pub fn beside(&self, path: &Path, kind: &str) -> PathBuf {
        self.folder.join(kind).join(path.file_name().unwrap_or_default())
    }

    /// The artefact at a path, where there is one that is as it was written; a damaged one counts as none and is made again.
    #[must_use]
    pub fn load<T: DeserializeOwned>(&self, path: &Path) -> Option<T> {
        let bytes = std::fs::read(path).ok()?;
        serde_json::from_slice(unsealed(&bytes)?).ok()
    }

    /// Stores an artefact whole, with a fingerprint of its bytes at its end.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn save(&self, path: &Path, artefact: &impl Serialize) -> Result<()> {
        let text = serde_json::to_vec(artefact).map_err(|e| Error::store(path, &e))?;
        atomic::place(path, &sealed(text))?;
        self.note(path);
        Ok(())
    }

    /// Notes that this run made an artefact.
    pub fn note(&self, path: &Path) {
        if let Ok(mut made) = self.made.lock() {
            made.push(path.to_owned());
        }
    }

    /// How many artefacts this run made.
    #[must_use]
    pub fn made(&self) -> usize {
        self.made.lock().map_or(0, |made| made.len())
    }

    /// Notes that the results of this run are made of these artefacts: what is published names them, and they are kept as
    /// long as it is.
    pub fn need<'a>(&self, paths: impl IntoIterator<Item = &'a PathBuf>) {
        if let Ok(mut needed) = self.needed.lock() {
            needed.extend(paths.into_iter().cloned());
        }
    }

    /// The artefacts that were noted as needed, relative to the store, with their sizes.
    #[must_use]
    pub fn needed(&self) -> BTreeMap<String, u64> {
        let Ok(needed) = self.needed.lock() else { return BTreeMap::new() };
        let name = |path: &PathBuf| {
            let size = std::fs::metadata(path).ok()?.len();
            Some((path.strip_prefix(&self.folder).ok()?.to_string_lossy().into_owned(), size))
        };
        needed.iter().filter_map(name).collect()
    }

    /// Whether an artefact, by its name relative to the store, is as it was written; not a record, which has no seal.
    #[must_use]
    pub fn is_whole(&self, name: &str) -> bool {
        self.holds(&self.folder.join(name))
    }

    /// Whether there is an artefact at a path that is as it was written; not a record, which has no seal.
    #[must_use]
    pub fn holds(&self, path: &Path) -> bool {
        std::fs::read(path).is_ok_and(|bytes| unsealed(&bytes).is_some())
    }

    /// Notes that what is published in this folder is made of this store's artefacts, so that none of them is removed.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn serves(&self, reports: &Path) -> Result<()> {
        let reports = std::fs::canonicalize(reports).map_err(Error::io(reports, "cannot find the folder"))?;
        let mut served = self.served();
        if served.insert(reports) {
            let path = self.folder.join(SERVED);
            atomic::place(&path, &serde_json::to_vec(&served).map_err(|e| Error::store(&path, &e))?)?;
        }
        Ok(())
    }

    /// The folders of reports that are made of this store's artefacts. Where the list is damaged, a folder that cannot be
    /// found stands for those that were in it.
    #[must_use]
    pub fn served(&self) -> BTreeSet<PathBuf> {
        let Ok(bytes) = std::fs::read(self.folder.join(SERVED)) else { return BTreeSet::new() };
        serde_json::from_slice(&bytes).unwrap_or_else(|_| [PathBuf::from("unknown: serves.json was damaged")].into())
    }

    /// All artefacts, relative to the store, with their sizes.
    #[must_use]
    pub fn artefacts(&self) -> BTreeMap<String, u64> {
        let mut found = BTreeMap::new();
        for kind in KINDS {
            for entry in std::fs::read_dir(self.folder.join(kind)).into_iter().flatten().flatten() {
                let size = entry.metadata().map_or(0, |m| m.len());
                found.insert(format!("{kind}/{}", entry.file_name().to_string_lossy()), size);
            }
        }
        found
    }

    /// Removes an artefact by its name relative to the store.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file that cannot be removed.
    pub fn remove(&self, name: &str) -> Result<()> {
        let path = self.folder.join(name);
        std::fs::remove_file(&path).map_err(Error::io(&path, "cannot remove it"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_store_is_one_run_s_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = Store::open(folder.path(), Duration::ZERO).unwrap();
        let second = Store::open(folder.path(), Duration::ZERO).unwrap_err();
        assert!(second.to_string().contains("another run"), "{second}");
        drop(first);
        assert!(Store::open(folder.path(), Duration::ZERO).is_ok());
    }

    #[test]
    fn an_artefact_with_one_bit_flipped_anywhere_counts_as_none() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), Duration::ZERO).unwrap();
        let path = store.path("estimate", "m", "0123", "json");
        store.save(&path, &vec![1.25, 2.5]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for bit in 0..8 * whole.len() {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, flipped).unwrap();
            assert_eq!(store.load::<Vec<f64>>(&path), None, "bit {bit}");
        }
    }

    #[test]
    fn numbers_come_back_to_the_bit_and_a_damaged_artefact_counts_as_none() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), Duration::ZERO).unwrap();
        let path = store.path("estimate", "flight_001/t00012", "0123", "json");
        let values = vec![0.1 + 0.2, 1.0 / 3.0, f64::MIN_POSITIVE, -1.234_567_890_123_456_7e300];
        store.save(&path, &values).unwrap();
        assert_eq!(store.load::<Vec<f64>>(&path), Some(values));
        std::fs::write(&path, "[0.3, ").unwrap();
        assert_eq!(store.load::<Vec<f64>>(&path), None);
    }
}
