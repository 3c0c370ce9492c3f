//! A step: one artefact of the store, its key, and the function that makes it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::Result;
use crate::store::{ArtefactName, Digest, Fingerprint, Kind};

/// Computation of one artefact about a flight, a maneuver or a group of maneuvers.
///
/// The artefact is a function of its key: an artefact under the name of the key's fingerprint is up
/// to date by construction.
pub trait Step: Sync {
    /// Everything that decides the artefact, besides the method.
    type Key: Serialize;
    type Artefact: Serialize + DeserializeOwned;

    const KIND: Kind;

    /// Version of the method; goes up when its numbers change for the same key.
    const VERSION: u32;

    /// Flight, maneuver or group of the artefact.
    fn item(&self) -> &str;

    fn key(&self) -> Self::Key;

    /// Computes the artefact that will be saved as `name`.
    ///
    /// # Errors
    /// A fault that stops the run. A fault of the flight or maneuver is part of the artefact.
    fn make(&self, name: &ArtefactName) -> Result<ComputedArtefact<Self::Artefact>>;

    /// Further files of the store that belong to the artefact saved as `name`.
    fn companions(&self, _name: &ArtefactName, _artefact: &Self::Artefact) -> Vec<Companion> {
        Vec::new()
    }

    /// Name of the artefact, with the fingerprint of the key.
    fn name(&self) -> ArtefactName {
        let fingerprint = Fingerprint::of(Self::KIND.name(), Self::VERSION)
            .with(&self.key())
            .finish();
        ArtefactName::new(Self::KIND, self.item(), &fingerprint)
    }
}

/// A computed artefact.
#[derive(Clone, Debug)]
pub enum ComputedArtefact<A> {
    /// Determined by the key alone; it is saved.
    Final(A),
    /// Affected by a temporary fault, such as a file that changed meanwhile; the next run tries
    /// again.
    Temporary(A),
}

/// A file that belongs to an artefact.
#[derive(Clone, Debug)]
pub struct Companion {
    pub name: ArtefactName,
    /// Digest of a file that has no checksum of its own.
    pub digest: Option<Digest>,
}

/// An artefact, loaded or made.
#[derive(Clone, Debug)]
pub struct LoadedOrMade<A> {
    pub name: ArtefactName,
    pub artefact: A,
    /// `false` for an artefact that a temporary fault affected; the store does not keep it.
    pub is_stored: bool,
}
