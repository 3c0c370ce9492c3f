//! Objects of an S3-compatible store, `s3://bucket/key`: listed, read by ranges, put whole.
//!
//! Endpoint and credentials come from the environment alone: no file of the pipeline and no option
//! holds a secret. The variables are `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`,
//! `AWS_SESSION_TOKEN`, `AWS_REGION`, `AWS_ENDPOINT_URL`, `AWS_ALLOW_HTTP` and others that the
//! `object_store` crate reads. An object is replaced by a single request or not at all, so none is
//! ever half written.

#[cfg(not(feature = "s3"))]
#[path = "absent.rs"]
mod client;
#[cfg(feature = "s3")]
mod client;
mod address;
mod failure;
mod reader;

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use crate::error::Result;
use address::{Address, SCHEME, at};

pub use address::is_object;
pub use failure::{ObjectInfo, RequestFailure};
pub use reader::Reader;

/// Memory for copying an object to or from a file, bytes.
const PART: usize = 16 << 20;

/// Checks the form of an object's path, without a request.
///
/// # Errors
/// The fault of the path, or that this program was built without object stores.
pub fn check(path: &Path) -> Result<(), RequestFailure> {
    Address::parse(path)?;
    client::available()
}

/// Lists the objects whose key begins with the path's (a bucket alone: all), in the order of their
/// keys.
///
/// # Errors
/// They cannot be listed.
pub fn list(path: &Path) -> Result<BTreeMap<PathBuf, ObjectInfo>, RequestFailure> {
    let address = Address::parse(path)?;
    let listed = address.client()?.list(&address.key)?;
    Ok(listed
        .into_iter()
        .map(|(key, about)| {
            (
                PathBuf::from(format!("{SCHEME}{}/{key}", address.bucket)),
                about,
            )
        })
        .collect())
}

/// Remembers the listed entry of an object, so that [`listed`] needs no request.
///
/// # Errors
/// The path is no object's.
pub fn remember(path: &Path, about: &ObjectInfo) -> Result<(), RequestFailure> {
    let (client, key) = at(path)?;
    client.remember(key, about.clone());
    Ok(())
}

/// Asks for size and tag of an object; `None` if there is no such object.
///
/// # Errors
/// The request fails.
pub fn about(path: &Path) -> Result<Option<ObjectInfo>, RequestFailure> {
    let (client, key) = at(path)?;
    client.about(&key)
}

/// Size and tag of an object, remembered from a listing if that had both.
///
/// # Errors
/// The request fails.
pub fn listed(path: &Path) -> Result<Option<ObjectInfo>, RequestFailure> {
    let (client, key) = at(path)?;
    match client.listed(&key) {
        Some(about) if about.tag.is_some() => Ok(Some(about)),
        _ => client.about(&key),
    }
}

/// Reason of an earlier failure to read an object, if the network was at fault.
#[must_use]
pub fn failed(path: &Path) -> Option<String> {
    let (client, key) = at(path).ok()?;
    client.failed(&key)
}

/// Reads a small object whole; `None` if there is no such object.
///
/// # Errors
/// It cannot be read.
pub fn get(path: &Path) -> Result<Option<Vec<u8>>, RequestFailure> {
    let (client, key) = at(path)?;
    Ok(client.get(&key)?.map(|bytes| bytes.to_vec()))
}

/// Puts an object, whole.
///
/// # Errors
/// It cannot be written.
pub fn put(path: &Path, bytes: Vec<u8>) -> Result<(), RequestFailure> {
    let (client, key) = at(path)?;
    client.put(&key, bytes)
}

/// Removes an object, if there is one.
///
/// # Errors
/// It cannot be removed.
pub fn remove(path: &Path) -> Result<(), RequestFailure> {
    let (client, key) = at(path)?;
    client.remove(&key)
}

/// Copies a file to an object, a large one in parts.
///
/// # Errors
/// The file cannot be read or the object not written.
pub fn send(file: &Path, path: &Path) -> Result<(), RequestFailure> {
    let (client, key) = at(path)?;
    let unreadable = |e: std::io::Error| {
        RequestFailure::Transient(format!("{} cannot be read: {e}", file.display()))
    };
    let mut from = std::fs::File::open(file).map_err(unreadable)?;
    let mut part = || {
        let mut bytes = Vec::new();
        (&mut from)
            .take(PART as u64)
            .read_to_end(&mut bytes)
            .map(|_| bytes)
            .map_err(unreadable)
    };
    let first = part()?;
    if first.len() < PART {
        client.put(&key, first)
    } else {
        client.put_parts(&key, first, &mut part)
    }
}

/// Writes an object to `out`, part by part; `false` if there is no such object.
///
/// # Errors
/// It cannot be read or written out.
pub fn fetch(path: &Path, out: &mut impl Write) -> Result<bool, RequestFailure> {
    let Some(mut reader) = Reader::of(path)? else {
        return Ok(false);
    };
    // A full disk must not look like damage of the object.
    std::io::copy(&mut reader, out)
        .and_then(|_| out.flush())
        .map_err(|e| match e.downcast::<RequestFailure>() {
            Ok(failure) => failure,
            Err(e) => RequestFailure::Transient(format!("cannot be copied: {e}")),
        })?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_a_bucket_and_a_key() {
        let parsed = |text: &str| Address::parse(Path::new(text)).map(|a| (a.bucket, a.key));
        let expected = |bucket: &str, key: &str| Ok((bucket.to_owned(), key.to_owned()));
        assert_eq!(
            parsed("s3://flights/1995/flight=007/part-0.parquet"),
            expected("flights", "1995/flight=007/part-0.parquet")
        );
        assert_eq!(parsed("s3://flights"), expected("flights", ""));
        assert_eq!(parsed("s3://flights/1995/"), expected("flights", "1995"));
        for wrong in [
            "s3://",
            "s3:///key",
            "s3://a b/c",
            "flights/1995",
            "s3://flights/../x",
            "s3://flights//x",
        ] {
            let failure = parsed(wrong).unwrap_err();
            assert!(
                matches!(&failure, RequestFailure::Permanent(what) if what.contains("s3://bucket/prefix")),
                "{wrong}: {failure}"
            );
        }
    }

    #[test]
    fn a_path_in_a_folder_is_no_object() {
        assert!(is_object(Path::new("s3://flights/a.parquet")));
        for file in ["data/s3", "/s3://x", "S3/a.parquet", "s3:/flights"] {
            assert!(!is_object(Path::new(file)), "{file}");
        }
    }

    #[cfg(not(feature = "s3"))]
    #[test]
    fn a_program_without_object_stores_says_which_one_has_them() {
        let failure = list(Path::new("s3://flights")).unwrap_err();
        assert!(failure.to_string().contains("--features s3"), "{failure}");
    }
}
