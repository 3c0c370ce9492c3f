//! Places of archive, store and reports: folders, the first two also in an object store.

use std::path::{Path, PathBuf};

use super::source::Source;
use crate::error::{Error, Result};
use crate::store::object;

/// Folder of the store, and the place in an object store that it caches.
pub(super) fn store(
    store: Option<PathBuf>,
    cache: Option<PathBuf>,
    default: PathBuf,
    pipeline: &Source,
) -> Result<(PathBuf, Option<PathBuf>)> {
    if let Some(shared) = store.as_ref().filter(|store| object::is_object(store)) {
        reachable(shared)?;
        let folder = in_folder(
            cache.unwrap_or(default),
            "the cache of a store is a folder of this machine's",
        )?;
        return Ok((folder, Some(shared.clone())));
    }
    if cache.is_some() {
        let what = "`store_cache` is the folder beside a store in an object store (`store: s3://bucket/prefix`); this \
                    store is a folder itself";
        return Err(pipeline.error_under("store_cache", "store_cache", what));
    }
    Ok((store.unwrap_or(default), None))
}

/// Checks the form of a place in an object store, and that this program supports object stores. It
/// does not connect.
pub(super) fn reachable(place: &Path) -> Result<()> {
    if object::is_object(place) {
        object::check(place).map_err(|e| e.at(place))
    } else {
        Ok(())
    }
}

/// Checks that a place is no object store.
pub(super) fn in_folder(place: PathBuf, why: &str) -> Result<PathBuf> {
    if object::is_object(&place) {
        return Err(Error::config(
            &place,
            None,
            format!("{why}: it cannot lie in an object store"),
        ));
    }
    Ok(place)
}
