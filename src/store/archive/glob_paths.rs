//! Paths that match a glob, found component by component. For each component a folder is read once,
//! no matter how many links lead to it. Otherwise two links of a folder to itself would double the
//! paths with every further `*/`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use glob::Pattern;

use crate::error::Error;

/// Largest number of folders that are read for a glob: more than an archive has.
const MOST_FOLDERS: usize = 50_000;

/// Paths that match a glob without `**`. A folder that a link leads to again, or that cannot be read, is among
/// them.
///
/// # Errors
/// The text is no glob, or more folders match its beginning than an archive has.
pub(super) fn matching(pattern: &str) -> Result<BTreeSet<PathBuf>, Error> {
    let refused = |what: String| Error::Archive {
        place: pattern.into(),
        what,
    };
    let no_glob = |e: glob::PatternError| refused(format!("not a glob: {e}"));
    Pattern::new(pattern).map_err(no_glob)?;
    let is_absolute = pattern.starts_with('/');
    let mut paths = BTreeSet::from([PathBuf::from(if is_absolute { "/" } else { "" })]);
    let (mut folders, mut again) = (0, BTreeSet::new());
    for component in pattern.split('/').filter(|name| !name.is_empty()) {
        if component.contains(['*', '?', '[']) {
            let names = Pattern::new(component).map_err(no_glob)?;
            folders += paths.len();
            if folders > MOST_FOLDERS {
                let what = format!("more than {MOST_FOLDERS} folders match its beginning");
                return Err(refused(what));
            }
            paths = below(&paths, &names, &mut again);
        } else {
            let next = paths.iter().map(|folder| folder.join(component));
            paths = next
                .filter(|path| fs::symlink_metadata(path).is_ok())
                .collect();
        }
    }
    paths.extend(again);
    Ok(paths)
}

/// Entries of folders with matching names; a path that is no folder has no entries.
fn below(
    folders: &BTreeSet<PathBuf>,
    names: &Pattern,
    again: &mut BTreeSet<PathBuf>,
) -> BTreeSet<PathBuf> {
    let mut read = BTreeSet::new();
    let mut found = BTreeSet::new();
    for folder in folders {
        let here = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        };
        let Ok(target) = fs::canonicalize(here) else {
            continue;
        };
        if !target.is_dir() {
            continue;
        }
        let entries = fs::read_dir(here);
        let (true, Ok(entries)) = (read.insert(target), entries) else {
            again.insert(folder.clone());
            continue;
        };
        let matching = entries.flatten().filter(|entry| {
            let name = entry.file_name();
            names.matches(&name.to_string_lossy())
        });
        found.extend(matching.map(|entry| folder.join(entry.file_name())));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(folder: &Path, pattern: &str) -> Vec<String> {
        let pattern = format!("{}/{pattern}", folder.display());
        let paths = matching(&pattern).unwrap().into_iter();
        let below = paths.map(|path| path.strip_prefix(folder).unwrap().to_owned());
        below.map(|path| path.display().to_string()).collect()
    }

    #[test]
    fn a_glob_finds_names_in_folders() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a/1.parquet", "a/2.parquet", "b/1.parquet", "b/1.csv"] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        let found = |pattern: &str| found(folder.path(), pattern);
        assert_eq!(found("*/1.p*"), ["a/1.parquet", "b/1.parquet"]);
        assert_eq!(found("a//[2-3].parquet"), ["a/2.parquet"]);
        assert_eq!(found("?"), ["a", "b"]);
        assert_eq!(found("b/1.csv"), ["b/1.csv"]);
        assert!(found("c/*").is_empty() && found("a/1.parquet/*").is_empty());
        assert!(matching("a[").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_leads_to_itself_is_read_once_for_a_component() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("f.parquet"), "").unwrap();
        for link in ["x", "y"] {
            std::os::unix::fs::symlink(".", folder.path().join(link)).unwrap();
        }
        // 2^30 paths lead to the file.
        let paths = found(folder.path(), &format!("{}*.parquet", "*/".repeat(30)));
        let files = paths.iter().filter(|path| path.ends_with(".parquet"));
        assert_eq!(files.count(), 1);
        assert!(
            paths.contains(&"y".to_owned()) && paths.len() < 40,
            "{paths:?}"
        );
    }
}
