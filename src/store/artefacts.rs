//! Store of artefacts, each named by the fingerprint of everything that decides it.
//!
//! The store is a folder. Machines without a common disk share a store in an object store; the
//! folder is then this machine's cache of it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::artefact_name::{ArtefactName, Kind};
use super::atomic;
use super::fingerprint::{Digest, sealed, unsealed};
use super::in_work::{InWorkEntry, InWorkList};
use super::input_digests::InputDigests;
use super::lock::Lock;
use super::regular;
use super::shared::Shared;
use crate::drawing_cache::DrawingCache;
use crate::error::{Error, Result};

/// An opened store, with the artefacts that this run requires and has made.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    _lock: Option<Lock>,
    shared: Option<Shared>,
    /// Artefacts in the folder that the object store lacks, because the run that made them was
    /// killed.
    unsent: Mutex<BTreeSet<ArtefactName>>,
    /// First failure to read from the object store.
    transfer_error: Mutex<Option<Error>>,
    /// One lock for each record being fetched: concurrent readers of a record fetch it once.
    fetching: Mutex<BTreeMap<ArtefactName, Arc<Mutex<()>>>>,
    /// Artefacts from which this run's results are made.
    required: Mutex<BTreeSet<ArtefactName>>,
    /// Number of artefacts that this run made.
    made: Mutex<usize>,
    /// Flights being processed, of a store that this run holds alone.
    in_work: Option<InWorkList>,
}

/// File of the remembered digests of input files.
const CONTENTS: &str = "contents.json";

/// File of the last report's drawings, and the name under which it is sealed: another program makes all
/// of them anew.
const DRAWINGS: &str = "drawings.bin";
const DRAWINGS_SEALED_AS: &str = concat!("drawings ", env!("HARVEST_SOURCE"));

/// File that lists the folders of reports published from this store.
const REPORTS: &str = "serves.json";

