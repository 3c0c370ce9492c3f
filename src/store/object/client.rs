//! The connection to a bucket: requests of the `object_store` crate, each awaited by its thread.
//!
//! The crate retries with backoff for up to half a minute. After [`SILENT_REQUESTS`] requests in a
//! row without an answer, this run makes no more. A dead endpoint thus costs one minute, and not
//! one for each flight.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::list::{PaginatedListOptions, PaginatedListStore};
use object_store::path::Path as Key;
use object_store::{
    BackoffConfig, Error, GetOptions, GetRange, MultipartUpload, ObjectMeta, ObjectStore,
    ObjectStoreExt, RetryConfig,
};
use tokio::runtime::Runtime;

use super::failure::{ObjectInfo, RequestFailure};

/// Requests in a row without an answer after which the endpoint counts as dead.
const SILENT_REQUESTS: usize = 3;

/// Time after which a failed request is not repeated. A repetition that began earlier may take as
/// long again.
const PATIENCE: Duration = Duration::from_secs(25);

const ENDPOINTS: [&str; 3] = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"];

/// Other sources of credentials than a key and its secret. Without any the crate would ask the
/// metadata service of Amazon's cloud, which does not exist elsewhere.
const CREDENTIALS: [&str; 4] = [
    "AWS_WEB_IDENTITY_TOKEN_FILE",
    "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
    "AWS_SKIP_SIGNATURE",
];

pub struct Client {
    runtime: Runtime,
    store: AmazonS3,
    bucket: String,
    /// Name in messages.
    endpoint: String,
    /// Remembered entries of listings.
    listed: Mutex<BTreeMap<String, ObjectInfo>>,
    failures: Mutex<FailedRequests>,
}

/// Failed requests of this run.
#[derive(Default)]
struct FailedRequests {
    silent: usize,
    /// Keys whose request failed, with the reason.
    failed: BTreeMap<String, String>,
}

impl std::fmt::Debug for Client {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // The other fields hold credentials.
        f.debug_struct("Client")
            .field("bucket", &self.bucket)
            .field("endpoint", &self.endpoint)
            .finish_non_exhaustive()
    }
}

#[expect(
    clippy::unnecessary_wraps,
    reason = "as where there are no object stores"
)]
pub fn available() -> Result<(), RequestFailure> {
    Ok(())
}

