//! Addresses of objects: bucket, key and the connection to the bucket.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

use super::client::Client;
use super::failure::RequestFailure;

pub(super) const SCHEME: &str = "s3://";

/// `true` for the path of an object or of a prefix.
#[must_use]
pub fn is_object(path: &Path) -> bool {
    path.to_str().is_some_and(|text| text.starts_with(SCHEME))
}

/// Splits a path into bucket and key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Address {
    pub(super) bucket: String,
    pub(super) key: String,
}

impl Address {
    pub(super) fn parse(path: &Path) -> Result<Address, RequestFailure> {
        let text = path.to_string_lossy();
        let wrong =
            |what: &str| RequestFailure::Permanent(format!("{what}; expected s3://bucket/prefix"));
        let rest = text
            .strip_prefix(SCHEME)
            .ok_or_else(|| wrong("not in an object store"))?;
        let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
        let is_name = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
        if bucket.is_empty() || !bucket.chars().all(is_name) {
            return Err(wrong(&format!(
                "`{bucket}` is not a valid name of a bucket"
            )));
        }
        let key = key.trim_end_matches('/');
        if key.split('/').any(|part| matches!(part, "." | ".."))
            || key.contains("//")
            || key.starts_with('/')
        {
            return Err(wrong(&format!(
                "`{key}` is not a valid key: each of its parts needs a name"
            )));
        }
        Ok(Address {
            bucket: bucket.to_owned(),
            key: key.to_owned(),
        })
    }

    pub(super) fn client(&self) -> Result<Arc<Client>, RequestFailure> {
        // Connections last as long as the process, like its environment.
        static OPENED: OnceLock<Mutex<BTreeMap<String, Arc<Client>>>> = OnceLock::new();
        let mut opened = OPENED
            .get_or_init(Mutex::default)
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(client) = opened.get(&self.bucket) {
            return Ok(client.clone());
        }
        let client = Arc::new(Client::open(&self.bucket)?);
        opened.insert(self.bucket.clone(), client.clone());
        Ok(client)
    }
}

/// Client of an object's bucket, and the object's key.
pub(super) fn at(path: &Path) -> Result<(Arc<Client>, String), RequestFailure> {
    let address = Address::parse(path)?;
    Ok((address.client()?, address.key))
}
