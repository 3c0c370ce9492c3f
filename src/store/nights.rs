//! Published nights, each in a folder of its own, and the name of the current one.
//!
//! ```text
//! reports/harv/nights/0007/   all files of one night, with its manifest night.json
//! reports/harv/current        → nights/0007
//! reports/harv/fits.csv       → current/fits.csv, and so on
//! ```
//!
//! A night is written beside the others under a temporary name, synced and renamed; then `current`
//! is replaced by one rename. All paths change with it at once, so a reader sees the files of one
//! night. A reader of several files follows `current` once and stays in that folder. Without
//! symbolic links (not Unix), `current` is a text file and the files beside it are copies.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::atomic;
use super::fingerprint::Digest;
use super::lock::Lock;
use super::night_links::{self as link, CURRENT};
use super::night_manifest::{MANIFEST, Night, digests, write_manifest};
use super::regular;
use crate::error::{Error, Result};

const NIGHTS: &str = "nights";

/// The nights of a folder of reports.
#[derive(Debug)]
pub struct Nights {
    reports: PathBuf,
    _lock: Option<Lock>,
}

impl Nights {
    /// Opens a folder of reports to publish in, waiting up to `wait` for another run. Completes the
    /// work of a killed run: a whole night becomes current, temporary files are removed.
    ///
    /// # Errors
    /// [`Error::Busy`] when another run publishes there, [`Error::Io`] when the disk fails.
    pub fn open(reports: &Path, wait: Duration) -> Result<Nights> {
        let lock = Lock::take(&reports.join(NIGHTS).join("lock"), "reports", wait)?;
        let nights = Nights {
            reports: reports.to_owned(),
            _lock: Some(lock),
        };
        atomic::sweep(reports)?;
        atomic::sweep(&reports.join(NIGHTS))?;
        if let Some(newest) = nights
            .names()
            .iter()
            .rev()
            .find_map(|name| nights.night(name))
        {
            nights.make_current(&newest)?;
        }
        Ok(nights)
    }

    /// The nights of a folder to read without a lock; the folder need not exist.
    #[must_use]
    pub fn read_only(reports: &Path) -> Nights {
        Nights {
            reports: reports.to_owned(),
            _lock: None,
        }
    }

    /// Manifest of the current night.
    #[must_use]
    pub fn current(&self) -> Option<Night> {
        self.night(&self.current_name()?)
    }

    /// Name of the current night, if its manifest is missing or damaged.
    #[must_use]
    pub fn damaged_current(&self) -> Option<String> {
        let name = self.current_name()?;
        self.night(&name).is_none().then_some(name)
    }

    /// Manifest of the last complete night.
    #[must_use]
    pub fn complete(&self) -> Option<Night> {
        self.names()
            .iter()
            .rev()
            .filter_map(|name| self.night(name))
            .find(Night::is_complete)
    }

    /// Manifest of a night; `None` if it is missing or damaged.
    #[must_use]
    pub fn night(&self, name: &str) -> Option<Night> {
        let night: Night =
            serde_json::from_slice(&regular::read(&self.folder(name).join(MANIFEST)).ok()?).ok()?;
        (night.clone().sealed() == night).then_some(night)
    }