fn set(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

/// Fault of the environment: something missing or contradictory.
fn refuse_environment() -> Result<(), RequestFailure> {
    let has_key = set("AWS_ACCESS_KEY_ID").is_some() && set("AWS_SECRET_ACCESS_KEY").is_some();
    if !has_key && !CREDENTIALS.iter().any(|name| set(name).is_some()) {
        let what = "no credentials in the environment: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (and AWS_REGION, \
                    AWS_SESSION_TOKEN, AWS_ENDPOINT_URL where they are needed)";
        return Err(RequestFailure::Permanent(what.to_owned()));
    }
    let allowed = set("AWS_ALLOW_HTTP")
        .is_some_and(|v| matches!(v.to_lowercase().as_str(), "true" | "1" | "yes" | "on"));
    match ENDPOINTS.iter().find_map(|name| set(name)) {
        Some(endpoint) if endpoint.starts_with("http://") && !allowed => {
            Err(RequestFailure::Permanent(format!(
                "the endpoint {endpoint} is not encrypted: use https, or set AWS_ALLOW_HTTP=true in a trusted network"
            )))
        }
        _ => Ok(()),
    }
}

/// Messages of an error and its causes, each once.
fn error_messages(error: &dyn std::error::Error) -> Vec<String> {
    std::iter::successors(Some(error), |e| e.source())
        .map(ToString::to_string)
        .collect()
}

/// S3's code of an error.
fn code(text: &str) -> Option<&str> {
    text.split_once("<Code>")?
        .1
        .split_once("</Code>")
        .map(|(code, _)| code)
}

/// Retries of a request.
fn retries() -> RetryConfig {
    RetryConfig {
        max_retries: 6,
        retry_timeout: PATIENCE,
        backoff: BackoffConfig {
            max_backoff: Duration::from_secs(5),
            ..BackoffConfig::default()
        },
    }
}

/// Endpoint of the environment, for messages.
fn endpoint() -> String {
    let region = || {
        set("AWS_REGION")
            .or_else(|| set("AWS_DEFAULT_REGION"))
            .unwrap_or("us-east-1".to_owned())
    };
    let stated = ENDPOINTS.iter().find_map(|name| set(name));
    stated.unwrap_or_else(|| format!("Amazon S3 in {}", region()))
}

impl Client {
    /// Opens a bucket with the environment's settings.
    pub fn open(bucket: &str) -> Result<Client, RequestFailure> {
        refuse_environment()?;
        let store = AmazonS3Builder::from_env()
            .with_bucket_name(bucket)
            .with_retry(retries())
            .build();
        let store = store.map_err(|e| {
            RequestFailure::Permanent(format!(
                "cannot connect with the environment's AWS_ variables: {}",
                error_messages(&e).join(": ")
            ))
        })?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime =
            runtime.map_err(|e| RequestFailure::Transient(format!("cannot connect: {e}")))?;
        Ok(Client {
            runtime,
            store,
            bucket: bucket.to_owned(),
            endpoint: endpoint(),
            listed: Mutex::default(),
            failures: Mutex::default(),
        })
    }

    /// Awaits the answer to a request about a key; `None` if there is no such object.
    fn ask<T>(
        &self,
        key: &str,
        request: impl Future<Output = Result<T, Error>>,
    ) -> Result<Option<T>, RequestFailure> {
        let failures = || self.failures.lock().unwrap_or_else(PoisonError::into_inner);
        let unanswered = |what: String| {
            failures().failed.insert(key.to_owned(), what.clone());
            RequestFailure::Transient(what)
        };
        if failures().silent >= SILENT_REQUESTS {
            return Err(unanswered(format!(
                "{} did not answer {SILENT_REQUESTS} requests in a row and is not asked again; run again when it does",
                self.endpoint
            )));
        }
        let error = match self.runtime.block_on(request) {
            Ok(answer) => {
                failures().silent = 0;
                return Ok(Some(answer));
            }
            Err(error) => error,
        };
        match self.classify(&error) {
            RequestError::Missing => {
                failures().silent = 0;
                Ok(None)
            }
            RequestError::Refused(failure) => {
                failures().silent = 0;
                failures()
                    .failed
                    .insert(key.to_owned(), failure.to_string());
                Err(failure)
            }
            RequestError::Nothing(what) => {
                failures().silent += 1;
                Err(unanswered(what))
            }
        }
    }

    /// Classifies the error of a request.
    fn classify(&self, error: &Error) -> RequestError {
        let (error_messages, endpoint, bucket) =
            (error_messages(error), &self.endpoint, &self.bucket);
        let text = error_messages.join("\n");
        let code = code(&text);
        let status = text
            .split_once("status code: ")
            .map(|(_, rest)| rest.get(..3).unwrap_or_default());
        let said = code
            .map(str::to_owned)
            .or(status.map(|s| format!("status {s}")))
            .unwrap_or_default();
        let refused = |what: String| RequestError::Refused(RequestFailure::Permanent(what));
        match (error, status) {
            _ if code == Some("NoSuchBucket") => refused(format!(
                "there is no bucket `{bucket}` at {endpoint}: create it, or name another"
            )),
            (Error::NotFound { .. }, _) | (_, Some("404")) => RequestError::Missing,
            (Error::Precondition { .. }, _) => RequestError::Refused(RequestFailure::Transient(
                "was replaced while it was read; the next run will read it".to_owned(),
            )),
            (Error::PermissionDenied { .. } | Error::Unauthenticated { .. }, _)
            | (_, Some("401" | "403")) => refused(format!(
                "{endpoint} denies it ({said}): look at AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN \
                     in the environment, at AWS_REGION, and at what they may do in bucket `{bucket}`"
            )),
            (_, Some(status)) if status.starts_with(['3', '4']) => refused(format!(
                "{endpoint} refuses the request ({said}): look at AWS_REGION and AWS_ENDPOINT_URL in the environment"
            )),
            _ => {
                let last = error_messages
                    .last()
                    .map(String::as_str)
                    .unwrap_or_default();
                let said = if said.is_empty() {
                    last.to_owned()
                } else {
                    said
                };
                RequestError::Nothing(format!(
                    "{endpoint} does not answer ({said}): look at AWS_ENDPOINT_URL and AWS_REGION in the environment, and at \
                     the network"
                ))
            }
        }
    }

    fn key(key: &str) -> Result<Key, RequestFailure> {
        Key::parse(key).map_err(|e| RequestFailure::Permanent(format!("no key of an object: {e}")))
    }

    pub fn failed(&self, key: &str) -> Option<String> {
        self.failures
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .failed
            .get(key)
            .cloned()
    }

    /// Lists the objects whose keys begin with a prefix.
    pub fn list(&self, prefix: &str) -> Result<BTreeMap<String, ObjectInfo>, RequestFailure> {
        let (mut found, mut page_token) = (BTreeMap::new(), None);
        loop {
            let options = PaginatedListOptions {
                page_token,
                ..PaginatedListOptions::default()
            };
            let prefix = (!prefix.is_empty()).then_some(prefix);
            let page = self.ask(
                prefix.unwrap_or_default(),
                self.store.list_paginated(prefix, options),
            )?;
            let Some(page) = page else {
                let what = format!(
                    "there is no bucket `{}` at {}: create it, or name another",
                    self.bucket, self.endpoint
                );
                return Err(RequestFailure::Permanent(what));
            };
            found.extend(
                page.result
                    .objects
                    .into_iter()
                    .map(|o| (o.location.to_string(), about(&o))),
            );
            page_token = page.page_token;
            if page_token.is_none() {
                return Ok(found);
            }
        }
    }

    pub fn remember(&self, key: String, about: ObjectInfo) {
        self.listed
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .insert(key, about);
    }

    pub fn listed(&self, key: &str) -> Option<ObjectInfo> {
        self.listed
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(key)
            .cloned()
    }

    pub fn about(&self, key: &str) -> Result<Option<ObjectInfo>, RequestFailure> {
        let path = Self::key(key)?;
        Ok(self.ask(key, self.store.head(&path))?.as_ref().map(about))
    }

    pub fn get(&self, key: &str) -> Result<Option<Bytes>, RequestFailure> {
        let path = Self::key(key)?;
        self.ask(key, async { self.store.get(&path).await?.bytes().await })
    }

    /// Reads a range of an object whose content has this tag.
    pub fn range(
        &self,
        key: &str,
        range: Range<u64>,
        tag: Option<&str>,
    ) -> Result<Bytes, RequestFailure> {
        let path = Self::key(key)?;
        let expected = range.end - range.start;
        let options = GetOptions {
            range: Some(GetRange::Bounded(range)),
            if_match: tag.map(str::to_owned),
            ..GetOptions::default()
        };
        let bytes = self.ask(key, async {
            self.store.get_opts(&path, options).await?.bytes().await
        })?;
        let gone = || {
            RequestFailure::Transient(
                "vanished while it was read; the next run will report it".to_owned(),
            )
        };
        let bytes = bytes.ok_or_else(gone)?;
        if bytes.len() as u64 == expected {
            return Ok(bytes);
        }
        Err(RequestFailure::Transient(format!(
            "gave {} bytes where {expected} were asked for",
            bytes.len()
        )))
    }

    pub fn put(&self, key: &str, bytes: Vec<u8>) -> Result<(), RequestFailure> {
        let path = Self::key(key)?;
        self.written(self.ask(key, self.store.put(&path, bytes.into()))?)
            .map(|_| ())
    }

    pub fn remove(&self, key: &str) -> Result<(), RequestFailure> {
        let path = Self::key(key)?;
        self.ask(key, self.store.delete(&path)).map(|_| ())
    }

    /// Puts an object in parts until one is empty. The object appears with the last part.
    pub fn put_parts(
        &self,
        key: &str,
        first: Vec<u8>,
        next: &mut dyn FnMut() -> Result<Vec<u8>, RequestFailure>,
    ) -> Result<(), RequestFailure> {
        let path = Self::key(key)?;
        let upload = self.ask(key, self.store.put_multipart(&path))?;
        let mut upload = self.written(upload)?;
        let sent = self.send_parts(key, first, next, &mut *upload);
        if sent.is_err() {
            // Lifecycle rules of the bucket remove parts that cannot be aborted.
            let _ = self.runtime.block_on(upload.abort());
        }
        sent
    }

    fn send_parts(
        &self,
        key: &str,
        first: Vec<u8>,
        next: &mut dyn FnMut() -> Result<Vec<u8>, RequestFailure>,
        upload: &mut dyn MultipartUpload,
    ) -> Result<(), RequestFailure> {
        let mut part = first;
        while !part.is_empty() {
            self.written(self.ask(key, upload.put_part(part.into()))?)?;
            part = next()?;
        }
        self.written(self.ask(key, upload.complete())?).map(|_| ())
    }

    /// Result of a write: the answer `not found` means that the bucket is missing.
    fn written<T>(&self, answer: Option<T>) -> Result<T, RequestFailure> {
        let what = || {
            format!(
                "there is no bucket `{}` at {}: create it, or name another",
                self.bucket, self.endpoint
            )
        };
        answer.ok_or_else(|| RequestFailure::Permanent(what()))
    }
}

/// Kind of a failed request.
enum RequestError {
    Missing,
    Refused(RequestFailure),
    /// No answer, or none that could be parsed.
    Nothing(String),
}

fn about(object: &ObjectMeta) -> ObjectInfo {
    ObjectInfo {
        bytes: object.size,
        tag: object.e_tag.clone(),
    }
}
