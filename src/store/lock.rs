//! Locks for one run at a time or for several shards, with a note of the holder.
//!
//! The lock belongs to the operating system and ends with the process that holds it. A dead process
//! blocks nobody, even if the note still names it. A shared file system may extend the lock to
//! other machines; on one without locks every run proceeds. The lock only prevents wasted work. An
//! artefact's name is the fingerprint of everything that determines it, and it appears whole by a
//! rename. Two runs that compute the same artefact write the same bytes. A run whose temporary file
//! another run removes has to try again.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use super::log::timestamp;
use crate::error::{Error, Result};

/// Interval at which a waiting run tries again.
const RETRY_INTERVAL: Duration = Duration::from_millis(100);

/// Longest note of a holder, bytes; a longer file is no note.
const LONGEST_NOTE: u64 = 1000;

/// A held lock, released when it is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
}

impl Lock {
    /// Takes the lock at `path` alone, waiting for it up to `wait`, and writes the holder's note.
    /// `what` names the locked thing in messages.
    ///
    /// # Errors
    /// [`Error::Busy`] naming the holder, [`Error::Io`] when the disk fails.
    pub fn take(path: &Path, what: &str, wait: Duration) -> Result<Lock> {
        let mut lock = Lock::acquire(path, what, wait, File::try_lock)?;
        // The note is only information: a disk too full for it stops no run.
        let note = format!(
            "pid {} on {} since {}\n",
            std::process::id(),
            host_name(),
            timestamp(SystemTime::now())
        );
        let file = &mut lock.file;
        let _ = file
            .set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(note.as_bytes()));
        Ok(lock)
    }

    /// Takes a share of the lock at `path`; others may hold shares, but none the lock alone.
    ///
    /// # Errors
    /// As [`Lock::take`].
    pub fn share(path: &Path, what: &str, wait: Duration) -> Result<Lock> {
        Lock::acquire(path, what, wait, File::try_lock_shared)
    }

    /// `true` while any process holds the lock at `path`, alone or shared.
    #[must_use]
    pub fn is_held(path: &Path) -> bool {
        File::open(path).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }

    fn acquire(
        path: &Path,
        what: &str,
        wait: Duration,
        lock: fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Lock> {
        let folder = path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "cannot create the folder"))?;
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(Error::io(path, "cannot create it"))?;
        let patience = Instant::now() + wait;
        loop {
            match lock(&file) {
                Ok(()) => break,
                Err(TryLockError::WouldBlock) if Instant::now() < patience => {
                    std::thread::sleep(RETRY_INTERVAL);
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::Busy {
                        path: folder.to_owned(),
                        what: holder_message(&mut file, what),
                    });
                }
                Err(TryLockError::Error(e)) if lacks_locks(&e) => break,
                Err(TryLockError::Error(e)) => return Err(Error::io(path, "cannot lock it")(e)),
            }
        }
        Ok(Lock { file })
    }
}

/// `true` for the error of a file system without locks: not supported, or no lock manager (Linux's
/// `ENOLCK`).
fn lacks_locks(error: &std::io::Error) -> bool {
    error.kind() == std::io::ErrorKind::Unsupported
        || cfg!(target_os = "linux") && error.raw_os_error() == Some(37)
}

fn holder_message(file: &mut File, what: &str) -> String {
    let mut note = String::new();
    let read = file
        .rewind()
        .and_then(|()| file.take(LONGEST_NOTE).read_to_string(&mut note));
    let note = note.trim();
    let who = if read.is_err() || note.is_empty() {
        String::new()
    } else {
        format!(" ({note})")
    };
    format!(
        "another run is using this {what}{who}; let harvest wait for it with --wait, or give another --{what}"
    )
}

/// Name of the machine.
fn host_name() -> String {
    let name = ["/proc/sys/kernel/hostname", "/etc/hostname"]
        .into_iter()
        .find_map(|f| std::fs::read_to_string(f).ok());
    let name = name
        .or_else(|| std::env::var("HOSTNAME").ok())
        .unwrap_or_default();
    let name = name.trim();
    if name.is_empty() {
        "this machine".to_owned()
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_run_is_refused_with_the_holder_s_name_until_the_lock_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        std::fs::write(&path, "pid 1 on a machine that is no more\n").unwrap();
        let first = Lock::take(&path, "store", Duration::ZERO).unwrap();
        let second = Lock::take(&path, "store", Duration::from_millis(150))
            .unwrap_err()
            .to_string();
        let who = format!(
            "another run is using this store (pid {} on ",
            std::process::id()
        );
        assert!(
            second.contains(&who) && !second.contains("no more"),
            "{second}"
        );
        drop(first);
        Lock::take(&path, "store", Duration::ZERO).unwrap();
    }

    #[test]
    fn shares_exclude_only_a_whole_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let shares = [(); 3].map(|()| Lock::share(&path, "store", Duration::ZERO).unwrap());
        assert!(Lock::take(&path, "store", Duration::ZERO).is_err());
        drop(shares);
        let whole = Lock::take(&path, "store", Duration::ZERO).unwrap();
        assert!(Lock::share(&path, "store", Duration::ZERO).is_err());
        drop(whole);
        Lock::share(&path, "store", Duration::ZERO).unwrap();
    }

    #[test]
    fn a_waiting_run_gets_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let first = Lock::take(&path, "store", Duration::ZERO).unwrap();
        std::thread::scope(|scope| {
            let second =
                scope.spawn(|| Lock::take(&path, "store", Duration::from_mins(1)).map(|_| ()));
            std::thread::sleep(Duration::from_millis(20));
            drop(first);
            assert!(second.join().unwrap().is_ok());
        });
    }
}
