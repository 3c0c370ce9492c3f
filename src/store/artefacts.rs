//! The store: artefacts of the stages under their fingerprints, one run at a time; a folder, and
//! where it is shared by machines without a common disk, an object store that the folder is the
//! cache of.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::atomic;
use super::fingerprint::{sealed, unsealed};
use super::lock::Lock;
use super::shared::Shared;
use super::{Contents, Digest};
use crate::error::{Error, Result};

/// An opened store. While it lives no other run can open it.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    _lock: Option<Lock>,
    shared: Option<Shared>,
    /// What is in the folder and not yet in the object store: another run was killed before it had
    /// sent it.
    unsent: Mutex<BTreeSet<PathBuf>>,
    /// Why something of the object store could not be had.
    trouble: Mutex<Option<Error>>,
    /// What the results of this run are made of.
    needed: Mutex<BTreeSet<PathBuf>>,
    /// What this run made.
    made: Mutex<Vec<PathBuf>>,
}

/// The folders of the store, one per kind of artefact.
pub const KINDS: &[&str] = &[
    "ingest", "records", "segment", "estimate", "history", "joint", "predict",
];

/// Fingerprints of files' contents.
const CONTENTS: &str = "contents.json";

/// Names the folders of reports that the store serves.
const SERVED: &str = "serves.json";

impl Store {
    /// Opens or creates a store, waiting up to `wait` for another run to leave it, and removes what
    /// a killed run left half written.
    ///
    /// # Errors
    /// [`Error::Busy`] when another run uses it, [`Error::Io`] when the disk says no.
    pub fn open(folder: &Path, wait: Duration) -> Result<Store> {
        let lock = Lock::take(&folder.join("lock"), "store", wait)?;
        atomic::sweep(folder)?;
        for kind in KINDS {
            atomic::sweep(&folder.join(kind))?;
        }
        Ok(Store {
            _lock: Some(lock),
            ..Store::look(folder)
        })
    }

