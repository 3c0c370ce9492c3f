//! Fingerprints of files' contents, remembered from night to night, so that a night with nothing
//! new reads no flight.
//!
//! What is remembered counts only while the file is the same to the file system: device, inode,
//! size, time of last write and time of last change, which no program can set. A file that changed
//! within [`SETTLED`] before it was read is not remembered: it may change again within the tick of
//! the file system's clock. Where the system has no such times (not Unix), every file is read each
//! time.
//!
//! An object is the same while its size and its ETag are: the store's own mark of its content. That
//! holds on every machine, so what is known of objects is shared where the store is
//! ([`Contents::objects`]).

use std::collections::BTreeMap;
use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::fingerprint::{sealed, unsealed};
use super::{Digest, atomic, object};
use crate::error::Result;

/// A file must have been left alone for so long before it was read to be remembered. Clocks of file
/// systems tick at most every two seconds; the rest is for a file server's clock that differs from
/// ours.
const SETTLED: Duration = Duration::from_secs(10);

/// What the file system says of a file's state; as text, so that it is compared and nothing else.
type Stamp = String;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Known {
    stamp: Stamp,
    content: Digest,
}

/// The fingerprints that are known. It can be shared between threads.
#[derive(Debug)]
pub struct Contents {
    path: PathBuf,
    known: BTreeMap<PathBuf, Known>,
    /// What was asked for in this run: the state as read, and what is worth remembering.
    seen: Mutex<BTreeMap<PathBuf, (Stamp, Option<Known>)>>,
}

impl Contents {
    /// What was remembered at `path`; nothing where there is nothing or it is damaged.
    #[must_use]
    pub fn load(path: &Path) -> Contents {
        let known = std::fs::read(path)
            .ok()
            .and_then(|bytes| serde_json::from_slice(unsealed(&bytes)?).ok());
        let known = known.unwrap_or_default();
        Contents {
            path: path.to_owned(),
            known,
            seen: Mutex::default(),
        }
    }

    /// Remembers nothing: every file is read.
    #[must_use]
    pub fn forgetful() -> Contents {
        Contents {
            path: PathBuf::new(),
            known: BTreeMap::new(),
            seen: Mutex::default(),
        }
    }

    /// Adds what others remember of objects, as [`Contents::objects`] gave it; nothing where it is
    /// damaged.
    #[must_use]
    pub fn with_objects(mut self, text: &[u8]) -> Contents {
        let theirs = unsealed(text).and_then(|text| serde_json::from_slice(text).ok());
        let theirs: BTreeMap<PathBuf, Known> = theirs.unwrap_or_default();
        let unknown = theirs
            .into_iter()
            .filter(|(path, _)| object::is_object(path) && !self.known.contains_key(path));
        let unknown: Vec<(PathBuf, Known)> = unknown.collect();
        self.known.extend(unknown);
        self
    }

    /// What is known of objects, as text for other machines; none where nothing of it is new.
    #[must_use]
    pub fn objects(&self) -> Option<Vec<u8>> {
        let now = self.remembered();
        let objects = |known: &BTreeMap<PathBuf, Known>| -> BTreeMap<PathBuf, Known> {
            known
                .iter()
                .filter(|(path, _)| object::is_object(path))
                .map(|(p, k)| (p.clone(), k.clone()))
                .collect()
        };
        let (now, before) = (objects(&now), objects(&self.known));
        (now != before).then(|| sealed(serde_json::to_vec(&now).unwrap_or_default()))
    }

    /// What an object holds; only one that is not known is read.
    fn of_object(&self, path: &Path) -> Result<Digest, String> {
        let about = object::listed(path).map_err(|e| e.to_string())?;
        let stamp = stamp_of(&about.ok_or("is no more")?);
        if let Some(known) = self.known.get(path).filter(|known| known.stamp == stamp) {
            self.see(path, &stamp, Some(known.clone()));
            return Ok(known.content.clone());
        }
        let mut reader = object::Reader::open(path).map_err(|e| e.to_string())?;
        let content = Digest::of(&mut reader).map_err(|e| e.to_string())?;
        let stamp = stamp_of(reader.about());
        let is_marked = reader.about().tag.is_some();
        self.see(
            path,
            &stamp,
            is_marked.then(|| Known {
                stamp: stamp.clone(),
                content: content.clone(),
            }),
        );
        Ok(content)
    }

