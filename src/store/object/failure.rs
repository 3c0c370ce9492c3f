//! Failures of requests, and facts about an object.

use std::path::Path;

use crate::error::Error;

/// Failure of a request, and whether to try again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// A retry may succeed: no answer, or the object was replaced meanwhile.
    Passing(String),
    /// A retry fails too: no such bucket, no permission, or no credentials.
    Lasting(String),
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Failure::Passing(what) | Failure::Lasting(what)) = self;
        f.write_str(what)
    }
}

impl std::error::Error for Failure {}

impl Failure {
    /// Converts to the error that stops a run.
    #[must_use]
    pub fn at(self, place: &Path) -> Error {
        match self {
            Failure::Passing(what) => Error::Unavailable {
                place: place.to_owned(),
                what,
            },
            Failure::Lasting(what) => Error::Archive {
                place: place.to_owned(),
                what,
            },
        }
    }
}

/// Size and tag of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectInfo {
    pub bytes: u64,
    /// ETag, the store's tag of the content. Not every store lists it.
    pub tag: Option<String>,
}