    /// Manifest of the night of this name, given with or without leading zeros.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<Night> {
        spellings(name).iter().find_map(|name| self.night(name))
    }

    /// Name of the night, damaged or not, of this name, given with or without leading zeros.
    #[must_use]
    pub fn full_name(&self, name: &str) -> Option<String> {
        let names = self.names();
        let spellings = spellings(name);
        spellings.into_iter().find(|name| names.contains(name))
    }

    /// Folder of a night.
    #[must_use]
    pub fn folder(&self, name: &str) -> PathBuf {
        self.reports.join(NIGHTS).join(name)
    }

    /// Names of all nights, the oldest first.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.reports.join(NIGHTS))
            .into_iter()
            .flatten()
            .flatten();
        let mut names: Vec<String> = entries
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.retain(|name| name.parse::<u32>().is_ok());
        names.sort_by_key(|name| name.parse::<u32>().unwrap_or_default());
        names
    }

    /// `true` if all files of a night are unchanged since they were published.
    #[must_use]
    pub fn is_intact(&self, night: &Night) -> bool {
        self.damaged(night).is_empty()
    }

    /// Files of a night that differ from what was published.
    #[must_use]
    pub fn damaged(&self, night: &Night) -> Vec<String> {
        let folder = self.folder(&night.name);
        let is_intact = |(name, digest): &(&String, &Digest)| {
            Digest::of_file(&folder.join(name)).is_ok_and(|found| found == **digest)
        };
        night
            .files
            .iter()
            .filter(|file| !is_intact(file))
            .map(|(name, _)| name.clone())
            .collect()
    }

    /// Files of the current night in whose place another file stands in the folder of reports; none for
    /// another night.
    #[must_use]
    pub fn replaced(&self, night: &Night) -> Vec<String> {
        if self.current_name().as_ref() != Some(&night.name) {
            return Vec::new();
        }
        let names = night.files.keys();
        names
            .filter(|name| !link::is_placed(&self.reports, &self.folder(&night.name), name))
            .cloned()
            .collect()
    }

    fn tonight_folder(&self) -> PathBuf {
        self.folder(&format!("{}tonight", atomic::TEMPORARY))
    }

    /// Creates an empty folder for tonight's files.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder.
    pub fn tonight(&self) -> Result<PathBuf> {
        let folder = self.tonight_folder();
        if folder.exists() {
            fs::remove_dir_all(&folder).map_err(Error::io(&folder, "cannot remove a leftover"))?;
        }
        fs::create_dir_all(&folder).map_err(Error::io(&folder, "cannot create the folder"))?;
        Ok(folder)
    }

    /// Removes tonight's folder.
    pub fn remove_tonight(&self) {
        let _ = fs::remove_dir_all(self.tonight_folder());
    }

    /// Publishes tonight's folder as `night`, whose name and files are filled in, and removes the
    /// nights before the last `keep` complete ones.
    ///
    /// # Errors
    /// [`Error::Io`] when the disk fails; then the night before stays current.
    pub fn publish(&self, night: Night, keep: usize) -> Result<Night> {
        let tonight = self.tonight_folder();
        let last = self
            .names()
            .last()
            .and_then(|name| name.parse::<u32>().ok())
            .unwrap_or(0);
        let night = Night {
            name: format!("{:04}", last + 1),
            files: digests(&tonight)?,
            ..night
        }
        .sealed();
        write_manifest(&tonight, &night)?;
        atomic::sync_folder(&tonight)?;
        let folder = self.folder(&night.name);
        fs::rename(&tonight, &folder)
            .map_err(Error::io(&folder, "cannot put the night in its place"))?;
        atomic::sync_folder(&self.reports.join(NIGHTS))?;
        self.make_current(&night)?;
        self.prune(keep)?;
        Ok(night)
    }

    /// Restores the damaged files of a night from tonight's folder, which was made of the same
    /// lineage. `None` if tonight's files differ: published files are never replaced by others.
    ///
    /// # Errors
    /// [`Error::Io`] when the disk fails.
    pub fn restore(&self, night: &Night) -> Result<Option<Night>> {
        let tonight = self.tonight_folder();
        if digests(&tonight)? != night.files {
            return Ok(None);
        }
        let folder = self.folder(&night.name);
        for name in self.damaged(night) {
            let path = tonight.join(&name);
            let bytes = fs::read(&path).map_err(Error::io(&path, "cannot read it"))?;
            atomic::place(&folder.join(&name), &bytes)?;
        }
        self.remove_tonight();
        self.make_current(night)?;
        Ok(Some(night.clone()))
    }

    /// Nights that [`Nights::prune`] removes: complete ones before the last `keep`, and incomplete
    /// ones that are not current.
    #[must_use]
    pub fn superfluous(&self, keep: usize) -> Vec<String> {
        let current = self.current_name();
        let mut kept = 0;
        let mut superfluous = Vec::new();
        for name in self.names().into_iter().rev() {
            let is_current = current.as_ref() == Some(&name);
            // A damaged night may have been complete.
            let Some(is_complete) = self.night(&name).map(|n| n.is_complete()) else {
                continue;
            };
            kept += usize::from(is_complete);
            if !is_current && (!is_complete || kept > keep.max(1)) {
                superfluous.push(name);
            }
        }
        superfluous.reverse();
        superfluous
    }

    /// Removes the superfluous nights.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder.
    pub fn prune(&self, keep: usize) -> Result<()> {
        for name in self.superfluous(keep) {
            let (folder, gone) = (
                self.folder(&name),
                self.folder(&format!("{}gone-{name}", atomic::TEMPORARY)),
            );
            fs::rename(&folder, &gone).map_err(Error::io(&folder, "cannot remove the night"))?;
            fs::remove_dir_all(&gone).map_err(Error::io(&gone, "cannot remove the night"))?;
        }
        Ok(())
    }

    /// Marks the changes of a night as reported, and returns `true` if they already were.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn mark_reported(&self, night: &str) -> Result<bool> {
        let path = self.reports.join(NIGHTS).join("told");
        let was_reported = fs::read_to_string(&path).is_ok_and(|name| name.trim() == night);
        if !was_reported {
            atomic::place(&path, format!("{night}\n").as_bytes())?;
        }
        Ok(was_reported)
    }

    /// Makes a night the current one.
    fn make_current(&self, night: &Night) -> Result<()> {
        if self.current_name().as_ref() != Some(&night.name) {
            link::place(
                &self.reports.join(CURRENT),
                &format!("{NIGHTS}/{}", night.name),
            )?;
            atomic::sync_folder(&self.reports)?;
        }
        link::place_all(&self.reports, &self.folder(&night.name), night.files.keys())
    }

    fn current_name(&self) -> Option<String> {
        let target = link::target(&self.reports.join(CURRENT))?;
        Some(
            target
                .strip_prefix(NIGHTS)?
                .trim_start_matches('/')
                .to_owned(),
        )
    }
}