    /// Opens or creates a store as one of many that add to it at the same time, waiting up to
    /// `wait` for a run to leave it. What lies there half written may be another's work and stays.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn join(folder: &Path, wait: Duration) -> Result<Store> {
        let lock = Lock::share(&folder.join("lock"), "store", wait)?;
        Ok(Store {
            _lock: Some(lock),
            ..Store::look(folder)
        })
    }

    /// A store to look into while others use it; it need not exist.
    #[must_use]
    pub fn look(folder: &Path) -> Store {
        Store {
            folder: folder.to_owned(),
            _lock: None,
            shared: None,
            unsent: Mutex::default(),
            trouble: Mutex::default(),
            needed: Mutex::default(),
            made: Mutex::default(),
        }
    }

    /// The same store as the cache of one in an object store, where a place there is named.
    ///
    /// # Errors
    /// [`Error::Store`] or [`Error::Archive`] naming the place: what is there cannot be listed.
    pub fn sharing(self, place: Option<&Path>) -> Result<Store> {
        Ok(Store {
            shared: place.map(Shared::open).transpose()?,
            ..self
        })
    }

    /// What is remembered of files' contents; of objects, what others remember too.
    #[must_use]
    pub fn contents(&self) -> Contents {
        let contents = Contents::load(&self.folder.join(CONTENTS));
        let theirs = self
            .shared
            .as_ref()
            .and_then(|shared| shared.get(CONTENTS).ok().flatten());
        match theirs {
            Some(theirs) => contents.with_objects(&theirs),
            None => contents,
        }
    }

    /// Writes down what is known of files' contents, and tells others what is known of objects.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn remember(&self, contents: &Contents) -> Result<()> {
        if let (Some(shared), Some(objects)) = (&self.shared, contents.objects()) {
            shared.put(CONTENTS, objects)?;
        }
        contents.save()
    }

    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the artefact of a kind for an item (a flight, a maneuver) with a fingerprint lies.
    #[must_use]
    pub fn path(&self, kind: &str, item: &str, fingerprint: &str, extension: &str) -> PathBuf {
        let safe: String = item
            .chars()
            .map(|c| {
                if c.is_alphanumeric() || "-_=.".contains(c) {
                    c
                } else {
                    '_'
                }
            })
            .collect();
        self.folder
            .join(kind)
            .join(format!("{safe}-{fingerprint}.{extension}"))
    }

    /// Where the artefact of another kind under the same name and fingerprint lies.
    #[must_use]
    pub fn beside(&self, path: &Path, kind: &str) -> PathBuf {
        self.folder
            .join(kind)
            .join(path.file_name().unwrap_or_default())
    }

    /// The artefact at a path, where there is one that is as it was written; a damaged one counts
    /// as none and is made again.
    #[must_use]
    pub fn load<T: DeserializeOwned>(&self, path: &Path) -> Option<T> {
        let read = |bytes: &[u8]| serde_json::from_slice(unsealed(bytes)?).ok();
        if let Some(artefact) = std::fs::read(path).ok().and_then(|bytes| read(&bytes)) {
            self.is_here(path);
            return Some(artefact);
        }
        let (shared, name) = (self.shared.as_ref()?, self.name(path)?);
        let fetched = shared.get(&name).and_then(|bytes| {
            let bytes = bytes.filter(|bytes| unsealed(bytes).is_some());
            bytes
                .map(|bytes| atomic::place(path, &bytes).map(|()| bytes))
                .transpose()
        });
        match fetched {
            Ok(bytes) => read(&bytes?),
            Err(error) => {
                if let Ok(mut trouble) = self.trouble.lock() {
                    trouble.get_or_insert(error);
                }
                None
            }
        }
    }

    /// Notes that something is in the folder; what is only there is to be sent.
    pub fn is_here(&self, path: &Path) {
        let is_sent = |shared: &Shared| {
            self.name(path)
                .is_none_or(|name| shared.size(&name).is_some())
        };
        if self.shared.as_ref().is_some_and(|shared| !is_sent(shared))
            && let Ok(mut unsent) = self.unsent.lock()
        {
            unsent.insert(path.to_owned());
        }
    }

    /// Whether a file of this size lies in the object store, from where [`Store::fetch`] brings it.
    #[must_use]
    pub fn is_shared(&self, path: &Path, bytes: u64) -> bool {
        let size = |shared: &Shared| shared.size(&self.name(path)?);
        self.shared.as_ref().and_then(size) == Some(bytes)
    }

    /// Sees to it that a record that lies in the object store is in the folder, too.
    ///
    /// # Errors
    /// It cannot be had, or is not what was written.
    pub fn fetch(&self, path: &Path, digest: Option<&Digest>) -> Result<()> {
        let (Some(shared), Some(name), Some(digest)) = (&self.shared, self.name(path), digest)
        else {
            return Ok(());
        };
        if path.exists() || shared.size(&name).is_none() {
            return Ok(());
        }
        shared.fetch(&name, path, digest)
    }

    /// Sends what an earlier run has made and not sent.
    ///
    /// # Errors
    /// It cannot be sent, or something could not be had before.
    pub fn send_rest(&self) -> Result<()> {
        let unsent = self
            .unsent
            .lock()
            .map(|mut unsent| std::mem::take(&mut *unsent))
            .unwrap_or_default();
        unsent.iter().try_for_each(|path| self.send(path))?;
        self.check()
    }

    /// Whether everything could be had of the object store that was asked for.
    ///
    /// # Errors
    /// The first that could not.
    pub fn check(&self) -> Result<()> {
        self.trouble
            .lock()
            .ok()
            .and_then(|mut trouble| trouble.take())
            .map_or(Ok(()), Err)
    }

    fn send(&self, path: &Path) -> Result<()> {
        match (&self.shared, self.name(path)) {
            (Some(shared), Some(name)) => shared.send(path, &name),
            _ => Ok(()),
        }
    }

    /// A path's name relative to the store.
    fn name(&self, path: &Path) -> Option<String> {
        Some(
            path.strip_prefix(&self.folder)
                .ok()?
                .to_string_lossy()
                .into_owned(),
        )
    }

    /// Stores an artefact whole, with a fingerprint of its bytes at its end.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn save(&self, path: &Path, artefact: &impl Serialize) -> Result<()> {
        let text = serde_json::to_vec(artefact).map_err(|e| Error::store(path, &e))?;
        atomic::place(path, &sealed(text))?;
        self.keep(path)
    }

    /// Notes that this run made what lies at a path, and sends it where the store is shared.
    ///
    /// # Errors
    /// It cannot be sent.
    pub fn keep(&self, path: &Path) -> Result<()> {
        if let Ok(mut made) = self.made.lock() {
            made.push(path.to_owned());
        }
        self.send(path)
    }

    /// How many artefacts this run made.
    #[must_use]
    pub fn made(&self) -> usize {
        self.made.lock().map_or(0, |made| made.len())
    }

    /// Notes that the results of this run are made of these artefacts: what is published names
    /// them, and they are kept as long as it is.
    pub fn need<'a>(&self, paths: impl IntoIterator<Item = &'a PathBuf>) {
        if let Ok(mut needed) = self.needed.lock() {
            needed.extend(paths.into_iter().cloned());
        }
    }

    /// The artefacts that were noted as needed, relative to the store, with their sizes.
    #[must_use]
    pub fn needed(&self) -> BTreeMap<String, u64> {
        let Ok(needed) = self.needed.lock() else {
            return BTreeMap::new();
        };
        let name = |path: &PathBuf| {
            let name = self.name(path)?;
            let here = std::fs::metadata(path).ok().map(|m| m.len());
            let size = here.or_else(|| self.shared.as_ref()?.size(&name))?;
            Some((name, size))
        };
        needed.iter().filter_map(name).collect()
    }

    /// Whether an artefact, by its name relative to the store, is as it was written; not a record,
    /// which has no seal.
    #[must_use]
    pub fn is_whole(&self, name: &str) -> bool {
        self.holds(&self.folder.join(name))
    }

    /// Whether there is an artefact at a path that is as it was written; not a record, which has no
    /// seal.
    #[must_use]
    pub fn holds(&self, path: &Path) -> bool {
        let is_sealed = |bytes: &Vec<u8>| unsealed(bytes).is_some();
        if std::fs::read(path).is_ok_and(|bytes| is_sealed(&bytes)) {
            self.is_here(path);
            return true;
        }
        let shared = |shared: &Shared| shared.get(&self.name(path)?).ok()?;
        self.shared
            .as_ref()
            .and_then(shared)
            .as_ref()
            .is_some_and(is_sealed)
    }

    /// Notes that what is published in this folder is made of this store's artefacts, so that none
    /// of them is removed.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn serves(&self, reports: &Path) -> Result<()> {
        let reports =
            std::fs::canonicalize(reports).map_err(Error::io(reports, "cannot find the folder"))?;
        let mut served = self.served();
        if served.insert(reports) {
            let path = self.folder.join(SERVED);
            atomic::place(
                &path,
                &serde_json::to_vec(&served).map_err(|e| Error::store(&path, &e))?,
            )?;
        }
        Ok(())
    }

    /// The folders of reports that are made of this store's artefacts. Where the list is damaged, a
    /// folder that cannot be found stands for those that were in it.
    #[must_use]
    pub fn served(&self) -> BTreeSet<PathBuf> {
        let Ok(bytes) = std::fs::read(self.folder.join(SERVED)) else {
            return BTreeSet::new();
        };
        serde_json::from_slice(&bytes)
            .unwrap_or_else(|_| [PathBuf::from("unknown: serves.json was damaged")].into())
    }

    /// All artefacts, relative to the store, with their sizes; where it is shared, those that
    /// others see.
    #[must_use]
    pub fn artefacts(&self) -> BTreeMap<String, u64> {
        if let Some(shared) = &self.shared {
            return shared.all();
        }
        let mut found = BTreeMap::new();
        for kind in KINDS {
            for entry in std::fs::read_dir(self.folder.join(kind))
                .into_iter()
                .flatten()
                .flatten()
            {
                let size = entry.metadata().map_or(0, |m| m.len());
                found.insert(
                    format!("{kind}/{}", entry.file_name().to_string_lossy()),
                    size,
                );
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
        assert!(matches!(second, Error::Busy { .. }), "{second}");
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
        let values = vec![
            0.1 + 0.2,
            1.0 / 3.0,
            f64::MIN_POSITIVE,
            -1.234_567_890_123_456_7e300,
        ];
        store.save(&path, &values).unwrap();
        assert_eq!(store.load::<Vec<f64>>(&path), Some(values));
        std::fs::write(&path, "[0.3, ").unwrap();
        assert_eq!(store.load::<Vec<f64>>(&path), None);
    }
}
