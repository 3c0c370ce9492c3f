//! The store: artefacts of the stages under their fingerprints, one run at a time.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::atomic;
use crate::error::{Error, Result};

/// An opened store. While it lives no other run can open it.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    _lock: File,
}

/// The folders of the store, one per kind of artefact.
const KINDS: &[&str] = &["ingest", "records", "segment", "estimate", "history", "joint", "predict"];

impl Store {
    /// Opens or creates a store and removes what a killed run left half written.
    ///
    /// # Errors
    /// [`Error::Store`] when another run is using it, [`Error::Io`] when the disk says no.
    pub fn open(folder: &Path) -> Result<Store> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "cannot create the folder"))?;
        let path = folder.join("lock");
        let lock = File::create(&path).map_err(Error::io(&path, "cannot create it"))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(Error::store(
                    folder,
                    &"another run is using this store; wait for it or give another --store",
                ));
            }
            Err(TryLockError::Error(e)) => return Err(Error::io(&path, "cannot lock it")(e)),
        }
        for kind in KINDS {
            atomic::sweep(&folder.join(kind))?;
        }
        Ok(Store { folder: folder.to_owned(), _lock: lock })
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

    /// The artefact at a path, where there is one that can be read; a damaged one counts as none and is made again.
    #[must_use]
    pub fn load<T: DeserializeOwned>(&self, path: &Path) -> Option<T> {
        serde_json::from_slice(&std::fs::read(path).ok()?).ok()
    }

    /// Stores an artefact whole.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn save(&self, path: &Path, artefact: &impl Serialize) -> Result<()> {
        atomic::place(path, &serde_json::to_vec(artefact).map_err(|e| Error::store(path, &e))?)
    }

    /// Removes the artefacts of a kind that are not among `current`: superseded by others.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file that cannot be removed.
    pub fn keep_only(&self, kind: &str, current: &[PathBuf]) -> Result<()> {
        for entry in std::fs::read_dir(self.folder.join(kind)).into_iter().flatten().flatten() {
            if !current.contains(&entry.path()) {
                std::fs::remove_file(entry.path()).map_err(Error::io(&entry.path(), "cannot remove it"))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_store_is_one_run_s_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = Store::open(folder.path()).unwrap();
        let second = Store::open(folder.path()).unwrap_err();
        assert!(second.to_string().contains("another run"), "{second}");
        drop(first);
        assert!(Store::open(folder.path()).is_ok());
    }

    #[test]
    fn numbers_come_back_to_the_bit_and_a_damaged_artefact_counts_as_none() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let path = store.path("estimate", "flight_001/t00012", "0123", "json");
        let values = vec![0.1 + 0.2, 1.0 / 3.0, f64::MIN_POSITIVE, -1.234_567_890_123_456_7e300];
        store.save(&path, &values).unwrap();
        assert_eq!(store.load::<Vec<f64>>(&path), Some(values));
        std::fs::write(&path, "[0.3, ").unwrap();
        assert_eq!(store.load::<Vec<f64>>(&path), None);
    }
}