/// Spellings that a night's name may have: as written, and with leading zeros.
fn spellings(name: &str) -> [String; 2] {
    [name.to_owned(), format!("{name:0>4}")]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lineage::Stage;

    fn publish(nights: &Nights, text: &str, until: Stage) -> Night {
        atomic::place(&nights.tonight().unwrap().join("fits.csv"), text.as_bytes()).unwrap();
        nights
            .publish(
                Night {
                    until,
                    ..Night::default()
                },
                2,
            )
            .unwrap()
    }

    fn opened() -> (tempfile::TempDir, Nights) {
        let folder = tempfile::tempdir().unwrap();
        let nights = Nights::open(folder.path(), Duration::ZERO).unwrap();
        (folder, nights)
    }

    #[test]
    fn a_night_is_read_under_the_same_paths_as_the_one_before() {
        let (folder, nights) = opened();
        let read = || fs::read_to_string(folder.path().join("fits.csv")).unwrap();
        publish(&nights, "one", Stage::Report);
        assert_eq!(read(), "one");
        publish(&nights, "two", Stage::Report);
        assert_eq!(
            (read(), nights.names()),
            ("two".to_owned(), vec!["0001".to_owned(), "0002".to_owned()])
        );
        assert_eq!(
            fs::read_to_string(folder.path().join("nights/0001/fits.csv")).unwrap(),
            "one"
        );
    }

    #[test]
    fn the_last_complete_nights_stay_and_incomplete_ones_only_while_they_hold() {
        let (_folder, nights) = opened();
        for (text, until) in [
            ("a", Stage::Report),
            ("b", Stage::Report),
            ("c", Stage::Ingest),
        ] {
            publish(&nights, text, until);
        }
        assert_eq!(nights.names(), ["0001", "0002", "0003"]);
        publish(&nights, "d", Stage::Report);
        assert_eq!(nights.names(), ["0002", "0004"]);
        assert_eq!(nights.current().unwrap().name, "0004");
    }

    #[test]
    fn a_night_that_was_whole_when_the_run_was_killed_is_published_by_the_next() {
        let (folder, nights) = opened();
        publish(&nights, "one", Stage::Report);
        publish(&nights, "two", Stage::Report);
        drop(nights);
        link::place(&folder.path().join(CURRENT), "nights/0001").unwrap();
        fs::create_dir(folder.path().join("nights/.harvest-tonight")).unwrap();
        let nights = Nights::open(folder.path(), Duration::ZERO).unwrap();
        assert_eq!(nights.current().unwrap().name, "0002");
        assert!(!folder.path().join("nights/.harvest-tonight").exists());
    }

    #[test]
    fn damage_to_a_file_or_to_the_manifest_is_seen() {
        let (folder, nights) = opened();
        let night = publish(&nights, "one", Stage::Report);
        assert!(nights.is_intact(&night));
        fs::write(folder.path().join("nights/0001/fits.csv"), "onf").unwrap();
        assert_eq!(nights.damaged(&night), ["fits.csv"]);
        let manifest = folder.path().join("nights/0001/night.json");
        let text = fs::read_to_string(&manifest).unwrap();
        fs::write(&manifest, text.replace("\"refused\":0", "\"refused\":1")).unwrap();
        assert_eq!(nights.night("0001"), None);
    }

    #[test]
    fn a_night_is_restored_by_the_files_that_were_published_and_by_no_others() {
        let (folder, nights) = opened();
        let night = publish(&nights, "one", Stage::Report);
        let table = folder.path().join("nights/0001/fits.csv");
        let tonight =
            |text: &str| fs::write(nights.tonight().unwrap().join("fits.csv"), text).unwrap();
        fs::write(&table, "onf").unwrap();
        tonight("two");
        assert_eq!(nights.restore(&night).unwrap(), None);
        assert_eq!(fs::read_to_string(&table).unwrap(), "onf");
        tonight("one");
        assert_eq!(nights.restore(&night).unwrap(), Some(night));
        assert_eq!(fs::read_to_string(&table).unwrap(), "one");
    }

    #[test]
    fn files_of_a_program_that_knew_no_nights_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("fits.csv"), "old").unwrap();
        let nights = Nights::open(folder.path(), Duration::ZERO).unwrap();
        publish(&nights, "one", Stage::Report);
        assert_eq!(
            fs::read_to_string(folder.path().join("fits.csv")).unwrap(),
            "one"
        );
    }
}
