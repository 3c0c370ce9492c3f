//! Search of an archive's folders.

use std::collections::{BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use super::file_rules::is_hidden;
use crate::error::Error;

/// Most folders of an archive: links may lead to the whole file system.
const MOST_FOLDERS: usize = 50_000;

/// Search of folders, each entered once whatever links lead to it: folders themselves first, then
/// links in the order in which they are found.
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

    /// Adds the files below a folder, except names with a leading dot or underscore. A folder
    /// below it that cannot be read, or that a link leads to again, is added itself.
    ///
    /// # Errors
    /// The folder cannot be read, or there are more folders than an archive has.
    pub fn add(&mut self, folder: &Path, files: &mut BTreeSet<PathBuf>) -> Result<(), Error> {
        if self.has_entered(folder) {
            files.insert(folder.to_owned());
            return Ok(());
        }
        self.enter(folder, files)?;
        while let Some(link) = self.links.pop_front() {
            if self.has_entered(&link) || self.enter(&link, files).is_err() {
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

    fn has_entered(&self, folder: &Path) -> bool {
        fs::canonicalize(folder).is_ok_and(|folder| self.entered.contains(&folder))
    }

    fn enter(&mut self, folder: &Path, files: &mut BTreeSet<PathBuf>) -> Result<(), Error> {
        if self.is_full() {
            return Ok(());
        }
        let unreadable = |cause| Error::io(folder, "cannot read the archive's folder")(cause);
        self.entered
            .insert(fs::canonicalize(folder).map_err(unreadable)?);
        let entries = fs::read_dir(folder).map_err(unreadable)?;
        let paths = entries.map(|entry| entry.map(|entry| entry.path()));
        let mut paths: Vec<PathBuf> = paths.collect::<Result<_, _>>().map_err(unreadable)?;
        paths.sort();
        for path in paths.into_iter().filter(|path| !has_hidden_name(path)) {
            if !path.is_dir() {
                if self.takes_all || has_extension_of_flights(&path) {
                    files.insert(path);
                }
            } else if path.is_symlink() {
                self.links.push_back(path);
            } else if self.has_entered(&path) || self.enter(&path, files).is_err() {
                files.insert(path);
            }
        }
        Ok(())
    }
}

fn has_hidden_name(path: &Path) -> bool {
    let name = path.file_name();
    name.is_some_and(|name| is_hidden(&name.to_string_lossy()))
}

fn has_extension_of_flights(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

#[cfg(test)]
mod tests {
    use super::*;

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
