//! Digests of input files, remembered from run to run, so that a run with nothing new reads no
//! flight.
//!
//! A remembered digest counts while the file system reports the same device, inode, size, time of
//! last write and time of last change. No program can set the time of last change. A file that
//! changed within [`SETTLED`] before it was read is not remembered: it may change again within a
//! tick of the file system's clock. A system without such times (not Unix) reads every file each
//! time.
//!
//! An object is unchanged while its size and its ETag are. That holds on every machine, so the
//! digests of objects are shared with the store ([`InputDigests::objects`]).

use std::collections::BTreeMap;
use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::fingerprint::{sealed, unsealed};
use super::{Digest, atomic, object, regular};
use crate::error::Result;

/// Shortest time between the last change of a file and its reading, for its digest to be
/// remembered. Clocks of file systems tick every two seconds or faster; the rest allows for the
/// clock of a file server.
const SETTLED: Duration = Duration::from_secs(10);

/// Name under which the digests are sealed.
const SEALED_AS: &str = "contents";

/// State of a file as the file system reports it, as text to be compared.
type Stamp = String;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Remembered {
    stamp: Stamp,
    content: Digest,
}

/// Remembered digests, shared between threads.
#[derive(Debug)]
pub struct InputDigests {
    path: PathBuf,
    remembered: BTreeMap<PathBuf, Remembered>,
    /// Files of this run: their state when read, and the digest to remember, if any.
    seen: Mutex<BTreeMap<PathBuf, (Stamp, Option<Remembered>)>>,
}

impl InputDigests {
    /// Loads the digests saved at `path`; empty for a missing or damaged file.
    #[must_use]
    pub fn load(path: &Path) -> InputDigests {
        let remembered = regular::read(path)
            .ok()
            .and_then(|bytes| serde_json::from_slice(unsealed(SEALED_AS, &bytes)?).ok());
        let remembered = remembered.unwrap_or_default();
        InputDigests {
            path: path.to_owned(),
            remembered,
            seen: Mutex::default(),
        }
    }

    /// No remembered digests: every file is read.
    #[must_use]
    pub fn empty() -> InputDigests {
        InputDigests {
            path: PathBuf::new(),
            remembered: BTreeMap::new(),
            seen: Mutex::default(),
        }
    }

    /// Adds the digests of objects that another machine shared by [`InputDigests::objects`];
    /// damaged text adds nothing.
    #[must_use]
    pub fn with_objects(mut self, text: &[u8]) -> InputDigests {
        let shared = unsealed(SEALED_AS, text).and_then(|text| serde_json::from_slice(text).ok());
        let shared: BTreeMap<PathBuf, Remembered> = shared.unwrap_or_default();
        let unknown = shared
            .into_iter()
            .filter(|(path, _)| object::is_object(path) && !self.remembered.contains_key(path));
        let unknown: Vec<(PathBuf, Remembered)> = unknown.collect();
        self.remembered.extend(unknown);
        self
    }

    /// Digests of objects as text for other machines; `None` if none of them is new.
    #[must_use]
    pub fn objects(&self) -> Option<Vec<u8>> {
        let now = self.to_remember();
        let objects = |known: &BTreeMap<PathBuf, Remembered>| -> BTreeMap<PathBuf, Remembered> {
            known
                .iter()
                .filter(|(path, _)| object::is_object(path))
                .map(|(p, k)| (p.clone(), k.clone()))
                .collect()
        };
        let (now, before) = (objects(&now), objects(&self.remembered));
        let text = || serde_json::to_vec(&now).unwrap_or_default();
        (now != before).then(|| sealed(SEALED_AS, text()))
    }

    /// Digest of an object, which is read unless its digest is remembered.
    fn of_object(&self, path: &Path) -> Result<Digest, String> {
        let about = object::listed(path).map_err(|e| e.to_string())?;
        let stamp = stamp_of(&about.ok_or("is no more")?);
        if let Some(known) = self
            .remembered
            .get(path)
            .filter(|known| known.stamp == stamp)
        {
            self.note(path, &stamp, Some(known.clone()));
            return Ok(known.content.clone());
        }
        let mut reader = object::Reader::open(path).map_err(|e| e.to_string())?;
        let content = Digest::of(&mut reader).map_err(|e| e.to_string())?;
        let stamp = stamp_of(reader.about());
        let is_marked = reader.about().tag.is_some();
        self.note(
            path,
            &stamp,
            is_marked.then(|| Remembered {
                stamp: stamp.clone(),
                content: content.clone(),
            }),
        );
        Ok(content)
    }

