//! Connection to a store in an object store; the folder of [`super::Store`] is its cache.
//!
//! There is no lock, because it would outlive a killed holder. None is needed. An object appears
//! whole, by one request. Its name carries the fingerprint of everything that decides it, so two
//! runs that make the same artefact put the same bytes. No run removes an artefact that another may
//! need.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::artefact_name::{ArtefactName, Kind};
use super::atomic::Draft;
use super::fingerprint::Digest;
use super::object;
use crate::error::{Error, Result};

/// An opened object store: its listing at the opening, and what this run has put there since.
#[derive(Debug)]
pub(super) struct Shared {
    place: PathBuf,
    /// Sizes by name relative to the place, bytes.
    listing: Mutex<BTreeMap<String, u64>>,
}

impl Shared {
    /// Lists the objects of a place.
    ///
    /// # Errors
    /// The place cannot be listed.
    pub fn open(place: &Path) -> Result<Shared> {
        let listed = object::list(place).map_err(|e| e.at(place))?;
        let name = |path: &Path| {
            let relative = path.strip_prefix(place).ok()?;
            Some(relative.to_string_lossy().into_owned())
        };
        let listing = listed
            .into_iter()
            .filter_map(|(path, about)| Some((name(&path)?, about.bytes)))
            .collect();
        Ok(Shared {
            place: place.to_owned(),
            listing: Mutex::new(listing),
        })
    }

    fn listing(&self) -> MutexGuard<'_, BTreeMap<String, u64>> {
        self.listing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Artefacts with their sizes, bytes; other files of the place are left out.
    pub fn artefacts(&self) -> BTreeMap<ArtefactName, u64> {
        let artefact = |(name, size): (&String, &u64)| {
            let (folder, file) = name.split_once('/')?;
            let kind = Kind::ALL.into_iter().find(|kind| kind.name() == folder)?;
            Some((ArtefactName::of_file(kind, file), *size))
        };
        self.listing().iter().filter_map(artefact).collect()
    }

    /// Size of an object, bytes; `None` if there is no such object.
    pub fn size(&self, name: &str) -> Option<u64> {
        self.listing().get(name).copied()
    }

    /// Reads a small object whole; `None` if there is no such object.
    pub fn get(&self, name: &str) -> Result<Option<Vec<u8>>> {
        if self.size(name).is_none() {
            return Ok(None);
        }
        let path = self.place.join(name);
        object::get(&path).map_err(|e| e.at(&path))
    }

    /// Writes a small object.
    pub fn put(&self, name: &str, bytes: Vec<u8>) -> Result<()> {
        let (path, size) = (self.place.join(name), bytes.len() as u64);
        object::put(&path, bytes).map_err(|e| e.at(&path))?;
        self.listing().insert(name.to_owned(), size);
        Ok(())
    }

    /// Copies a file to an object.
    pub fn send(&self, file: &Path, name: &str) -> Result<()> {
        let path = self.place.join(name);
        let size = std::fs::metadata(file)
            .map_err(Error::io(file, "cannot read it"))?
            .len();
        object::send(file, &path).map_err(|e| e.at(&path))?;
        self.listing().insert(name.to_owned(), size);
        Ok(())
    }

    /// Copies an object to a file. An object with other bytes than were written is removed: it would
    /// be taken for whole again.
    ///
    /// # Errors
    /// The object is gone, damaged or cannot be read.
    pub fn fetch(&self, name: &str, file: &Path, written: &Digest) -> Result<()> {
        let path = self.place.join(name);
        let mut draft = Draft::create(file)?;
        if !object::fetch(&path, &mut draft.writer()).map_err(|e| e.at(&path))? {
            self.listing().remove(name);
            return Err(Error::damaged(&path, &"it is gone; run again"));
        }
        if draft.digest() == *written {
            return draft.place();
        }
        object::remove(&path).map_err(|e| e.at(&path))?;
        self.listing().remove(name);
        Err(Error::damaged(
            &path,
            &"its bytes differed from those that were written, and it was removed; run again",
        ))
    }
}
