//! Failures of requests, and facts about an object.

use std::path::Path;

use crate::error::Error;

/// RequestFailure of a request, and whether to try again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RequestFailure {
    /// A retry may succeed: no answer, or the object was replaced meanwhile.
    Transient(String),
    /// A retry fails too: no such bucket, no permission, or no credentials.
    Permanent(String),
}

impl std::fmt::Display for RequestFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (RequestFailure::Transient(what) | RequestFailure::Permanent(what)) = self;
        f.write_str(what)
    }
}

impl std::error::Error for RequestFailure {}

impl RequestFailure {
    /// Converts to the error that stops a run.
    #[must_use]
    pub fn at(self, place: &Path) -> Error {
        match self {
            RequestFailure::Transient(what) => Error::Unavailable {
                place: place.to_owned(),
                what,
            },
            RequestFailure::Permanent(what) => Error::Archive {
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