    /// Digest of a file or an object.
    ///
    /// # Errors
    /// The reason: no regular file, cannot be read, or changes while it is read.
    pub fn of(&self, path: &Path) -> Result<Digest, String> {
        if object::is_object(path) {
            return self.of_object(path);
        }
        let metadata = std::fs::metadata(path).map_err(|e| format!("cannot be read: {e}"))?;
        // Anything else, such as a pipe, may block for ever.
        if !metadata.is_file() {
            return Err(irregular(path, &metadata));
        }
        let before = stamp(&metadata);
        if let (Some(stamp), Some(known)) = (&before, self.remembered.get(path))
            && known.stamp == *stamp
        {
            self.note(path, stamp, Some(known.clone()));
            return Ok(known.content.clone());
        }
        let begun = SystemTime::now();
        let mut file = File::open(path).map_err(|e| format!("cannot be opened: {e}"))?;
        let content = Digest::of(&mut file).map_err(|e| format!("cannot be read: {e}"))?;
        let after = std::fs::metadata(path).map_err(|e| format!("cannot be read: {e}"))?;
        if stamp(&after) != before {
            return Err(
                "changes while it is read: it is still being copied, the next run will read it"
                    .to_owned(),
            );
        }
        if let Some(stamp) = before {
            let known = Remembered {
                stamp: stamp.clone(),
                content: content.clone(),
            };
            self.note(path, &stamp, is_settled(&after, begun).then_some(known));
        }
        Ok(content)
    }

    /// `true` if a file is unchanged since it was digested.
    #[must_use]
    pub fn is_unchanged(&self, path: &Path) -> bool {
        let of_object = || {
            object::about(path)
                .ok()
                .flatten()
                .map(|about| stamp_of(&about))
        };
        let of_file = || std::fs::metadata(path).ok().and_then(|m| stamp(&m));
        let now = if object::is_object(path) {
            of_object()
        } else {
            of_file()
        };
        let seen = self
            .seen
            .lock()
            .ok()
            .and_then(|seen| seen.get(path).map(|(stamp, _)| stamp.clone()));
        // Other systems report no state to compare.
        if cfg!(unix) {
            now.is_some() && now == seen
        } else {
            path.exists()
        }
    }

    /// Saves the digests of settled files; those of removed files are dropped.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file.
    pub fn save(&self) -> Result<()> {
        let known = self.to_remember();
        if known == self.remembered {
            return Ok(());
        }
        atomic::place(
            &self.path,
            &sealed(SEALED_AS, serde_json::to_vec(&known).unwrap_or_default()),
        )
    }

    fn to_remember(&self) -> BTreeMap<PathBuf, Remembered> {
        let seen = self
            .seen
            .lock()
            .map(|seen| seen.clone())
            .unwrap_or_default();
        // To ask whether an unused object still exists would be a request each.
        let is_there = |path: &Path| object::is_object(path) || path.exists();
        let unasked = self
            .remembered
            .iter()
            .filter(|(path, _)| !seen.contains_key(*path) && is_there(path));
        let mut known: BTreeMap<PathBuf, Remembered> = unasked
            .map(|(path, known)| (path.clone(), known.clone()))
            .collect();
        known.extend(
            seen.into_iter()
                .filter_map(|(path, (_, known))| Some((path, known?))),
        );
        known
    }

    fn note(&self, path: &Path, stamp: &str, known: Option<Remembered>) {
        if let Ok(mut seen) = self.seen.lock() {
            seen.insert(path.to_owned(), (stamp.to_owned(), known));
        }
    }
}