/// Locks a mutex. A panic of another holder leaves its value usable: each is changed in one step.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Store {
    /// Opens or creates a store for one run alone, waiting up to `wait` for another run to end.
    /// Removes the temporary files of a killed run.
    ///
    /// # Errors
    /// [`Error::Busy`] when another run uses it, [`Error::Io`] when the disk fails.
    pub fn open(folder: &Path, wait: Duration) -> Result<Store> {
        let lock = Lock::take(&folder.join("lock"), "store", wait)?;
        atomic::sweep(folder)?;
        for kind in Kind::ALL {
            atomic::sweep(&folder.join(kind.name()))?;
        }
        Ok(Store {
            _lock: Some(lock),
            in_work: Some(InWorkList::start_empty(folder)),
            ..Store::read_only(folder)
        })
    }

    /// Opens or creates a store for several processes that add to it at once, waiting up to `wait`
    /// for a run that holds it alone. Temporary files stay: another process may be writing them.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_shared(folder: &Path, wait: Duration) -> Result<Store> {
        let lock = Lock::share(&folder.join("lock"), "store", wait)?;
        Ok(Store {
            _lock: Some(lock),
            ..Store::read_only(folder)
        })
    }

    /// A store for reading without a lock; it need not exist.
    #[must_use]
    pub fn read_only(folder: &Path) -> Store {
        Store {
            folder: folder.to_owned(),
            _lock: None,
            shared: None,
            unsent: Mutex::default(),
            transfer_error: Mutex::default(),
            fetching: Mutex::default(),
            required: Mutex::default(),
            made: Mutex::default(),
            in_work: None,
        }
    }

    /// Lists a flight as being processed until the returned value is dropped.
    pub fn list_in_work<'a>(&'a self, flight_id: &'a str) -> Option<InWorkEntry<'a>> {
        self.in_work.as_ref().map(|list| list.add(flight_id))
    }

    /// Makes the store the cache of one in an object store, if a place there is given.
    ///
    /// # Errors
    /// [`Error::Store`] or [`Error::Archive`] naming the place that cannot be listed.
    pub fn sharing(self, place: Option<&Path>) -> Result<Store> {
        Ok(Store {
            shared: place.map(Shared::open).transpose()?,
            ..self
        })
    }

    /// Remembered digests of input files; of objects, those that other machines shared as well.
    #[must_use]
    pub fn contents(&self) -> InputDigests {
        let contents = InputDigests::load(&self.folder.join(CONTENTS));
        let of_others = self
            .shared
            .as_ref()
            .and_then(|shared| shared.get(CONTENTS).ok().flatten());
        match of_others {
            Some(text) => contents.with_objects(&text),
            None => contents,
        }
    }

    /// Saves the digests of input files, and shares those of objects with other machines.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn remember(&self, contents: &InputDigests) -> Result<()> {
        if let (Some(shared), Some(objects)) = (&self.shared, contents.objects()) {
            shared.put(CONTENTS, objects)?;
        }
        contents.save()
    }

    /// Drawings of the last report from this store; none of a damaged file.
    #[must_use]
    pub fn drawings(&self) -> DrawingCache {
        let bytes = regular::read(&self.folder.join(DRAWINGS)).unwrap_or_default();
        let drawings = unsealed(DRAWINGS_SEALED_AS, &bytes);
        drawings
            .map(DrawingCache::of_last_report)
            .unwrap_or_default()
    }

    /// Keeps the drawings of a report for the next one.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn keep_drawings(&self, cache: &DrawingCache) -> Result<()> {
        let bytes = sealed(DRAWINGS_SEALED_AS, cache.to_bytes());
        atomic::place(&self.folder.join(DRAWINGS), &bytes)
    }

    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of an artefact's file.
    #[must_use]
    pub fn path(&self, name: &ArtefactName) -> PathBuf {
        self.folder.join(name.as_str())
    }

    /// `true` if the folder has a file of this name, whole or damaged.
    fn has_file(&self, name: &ArtefactName) -> bool {
        self.path(name).exists()
    }

    /// Reads an artefact. A damaged one, or one stored under another's name, counts as absent and
    /// is made again.
    #[must_use]
    pub fn load<T: DeserializeOwned>(&self, name: &ArtefactName) -> Option<T> {
        let parse = |bytes: &[u8]| serde_json::from_slice(unsealed(name.as_str(), bytes)?).ok();
        let path = self.path(name);
        if let Some(artefact) = regular::read(&path).ok().and_then(|bytes| parse(&bytes)) {
            self.note_present(name);
            return Some(artefact);
        }
        let shared = self.shared.as_ref()?;
        let fetched = shared.get(name.as_str()).and_then(|bytes| {
            let whole = bytes.filter(|bytes| unsealed(name.as_str(), bytes).is_some());
            if let Some(bytes) = &whole {
                atomic::place(&path, bytes)?;
            }
            Ok(whole)
        });
        match fetched {
            Ok(bytes) => parse(&bytes?),
            Err(error) => {
                locked(&self.transfer_error).get_or_insert(error);
                None
            }
        }
    }

    /// Saves an artefact whole, sealed with a fingerprint of its name and bytes.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn save(&self, name: &ArtefactName, artefact: &impl Serialize) -> Result<()> {
        let path = self.path(name);
        let text = serde_json::to_vec(artefact).map_err(|e| Error::store(&path, &e))?;
        atomic::place(&path, &sealed(name.as_str(), text))?;
        self.note_made(name)
    }

    /// Counts an artefact that this run wrote, and sends it to the object store.
    ///
    /// # Errors
    /// The artefact cannot be sent.
    pub fn note_made(&self, name: &ArtefactName) -> Result<()> {
        *locked(&self.made) += 1;
        self.send(name)
    }

    /// Number of artefacts that this run made.
    #[must_use]
    pub fn made(&self) -> usize {
        *locked(&self.made)
    }

    /// Notes an artefact of the folder; [`Store::send_unsent`] sends it if the object store lacks
    /// it.
    fn note_present(&self, name: &ArtefactName) {
        let is_unsent = |shared: &Shared| shared.size(name.as_str()).is_none();
        if self.shared.as_ref().is_some_and(is_unsent) {
            locked(&self.unsent).insert(name.clone());
        }
    }

    fn is_shared(&self, name: &ArtefactName, bytes: u64) -> bool {
        let size = |shared: &Shared| shared.size(name.as_str());
        self.shared.as_ref().and_then(size) == Some(bytes)
    }

    /// Copies a record that only the object store has into the folder.
    ///
    /// # Errors
    /// It cannot be read, or its bytes are not those that were written.
    pub fn fetch(&self, name: &ArtefactName, digest: &Digest) -> Result<()> {
        let Some(shared) = &self.shared else {
            return Ok(());
        };
        let turn = Arc::clone(locked(&self.fetching).entry(name.clone()).or_default());
        let _turn = locked(&turn);
        let path = self.path(name);
        if path.exists() || shared.size(name.as_str()).is_none() {
            return Ok(());
        }
        shared.fetch(name.as_str(), &path, digest)
    }

    /// Sends the artefacts that an earlier run made and did not send.
    ///
    /// # Errors
    /// One cannot be sent, or an earlier read from the object store failed.
    pub fn send_unsent(&self) -> Result<()> {
        let unsent = std::mem::take(&mut *locked(&self.unsent));
        unsent.iter().try_for_each(|name| self.send(name))?;
        self.check_transfers()
    }

    /// Returns the first failure to read from the object store.
    ///
    /// # Errors
    /// The first failure.
    pub fn check_transfers(&self) -> Result<()> {
        locked(&self.transfer_error).take().map_or(Ok(()), Err)
    }

    fn send(&self, name: &ArtefactName) -> Result<()> {
        match &self.shared {
            Some(shared) => shared.send(&self.path(name), name.as_str()),
            None => Ok(()),
        }
    }

    /// Notes that this run's results depend on an artefact. The night's manifest lists it, and it
    /// is kept as long as the night.
    pub fn require(&self, name: &ArtefactName) {
        locked(&self.required).insert(name.clone());
    }

    /// Required artefacts with their sizes, bytes.
    #[must_use]
    pub fn required(&self) -> BTreeMap<ArtefactName, u64> {
        let sized = |name: &ArtefactName| {
            let in_folder = std::fs::metadata(self.path(name)).ok().map(|m| m.len());
            let size = in_folder.or_else(|| self.shared.as_ref()?.size(name.as_str()))?;
            Some((name.clone(), size))
        };
        locked(&self.required).iter().filter_map(sized).collect()
    }

    /// `true` if the store has an artefact whose seal fits its bytes. Records have no seal.
    #[must_use]
    pub fn has_sealed(&self, name: &ArtefactName) -> bool {
        let is_sealed = |bytes: &Vec<u8>| unsealed(name.as_str(), bytes).is_some();
        if regular::read(&self.path(name)).is_ok_and(|bytes| is_sealed(&bytes)) {
            self.note_present(name);
            return true;
        }
        let shared = |shared: &Shared| shared.get(name.as_str()).ok()?;
        self.shared
            .as_ref()
            .and_then(shared)
            .as_ref()
            .is_some_and(is_sealed)
    }

    /// `true` if the folder has a record unchanged, or if only the object store has it, with this
    /// size; then [`Store::fetch`] checks its digest.
    #[must_use]
    pub fn has_record(
        &self,
        name: &ArtefactName,
        digest: &Digest,
        contents: &InputDigests,
    ) -> bool {
        if self.has_file(name) {
            let is_written = contents
                .of(&self.path(name))
                .is_ok_and(|own| own == *digest);
            if is_written {
                self.note_present(name);
            }
            is_written
        } else {
            self.is_shared(name, digest.bytes)
        }
    }

    /// `true` if the local file has a valid seal, or, without a local file, if the object store has
    /// the artefact in this size.
    #[must_use]
    pub fn is_intact(&self, name: &ArtefactName, bytes: u64) -> bool {
        if self.has_file(name) {
            self.has_sealed(name)
        } else {
            self.is_shared(name, bytes)
        }
    }

    /// Lists a folder of reports as published from this store, so that its artefacts stay.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn register_reports(&self, reports: &Path) -> Result<()> {
        let reports =
            std::fs::canonicalize(reports).map_err(Error::io(reports, "cannot find the folder"))?;
        let mut all = self.reports();
        if all.insert(reports) {
            let path = self.folder.join(REPORTS);
            let text = serde_json::to_vec(&all).map_err(|e| Error::store(&path, &e))?;
            atomic::place(&path, &text)?;
        }
        Ok(())
    }

    /// Folders of reports published from this store. A damaged list yields a folder that does not
    /// exist, so that nothing is removed.
    #[must_use]
    pub fn reports(&self) -> BTreeSet<PathBuf> {
        let Ok(bytes) = regular::read(&self.folder.join(REPORTS)) else {
            return BTreeSet::new();
        };
        serde_json::from_slice(&bytes)
            .unwrap_or_else(|_| [PathBuf::from("unknown: serves.json was damaged")].into())
    }

    /// All artefacts with their sizes, bytes; of a shared store those in the object store.
    #[must_use]
    pub fn artefacts(&self) -> BTreeMap<ArtefactName, u64> {
        match &self.shared {
            Some(shared) => shared.artefacts(),
            None => self.cached_artefacts(),
        }
    }

    fn cached_artefacts(&self) -> BTreeMap<ArtefactName, u64> {
        let mut found = BTreeMap::new();
        for kind in Kind::ALL {
            let entries = std::fs::read_dir(self.folder.join(kind.name()));
            for entry in entries.into_iter().flatten().flatten() {
                let name = ArtefactName::of_file(kind, &entry.file_name().to_string_lossy());
                found.insert(name, entry.metadata().map_or(0, |m| m.len()));
            }
        }
        found
    }

    /// Removes an artefact from the folder.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file that cannot be removed.
    pub fn remove(&self, name: &ArtefactName) -> Result<()> {
        let path = self.path(name);
        std::fs::remove_file(&path).map_err(Error::io(&path, "cannot remove it"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_run_at_a_time_opens_a_store() {
        let folder = tempfile::tempdir().unwrap();
        let first = Store::open(folder.path(), Duration::ZERO).unwrap();
        let second = Store::open(folder.path(), Duration::ZERO).unwrap_err();
        assert!(matches!(second, Error::Busy { .. }), "{second}");
        drop(first);
        assert!(Store::open(folder.path(), Duration::ZERO).is_ok());
    }

    #[test]
    fn drawings_are_kept_and_damaged_ones_are_made_anew() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), Duration::ZERO).unwrap();
        let cache = store.drawings();
        cache.get_or_draw("one", || Some(b"drawn".to_vec()));
        store.keep_drawings(&cache).unwrap();
        let known = store.drawings();
        assert!(known.get_or_draw("one", || unreachable!()).is_some());
        let path = folder.path().join(DRAWINGS);
        let whole = std::fs::read(&path).unwrap();
        for byte in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[byte] ^= 1;
            std::fs::write(&path, damaged).unwrap();
            let drawn = store.drawings().get_or_draw("one", || None);
            assert_eq!(drawn, None, "byte {byte}");
        }
    }

    #[test]
    fn an_artefact_with_any_flipped_bit_is_absent() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), Duration::ZERO).unwrap();
        let name = ArtefactName::new(Kind::Estimate, "m", "0123");
        let path = store.path(&name);
        store.save(&name, &vec![1.25, 2.5]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for bit in 0..8 * whole.len() {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, flipped).unwrap();
            assert_eq!(store.load::<Vec<f64>>(&name), None, "bit {bit}");
        }
    }

    #[test]
    fn an_artefact_under_another_s_name_is_absent() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), Duration::ZERO).unwrap();
        let names = [
            ArtefactName::new(Kind::Estimate, "m1", "0123"),
            ArtefactName::new(Kind::Estimate, "m2", "0123"),
            ArtefactName::new(Kind::Estimate, "m1", "4567"),
            ArtefactName::new(Kind::History, "m1", "0123"),
        ];
        store.save(&names[0], &1.25).unwrap();
        assert_eq!(store.load::<f64>(&names[0]), Some(1.25));
        for other in &names[1..] {
            let path = store.path(other);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::copy(store.path(&names[0]), &path).unwrap();
            assert_eq!(store.load::<f64>(other), None);
            assert!(!store.has_sealed(other) && !store.is_intact(other, 23));
        }
    }

    #[test]
    fn numbers_keep_every_bit_and_a_truncated_artefact_is_absent() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), Duration::ZERO).unwrap();
        let name = ArtefactName::new(Kind::Estimate, "flight_001/t00012", "0123");
        let values = vec![
            0.1 + 0.2,
            1.0 / 3.0,
            f64::MIN_POSITIVE,
            -1.234_567_890_123_456_7e300,
        ];
        store.save(&name, &values).unwrap();
        assert_eq!(store.load::<Vec<f64>>(&name), Some(values));
        std::fs::write(store.path(&name), "[0.3, ").unwrap();
        assert_eq!(store.load::<Vec<f64>>(&name), None);
    }
}
