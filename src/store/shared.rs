//! The store's other half, where it lies in an object store: what is there, what comes from it and
//! what goes to it. The folder beside it then is a cache of its own on each machine.
//!
//! There is no lock. One would have to outlive its holder, and somebody to say when a holder is
//! dead; and nothing hangs on it: an object appears whole, by one request, and its name ends in the
//! fingerprint of what decides it, so two runs that make the same one put the same bytes. Nothing
//! of ours removes one that another may need.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::atomic::Draft;
use super::{Digest, object};
use crate::error::{Error, Result};

/// An object store that is opened: what is there was listed once, and is added to by what this run
/// puts there.
#[derive(Debug)]
pub(super) struct Shared {
    place: PathBuf,
    /// Names relative to the place, with sizes.
    there: Mutex<BTreeMap<String, u64>>,
}

impl Shared {
    /// Lists what is there.
    ///
    /// # Errors
    /// Why it cannot be listed.
    pub fn open(place: &Path) -> Result<Shared> {
        let listed = object::list(place).map_err(|e| e.at(place))?;
        let name = |path: &Path| {
            Some(
                path.strip_prefix(place)
                    .ok()?
                    .to_string_lossy()
                    .into_owned(),
            )
        };
        let there = listed
            .into_iter()
            .filter_map(|(path, about)| Some((name(&path)?, about.bytes)))
            .collect();
        Ok(Shared {
            place: place.to_owned(),
            there: Mutex::new(there),
        })
    }

    fn there(&self) -> MutexGuard<'_, BTreeMap<String, u64>> {
        self.there.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn all(&self) -> BTreeMap<String, u64> {
        self.there().clone()
    }

    pub fn size(&self, name: &str) -> Option<u64> {
        self.there().get(name).copied()
    }

    /// A small object whole; none where there is none.
    pub fn get(&self, name: &str) -> Result<Option<Vec<u8>>> {
        if self.size(name).is_none() {
            return Ok(None);
        }
        let path = self.place.join(name);
        object::get(&path).map_err(|e| e.at(&path))
    }

    pub fn put(&self, name: &str, bytes: Vec<u8>) -> Result<()> {
        let (path, size) = (self.place.join(name), bytes.len() as u64);
        object::put(&path, bytes).map_err(|e| e.at(&path))?;
        self.there().insert(name.to_owned(), size);
        Ok(())
    }

    /// Puts a file.
    pub fn send(&self, file: &Path, name: &str) -> Result<()> {
        let path = self.place.join(name);
        let size = std::fs::metadata(file)
            .map_err(Error::io(file, "cannot read it"))?
            .len();
        object::send(file, &path).map_err(|e| e.at(&path))?;
        self.there().insert(name.to_owned(), size);
        Ok(())
    }

    /// Brings an object to a file, unless it is not what was written: then it is removed, for it
    /// would be taken for whole again.
    pub fn fetch(&self, name: &str, file: &Path, written: &Digest) -> Result<()> {
        let path = self.place.join(name);
        let mut draft = Draft::of(file)?;
        if !object::fetch(&path, &mut draft.writer()).map_err(|e| e.at(&path))? {
            self.there().remove(name);
            return Err(Error::damaged(&path, &"it is gone; run again"));
        }
        if draft.digest() == *written {
            return draft.place();
        }
        object::remove(&path).map_err(|e| e.at(&path))?;
        self.there().remove(name);
        Err(Error::damaged(
            &path,
            &"its bytes were not those that were written, and it was removed; run again",
        ))
    }
}
