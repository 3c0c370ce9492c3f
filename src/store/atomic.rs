//! Files that appear whole or not at all: written under a temporary name beside their place,
//! synced, then renamed.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread;

use super::{Digest, regular};
use crate::error::{Error, Result};

/// Prefix of temporary files, by which those of a killed run are found.
pub const TEMPORARY: &str = ".harvest-";

/// Places `bytes` at `path`, creating folders as needed. A file with these bytes is left untouched.
///
/// # Errors
/// [`Error::Io`] naming the path.
pub fn place(path: &Path, bytes: &[u8]) -> Result<()> {
    if regular::read(path).is_ok_and(|present| present == bytes) {
        return Ok(());
    }
    let mut draft = Draft::create(path)?;
    draft
        .file
        .write_all(bytes)
        .map_err(Error::io(path, "cannot write it"))?;
    draft.place()
}

/// A file being written beside its place. A draft that is dropped leaves nothing.
#[derive(Debug)]
pub struct Draft {
    file: tempfile::NamedTempFile,
    written: blake3::Hasher,
    path: PathBuf,
}

/// Writer of a draft that digests the bytes as they pass.
struct Digesting<'d> {
    file: &'d mut fs::File,
    written: &'d mut blake3::Hasher,
}

impl Write for Digesting<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.written.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Draft {
    /// Creates a temporary file that is to be at `path`, and the folders of `path` as needed.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder.
    pub fn create(path: &Path) -> Result<Draft> {
        let folder = path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(Error::io(folder, "cannot create the folder"))?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY);
        // A temporary file is private to its owner; published files are for everybody to read.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
        let file = builder
            .tempfile_in(folder)
            .map_err(Error::io(folder, "cannot create a file in it"))?;
        Ok(Draft {
            file,
            written: blake3::Hasher::new(),
            path: path.to_owned(),
        })
    }

    /// Writer into the draft.
    pub fn writer(&mut self) -> impl Write + Send {
        let through = Digesting {
            file: self.file.as_file_mut(),
            written: &mut self.written,
        };
        std::io::BufWriter::with_capacity(1 << 20, through)
    }

    /// A handle of the draft for a writer of its own, whose bytes [`Draft::digest`] does not count.
    ///
    /// # Errors
    /// [`Error::Io`]: the system has no further handle.
    pub fn handle(&self) -> Result<fs::File> {
        let handle = self.file.as_file().try_clone();
        handle.map_err(Error::io(&self.path, "cannot write it"))
    }

    /// Path at which the file is to be.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Digest of the bytes written so far.
    #[must_use]
    pub fn digest(&self) -> Digest {
        Digest::so_far(&self.written)
    }

    /// Path of the draft until it is placed.
    #[must_use]
    pub fn draft(&self) -> &Path {
        self.file.path()
    }

    /// Does `work` while the disk takes what is in the draft, so that placing it waits less.
    ///
    /// # Errors
    /// [`Error::Io`] naming the path.
    pub fn sync_during<T>(&self, work: impl FnOnce() -> T) -> Result<T> {
        thread::scope(|scope| {
            let syncing = thread::Builder::new().spawn_scoped(scope, || self.sync());
            let done = work();
            // Without this thread placing the draft syncs it.
            if let Ok(syncing) = syncing {
                syncing.join().unwrap_or(Ok(()))?;
            }
            Ok(done)
        })
    }

    fn sync(&self) -> Result<()> {
        let synced = self.file.as_file().sync_all();
        synced.map_err(Error::io(&self.path, "cannot write it to the disk"))
    }

    /// Puts the whole file in its place.
    ///
    /// # Errors
    /// [`Error::Io`] naming the path.
    pub fn place(self) -> Result<()> {
        self.sync()?;
        let placed = self.file.persist(&self.path).or_else(|e| {
            // An empty folder at its path may be removed.
            let _ = fs::remove_dir(&self.path);
            e.file.persist(&self.path)
        });
        placed.map_err(|e| Error::io(&self.path, "cannot put it in its place")(e.error))?;
        Ok(())
    }
}

/// Removes a file, if there is one.
///
/// # Errors
/// [`Error::Io`] naming the path.
pub fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::io(path, "cannot remove it")(e))
        }
        _ => Ok(()),
    }
}

/// Syncs the names in a folder to the disk: after a loss of power no later rename survives without
/// the earlier ones.
///
/// # Errors
/// [`Error::Io`] naming the folder.
pub fn sync_folder(folder: &Path) -> Result<()> {
    // Only Unix opens a folder as a file.
    if cfg!(unix) {
        let synced = fs::File::open(folder).and_then(|f| f.sync_all());
        synced.map_err(Error::io(folder, "cannot write the folder to the disk"))?;
    }
    Ok(())
}

/// Removes the temporary files of a killed run from a folder.
///
/// # Errors
/// [`Error::Io`] when a leftover cannot be removed.
pub fn sweep(folder: &Path) -> Result<()> {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            let path = entry.path();
            let is_folder = entry.file_type().is_ok_and(|t| t.is_dir());
            let removed = if is_folder {
                fs::remove_dir_all(&path)
            } else {
                fs::remove_file(&path)
            };
            removed.map_err(Error::io(&path, "cannot remove a leftover"))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_bytes_leave_the_file_untouched_and_other_bytes_replace_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.csv");
        place(&path, b"one").unwrap();
        let before = fs::metadata(&path).unwrap().modified().unwrap();
        place(&path, b"one").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), before);
        place(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
    }

    #[test]
    fn a_drafts_digest_is_the_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record.parquet");
        let mut draft = Draft::create(&path).unwrap();
        let mut writer = draft.writer();
        for part in [vec![1; 3_000_000], vec![], vec![2; 17]] {
            writer.write_all(&part).unwrap();
        }
        writer.flush().unwrap();
        drop(writer);
        let digest = draft.digest();
        draft.place().unwrap();
        assert_eq!(digest, Digest::of_file(&path).unwrap());
        assert_eq!(digest.bytes, 3_000_017);
    }

    #[test]
    fn leftovers_of_a_killed_run_are_swept_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(format!("{TEMPORARY}xyz")), "half").unwrap();
        fs::write(folder.path().join("kept.json"), "whole").unwrap();
        sweep(folder.path()).unwrap();
        assert!(folder.path().join("kept.json").exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
