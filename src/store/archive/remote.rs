//! The archive in an object store: which objects are flights, and which of their bytes a column takes.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glob::{MatchOptions, Pattern};
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;

use super::super::object;
use super::{is_hidden, unreadable};
use crate::error::Error;

/// The objects of an archive `s3://bucket/prefix`: those below it whose names end in `.parquet`, the one of this name, or
/// those that match it as a glob.
///
/// # Errors
/// The objects cannot be listed.
pub(super) fn find(archive: &str) -> Result<BTreeSet<PathBuf>, Error> {
    let place = Path::new(archive);
    let plain = archive.split(['*', '?', '[']).next().unwrap_or_default();
    let is_glob = plain.len() < archive.len();
    let stem = if is_glob { plain.rsplit_once('/').map_or(plain, |(folder, _)| folder) } else { plain };
    let glob = Pattern::new(archive.trim_end_matches('/'));
    let glob = glob.map_err(|e| Error::Archive { place: place.into(), what: format!("not a glob: {e}") })?;
    let listed = object::list(Path::new(stem)).map_err(|e| e.at(place))?;
    let folder = archive.trim_end_matches('/');
    let is_meant = |object: &str| if is_glob { matches(&glob, object) } else { is_below(folder, object) };
    let mut found = BTreeSet::new();
    for (path, about) in listed.into_iter().filter(|(path, _)| path.to_str().is_some_and(is_meant)) {
        object::remember(&path, &about).map_err(|e| e.at(place))?;
        found.insert(path);
    }
    Ok(found)
}

/// Whether an object lies in a folder, or is the one of this name; names that begin with a dot or an underscore are other
/// programs' own.
fn is_below(folder: &str, object: &str) -> bool {
    let Some(rest) = object.strip_prefix(folder) else { return false };
    let is_flight = || rest.rsplit_once('.').is_some_and(|(_, e)| e.eq_ignore_ascii_case("parquet"));
    rest.is_empty() || rest.starts_with('/') && is_flight() && !rest.split('/').any(is_hidden)
}

/// Whether a glob matches an object, or a folder that it lies in.
fn matches(glob: &Pattern, object: &str) -> bool {
    let options = MatchOptions { require_literal_separator: true, ..MatchOptions::new() };
    let mut folders = object.match_indices('/').map(|(at, _)| &object[..at]);
    glob.matches_with(object, options)
        || folders.any(|folder| glob.matches_with(folder, options) && is_below(folder, object))
}

/// Why an object cannot be opened: what the store says, or that it is no Parquet.
pub(super) fn why(path: &Path, error: &ParquetError) -> String {
    object::failed(path).unwrap_or_else(|| unreadable(error))
}

/// The bytes of an object that these rows of a column take: of each row group the column's pages that hold them, where the
/// file tells its pages, else all of the column; and the dictionary before them.
pub(super) fn stretches(metadata: &ParquetMetaData, column: usize, rows: &Range<usize>) -> Vec<Range<u64>> {
    let mut stretches = Vec::new();
    let mut end = 0;
    for (index, group) in metadata.row_groups().iter().enumerate() {
        let start = end;
        end += usize::try_from(group.num_rows()).unwrap_or_default();
        if end <= rows.start || rows.end <= start || column >= group.num_columns() {
            continue;
        }
        let (from, length) = group.column(column).byte_range();
        let whole = from..from.saturating_add(length);
        let pages = metadata.offset_index().and_then(|i| i.get(index)?.get(column)).map(|i| i.page_locations());
        let Some(pages) = pages.filter(|pages| !pages.is_empty()) else {
            stretches.push(whole);
            continue;
        };
        let row =
            |at: usize| pages.get(at).map_or(end, |p| start + usize::try_from(p.first_row_index).unwrap_or_default());
        let needed: Vec<usize> =
            (0..pages.len()).filter(|&at| row(at) < rows.end && rows.start < row(at + 1)).collect();
        let begin = |at: usize| pages.get(at).and_then(|p| u64::try_from(p.offset).ok()).unwrap_or(whole.end);
        if let (Some(first), Some(last)) = (needed.first(), needed.last()) {
            stretches.push(whole.start..begin(0));
            stretches.push(begin(*first)..begin(last + 1));
        }
    }
    // A first page right behind the dictionary is fetched with it.
    stretches.dedup_by(|next, before| {
        let joins = before.end == next.start;
        if joins {
            before.end = next.end;
        }
        joins
    });
    stretches.retain(|s| !s.is_empty());
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_holds_what_lies_below_it_and_is_not_hidden() {
        let folder = "s3://b/flights";
        for inside in ["s3://b/flights/f1.parquet", "s3://b/flights/flight=007/part-0.PARQUET", "s3://b/flights"] {
            assert!(is_below(folder, inside), "{inside}");
        }
        for outside in [
            "s3://b/flights2/f1.parquet",
            "s3://b/flights/notes.txt",
            "s3://b/flights/_tmp/f1.parquet",
            "s3://b/flights/.f1.parquet",
        ] {
            assert!(!is_below(folder, outside), "{outside}");
        }
    }

    #[test]
    fn a_glob_matches_objects_and_folders_of_them() {
        let is_match = |glob: &str, object: &str| matches(&Pattern::new(glob).unwrap(), object);
        assert!(is_match("s3://b/flights/*.parquet", "s3://b/flights/f1.parquet"));
        assert!(!is_match("s3://b/flights/*.parquet", "s3://b/flights/old/f1.parquet"));
        assert!(is_match("s3://b/**/*.parquet", "s3://b/flights/old/f1.parquet"));
        assert!(is_match("s3://b/flights/flight=00*", "s3://b/flights/flight=007/part-0.parquet"));
        assert!(!is_match("s3://b/flights/flight=00*", "s3://b/flights/flight=007/notes.txt"));
        assert!(!is_match("s3://b/flights/flight=00?", "s3://b/flights/flight=010/part-0.parquet"));
    }
}