    /// What a file or an object holds.
    ///
    /// # Errors
    /// The reason in words: no regular file, cannot be read, or changes while it is read.
    pub fn of(&self, path: &Path) -> Result<Digest, String> {
        if object::is_object(path) {
            return self.of_object(path);
        }
        let metadata = std::fs::metadata(path).map_err(|e| format!("cannot be read: {e}"))?;
        // Anything else may block for ever: a pipe that nobody writes into.
        if !metadata.is_file() {
            return Err(if metadata.is_dir() {
                let why = std::fs::read_dir(path)
                    .err()
                    .map_or_else(String::new, |e| format!(" that cannot be read: {e}"));
                format!("is a folder{why}")
            } else {
                "is no regular file".to_owned()
            });
        }
        let before = stamp(&metadata);
        if let (Some(stamp), Some(known)) = (&before, self.known.get(path))
            && known.stamp == *stamp
        {
            self.see(path, stamp, Some(known.clone()));
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
            let known = Known {
                stamp: stamp.clone(),
                content: content.clone(),
            };
            self.see(path, &stamp, is_settled(&after, begun).then_some(known));
        }
        Ok(content)
    }

    /// Whether a file still is as it was when its fingerprint was taken.
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
        // Where there are no stamps there is nothing to compare.
        if cfg!(unix) {
            now.is_some() && now == seen
        } else {
            path.exists()
        }
    }

    /// Writes down what was seen and has settled; what is no more is forgotten.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file.
    pub fn save(&self) -> Result<()> {
        let known = self.remembered();
        if known == self.known {
            return Ok(());
        }
        atomic::place(
            &self.path,
            &sealed(serde_json::to_vec(&known).unwrap_or_default()),
        )
    }

    fn remembered(&self) -> BTreeMap<PathBuf, Known> {
        let seen = self
            .seen
            .lock()
            .map(|seen| seen.clone())
            .unwrap_or_default();
        // Whether an object that was not asked for is still there is not worth a question.
        let is_there = |path: &Path| object::is_object(path) || path.exists();
        let unasked = self
            .known
            .iter()
            .filter(|(path, _)| !seen.contains_key(*path) && is_there(path));
        let mut known: BTreeMap<PathBuf, Known> = unasked
            .map(|(path, known)| (path.clone(), known.clone()))
            .collect();
        known.extend(
            seen.into_iter()
                .filter_map(|(path, (_, known))| Some((path, known?))),
        );
        known
    }

    fn see(&self, path: &Path, stamp: &str, known: Option<Known>) {
        if let Ok(mut seen) = self.seen.lock() {
            seen.insert(path.to_owned(), (stamp.to_owned(), known));
        }
    }
}

fn stamp_of(about: &object::About) -> Stamp {
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

/// Whether the file had been left alone for long enough when reading it began.
#[cfg(unix)]
fn is_settled(metadata: &Metadata, begun: SystemTime) -> bool {
    use std::os::unix::fs::MetadataExt;
    let seconds = metadata.ctime().max(metadata.mtime());
    let changed = UNIX_EPOCH + Duration::from_secs(u64::try_from(seconds).unwrap_or_default());
    // A time of the future is a clock that differs: nothing to rely on.
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
    fn a_file_that_has_just_been_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let (file, cache) = (folder.path().join("f"), folder.path().join("contents.json"));
        std::fs::write(&file, "one").unwrap();
        let contents = Contents::load(&cache);
        let one = contents.of(&file).unwrap();
        assert!(contents.is_unchanged(&file));
        contents.save().unwrap();
        assert!(
            Contents::load(&cache).known.is_empty(),
            "it has not settled"
        );
        std::fs::write(&file, "two").unwrap();
        assert!(!contents.is_unchanged(&file));
        assert_ne!(Contents::load(&cache).of(&file).unwrap(), one);
    }

    #[cfg(unix)]
    #[test]
    fn what_is_remembered_counts_only_while_nothing_about_the_file_changed() {
        let folder = tempfile::tempdir().unwrap();
        let (file, cache) = (folder.path().join("f"), folder.path().join("contents.json"));
        std::fs::write(&file, "one").unwrap();
        let remembered = Digest {
            bytes: 3,
            blake3: "remembered".into(),
        };
        let remember = || {
            let stamp = stamp(&std::fs::metadata(&file).unwrap()).unwrap();
            let known: BTreeMap<PathBuf, Known> = [(
                file.clone(),
                Known {
                    stamp,
                    content: remembered.clone(),
                },
            )]
            .into();
            std::fs::write(&cache, sealed(serde_json::to_vec(&known).unwrap())).unwrap();
        };
        remember();
        assert_eq!(Contents::load(&cache).of(&file).unwrap(), remembered);
        // The same size, and the time of the last write put back: the time of the last change gives
        // it away.
        let written = std::fs::metadata(&file).unwrap().modified().unwrap();
        std::thread::sleep(Duration::from_millis(20));
        std::fs::write(&file, "two").unwrap();
        File::options()
            .write(true)
            .open(&file)
            .unwrap()
            .set_modified(written)
            .unwrap();
        assert_ne!(Contents::load(&cache).of(&file).unwrap(), remembered);
    }

    #[test]
    fn what_is_no_file_is_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        let contents = Contents::forgetful();
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