/// Reason for which something that is no regular file cannot be digested.
fn irregular(path: &Path, metadata: &std::fs::Metadata) -> String {
    if !metadata.is_dir() {
        return "is no regular file".to_owned();
    }
    match std::fs::read_dir(path) {
        Err(e) => format!("is a folder that cannot be read: {e}"),
        Ok(_) => {
            "is a folder, or a link to one that is searched already or holds the archive".to_owned()
        }
    }
}

fn stamp_of(about: &object::ObjectInfo) -> Stamp {
    format!(
        "{}:{}",
        about.bytes,
        about.tag.as_deref().unwrap_or_default()
    )
}

#[cfg(unix)]
#[expect(clippy::unnecessary_wraps, reason = "other systems have none")]
fn stamp(metadata: &Metadata) -> Option<Stamp> {
    use std::os::unix::fs::MetadataExt;
    let m = metadata;
    let (dev, ino, size) = (m.dev(), m.ino(), m.size());
    Some(format!(
        "{dev}:{ino}:{size}:{}.{:09}:{}.{:09}",
        m.mtime(),
        m.mtime_nsec(),
        m.ctime(),
        m.ctime_nsec()
    ))
}

#[cfg(not(unix))]
fn stamp(_: &Metadata) -> Option<Stamp> {
    None
}

/// `true` if the file was unchanged for long enough before it was read.
#[cfg(unix)]
fn is_settled(metadata: &Metadata, begun: SystemTime) -> bool {
    use std::os::unix::fs::MetadataExt;
    let seconds = metadata.ctime().max(metadata.mtime());
    let changed = UNIX_EPOCH + Duration::from_secs(u64::try_from(seconds).unwrap_or_default());
    // A time in the future comes from a wrong clock.
    begun.duration_since(changed).is_ok_and(|age| age > SETTLED)
}

#[cfg(not(unix))]
fn is_settled(_: &Metadata, _: SystemTime) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_just_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let (file, cache) = (folder.path().join("f"), folder.path().join("contents.json"));
        std::fs::write(&file, "one").unwrap();
        let contents = InputDigests::load(&cache);
        let one = contents.of(&file).unwrap();
        assert!(contents.is_unchanged(&file));
        contents.save().unwrap();
        assert!(
            InputDigests::load(&cache).remembered.is_empty(),
            "it has not settled"
        );
        std::fs::write(&file, "two").unwrap();
        assert!(!contents.is_unchanged(&file));
        assert_ne!(InputDigests::load(&cache).of(&file).unwrap(), one);
    }

    #[cfg(unix)]
    #[test]
    fn a_remembered_digest_counts_only_while_the_file_is_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let (file, cache) = (folder.path().join("f"), folder.path().join("contents.json"));
        std::fs::write(&file, "one").unwrap();
        let remembered = Digest {
            bytes: 3,
            blake3: "remembered".into(),
        };
        let remember = || {
            let stamp = stamp(&std::fs::metadata(&file).unwrap()).unwrap();
            let known: BTreeMap<PathBuf, Remembered> = [(
                file.clone(),
                Remembered {
                    stamp,
                    content: remembered.clone(),
                },
            )]
            .into();
            std::fs::write(
                &cache,
                sealed(SEALED_AS, serde_json::to_vec(&known).unwrap()),
            )
            .unwrap();
        };
        remember();
        assert_eq!(InputDigests::load(&cache).of(&file).unwrap(), remembered);
        // Same size and time of last write: the time of last change reveals the edit.
        let written = std::fs::metadata(&file).unwrap().modified().unwrap();
        std::thread::sleep(Duration::from_millis(20));
        std::fs::write(&file, "two").unwrap();
        File::options()
            .write(true)
            .open(&file)
            .unwrap()
            .set_modified(written)
            .unwrap();
        assert_ne!(InputDigests::load(&cache).of(&file).unwrap(), remembered);
    }

    #[test]
    fn a_path_that_is_no_file_is_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        let contents = InputDigests::empty();
        assert!(
            contents
                .of(folder.path())
                .unwrap_err()
                .contains("is a folder")
        );
        assert!(
            contents
                .of(&folder.path().join("none"))
                .unwrap_err()
                .contains("cannot be read")
        );
    }
}
