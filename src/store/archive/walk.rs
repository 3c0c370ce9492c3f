//! Search of an archive's folders.

use std::collections::{BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use super::file_rules::is_hidden;
use crate::error::Error;

/// Largest number of folders of an archive: links may lead to the whole file system.
const MOST_FOLDERS: usize = 50_000;

/// Search of folders. Each is entered once, no matter how many links lead to it. Folders themselves
/// come first, then links in the order in which they are found.
#[derive(Debug)]
pub(super) struct Walk {
    /// Folders entered, without links.
    entered: BTreeSet<PathBuf>,
    /// Links to folders, not followed yet.
    links: VecDeque<PathBuf>,
    /// Files of every name are added, not only flights.
    takes_all: bool,
    most_folders: usize,
}

impl Walk {
    /// Search for Parquet files.
    pub fn of_flights() -> Walk {
        Walk {
            entered: BTreeSet::new(),
            links: VecDeque::new(),
            takes_all: false,
            most_folders: MOST_FOLDERS,
        }
    }

    /// Search for files of every extension.
    pub fn of_files() -> Walk {
        Walk {
            takes_all: true,
            ..Walk::of_flights()
        }
    }

    /// Adds the files below a folder, except names with a leading dot or underscore. A sub-folder
    /// is added in place of its files in three cases: it cannot be read, a link leads to it again,
    /// or it holds the archive.
    ///
    /// # Errors
    /// The folder cannot be read, or there are more folders than an archive has.
    pub fn add(&mut self, folder: &Path, files: &mut BTreeSet<PathBuf>) -> Result<(), Error> {
        let unreadable = |cause| Error::io(folder, "cannot read the archive's folder")(cause);
        let root = fs::canonicalize(folder).map_err(unreadable)?;
        if self.entered.contains(&root) {
            files.insert(folder.to_owned());
            return Ok(());
        }
        self.enter(folder, &root, files)?;
        while let Some(link) = self.links.pop_front() {
            let target = fs::canonicalize(&link);
            let is_new =
                |target: &PathBuf| !self.entered.contains(target) && !root.starts_with(target);
            let target = target.ok().filter(is_new);
            if target.is_none_or(|target| self.enter(&link, &target, files).is_err()) {
                files.insert(link);
            }
        }
        if self.is_full() {
            return Err(Error::Archive {
                place: folder.to_owned(),
                what: format!(
                    "it has more than {} folders, with those that links lead to; name the folder of the flights",
                    self.most_folders
                ),
            });
        }
        Ok(())
    }

    fn is_full(&self) -> bool {
        self.entered.len() > self.most_folders
    }

    /// Adds the files of a folder and of the folders in it. `target` is the folder without links.
    fn enter(
        &mut self,
        folder: &Path,
        target: &Path,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<(), Error> {
        if self.is_full() {
            return Ok(());
        }
        self.entered.insert(target.to_owned());
        for entry in entries(folder)? {
            let (name, path) = (entry.file_name(), entry.path());
            if is_hidden(&name.to_string_lossy()) {
                continue;
            }
            // No further access to the disk for each file: there may be many.
            let kind = entry.file_type();
            if kind.as_ref().is_ok_and(fs::FileType::is_dir) {
                let own = target.join(name);
                let is_again = self.entered.contains(&own);
                if is_again || self.enter(&path, &own, files).is_err() {
                    files.insert(path);
                }
            } else if kind.is_ok_and(|kind| kind.is_symlink()) && path.is_dir() {
                self.links.push_back(path);
            } else if self.takes_all || has_extension_of_flights(&path) {
                files.insert(path);
            }
        }
        Ok(())
    }
}

/// Entries of a folder in the order of their names.
fn entries(folder: &Path) -> Result<Vec<fs::DirEntry>, Error> {
    let unreadable = |cause| Error::io(folder, "cannot read the archive's folder")(cause);
    let entries = fs::read_dir(folder).map_err(unreadable)?;
    let entries: Result<Vec<fs::DirEntry>, std::io::Error> = entries.collect();
    let mut entries = entries.map_err(unreadable)?;
    entries.sort_by_key(fs::DirEntry::file_name);
    Ok(entries)
}

fn has_extension_of_flights(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_folder_that_holds_the_archive_is_not_followed() {
        use std::os::unix::fs::symlink;
        let above = tempfile::tempdir().unwrap();
        let archive = above.path().join("flights");
        for folder in ["flights/a", "elsewhere/b"] {
            fs::create_dir_all(above.path().join(folder)).unwrap();
        }
        fs::write(above.path().join("elsewhere/b/f.parquet"), "").unwrap();
        symlink(above.path(), archive.join("a/above")).unwrap();
        symlink("/", archive.join("root")).unwrap();
        symlink(above.path().join("elsewhere"), archive.join("beside")).unwrap();
        let mut files = BTreeSet::new();
        Walk::of_flights().add(&archive, &mut files).unwrap();
        let found = ["a/above", "beside/b/f.parquet", "root"].map(|name| archive.join(name));
        assert_eq!(files, found.into());
    }

    #[test]
    fn an_archive_of_too_many_folders_is_refused_and_its_place_named() {
        let archive = tempfile::tempdir().unwrap();
        for name in ["a/b", "c"] {
            fs::create_dir_all(archive.path().join(name)).unwrap();
        }
        let find = |most_folders| {
            let mut walk = Walk {
                most_folders,
                ..Walk::of_flights()
            };
            walk.add(archive.path(), &mut BTreeSet::new())
        };
        assert!(find(4).is_ok());
        let refused = find(3).unwrap_err().to_string();
        let place = archive.path().display().to_string();
        assert!(
            refused.contains(&place) && refused.contains("more than 3 folders"),
            "{refused}"
        );
    }
}
