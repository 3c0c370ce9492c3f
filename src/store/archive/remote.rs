//! The archive in an object store: the objects that are flights, and the byte ranges of a column.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glob::{MatchOptions, Pattern};
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::page_index::offset_index::{OffsetIndexMetaData, PageLocation};

use super::super::object;
use super::file_rules::{is_hidden, unreadable};
use crate::error::Error;

/// Finds the objects of an archive `s3://bucket/prefix`. They are the `.parquet` objects below the
/// prefix, the object of this name, or the objects that match the name as a glob.
///
/// # Errors
/// The objects cannot be listed.
pub(super) fn find(archive: &str) -> Result<BTreeSet<PathBuf>, Error> {
    let place = Path::new(archive);
    let plain = archive.split(['*', '?', '[']).next().unwrap_or_default();
    let is_glob = plain.len() < archive.len();
    let stem = if is_glob {
        plain.rsplit_once('/').map_or(plain, |(folder, _)| folder)
    } else {
        plain
    };
    let glob = Pattern::new(archive.trim_end_matches('/'));
    let glob = glob.map_err(|e| Error::Archive {
        place: place.into(),
        what: format!("not a glob: {e}"),
    })?;
    let listed = object::list(Path::new(stem)).map_err(|e| e.at(place))?;
    let folder = archive.trim_end_matches('/');
    let is_meant = |object: &str| {
        if is_glob {
            matches(&glob, object)
        } else {
            is_below(folder, object)
        }
    };
    let mut found = BTreeSet::new();
    for (path, about) in listed
        .into_iter()
        .filter(|(path, _)| path.to_str().is_some_and(is_meant))
    {
        object::remember(&path, &about).map_err(|e| e.at(place))?;
        found.insert(path);
    }
    Ok(found)
}

/// `true` for an object in a folder or of this name, except names with a leading dot or underscore.
fn is_below(folder: &str, object: &str) -> bool {
    let Some(rest) = object.strip_prefix(folder) else {
        return false;
    };
    let is_flight = || {
        rest.rsplit_once('.')
            .is_some_and(|(_, e)| e.eq_ignore_ascii_case("parquet"))
    };
    rest.is_empty() || rest.starts_with('/') && is_flight() && !rest.split('/').any(is_hidden)
}

/// `true` if a glob matches an object or one of its folders.
fn matches(glob: &Pattern, object: &str) -> bool {
    let options = MatchOptions {
        require_literal_separator: true,
        ..MatchOptions::new()
    };
    let mut folders = object.match_indices('/').map(|(at, _)| &object[..at]);
    glob.matches_with(object, options)
        || folders.any(|folder| glob.matches_with(folder, options) && is_below(folder, object))
}

/// Reason that an object cannot be opened: the store's answer, or that it is no Parquet.
pub(super) fn failure_reason(path: &Path, error: &ParquetError) -> String {
    object::failed(path).unwrap_or_else(|| unreadable(error))
}

/// Byte ranges of these rows of a column. In each row group these are the dictionary and the pages
/// with the rows, or the whole column of a file without a page index.
pub(super) fn byte_ranges(
    metadata: &ParquetMetaData,
    column: usize,
    rows: &Range<usize>,
) -> Vec<Range<u64>> {
    let mut ranges = Vec::new();
    let mut end = 0;
    for (index, group) in metadata.row_groups().iter().enumerate() {
        let start = end;
        end += usize::try_from(group.num_rows()).unwrap_or_default();
        if end <= rows.start || rows.end <= start || column >= group.num_columns() {
            continue;
        }
        let (from, length) = group.column(column).byte_range();
        let bytes = from..from.saturating_add(length);
        let pages = metadata
            .offset_index()
            .and_then(|index_of| index_of.get(index)?.get(column));
        match pages.map(OffsetIndexMetaData::page_locations) {
            Some(pages) if !pages.is_empty() => {
                ranges.extend(ranges_of_pages(pages, bytes, start..end, rows));
            }
            _ => ranges.push(bytes),
        }
    }
    joined(ranges)
}

/// Byte ranges of the dictionary and of the pages with these rows, in one column of a row group.
/// The row group has the rows `group`, the column the bytes `bytes`.
fn ranges_of_pages(
    pages: &[PageLocation],
    bytes: Range<u64>,
    group: Range<usize>,
    rows: &Range<usize>,
) -> impl Iterator<Item = Range<u64>> + use<> {
    let row = |at: usize| {
        pages.get(at).map_or(group.end, |page| {
            group.start + usize::try_from(page.first_row_index).unwrap_or_default()
        })
    };
    let offset = |at: usize| {
        let offset = pages
            .get(at)
            .and_then(|page| u64::try_from(page.offset).ok());
        offset.unwrap_or(bytes.end)
    };
    let is_needed = |at: &usize| row(*at) < rows.end && rows.start < row(at + 1);
    let mut needed = (0..pages.len()).filter(is_needed);
    let ranges = needed.next().map(|first| {
        let last = needed.next_back().unwrap_or(first);
        [bytes.start..offset(0), offset(first)..offset(last + 1)]
    });
    ranges.into_iter().flatten()
}

/// Ranges in which adjacent ones are one, without empty ones: a first page directly after the
/// dictionary is fetched with it.
fn joined(mut ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
    ranges.dedup_by(|next, before| {
        let joins = before.end == next.start;
        if joins {
            before.end = next.end;
        }
        joins
    });
    ranges.retain(|range| !range.is_empty());
    ranges
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use arrow::array::{ArrayRef, Float64Array, RecordBatch};
    use arrow::datatypes::{DataType, Field, Schema};
    use parquet::arrow::ArrowWriter;
    use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
    use parquet::file::metadata::PageIndexPolicy;
    use parquet::file::properties::WriterProperties;

    use super::*;

    #[test]
    fn a_folder_holds_what_lies_below_it_and_is_not_hidden() {
        let folder = "s3://b/flights";
        for inside in [
            "s3://b/flights/f1.parquet",
            "s3://b/flights/flight=007/part-0.PARQUET",
            "s3://b/flights",
        ] {
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
        assert!(is_match(
            "s3://b/flights/*.parquet",
            "s3://b/flights/f1.parquet"
        ));
        assert!(!is_match(
            "s3://b/flights/*.parquet",
            "s3://b/flights/old/f1.parquet"
        ));
        assert!(is_match(
            "s3://b/**/*.parquet",
            "s3://b/flights/old/f1.parquet"
        ));
        assert!(is_match(
            "s3://b/flights/flight=00*",
            "s3://b/flights/flight=007/part-0.parquet"
        ));
        assert!(!is_match(
            "s3://b/flights/flight=00*",
            "s3://b/flights/flight=007/notes.txt"
        ));
        assert!(!is_match(
            "s3://b/flights/flight=00?",
            "s3://b/flights/flight=010/part-0.parquet"
        ));
    }

    /// A file of two row groups of 1000 rows in pages of 100, with or without a page index.
    fn metadata(pages: PageIndexPolicy) -> ArrowReaderMetadata {
        let schema = Arc::new(Schema::new(
            ["a", "b"]
                .map(|name| Field::new(name, DataType::Float64, false))
                .to_vec(),
        ));
        let properties = WriterProperties::builder().set_max_row_group_row_count(Some(1000));
        let properties = properties
            .set_data_page_row_count_limit(100)
            .set_write_batch_size(100);
        let values: ArrayRef = Arc::new((0..2000_i32).map(f64::from).collect::<Float64Array>());
        let batch = RecordBatch::try_new(schema.clone(), vec![values.clone(), values]).unwrap();
        let mut writer =
            ArrowWriter::try_new(Vec::new(), schema, Some(properties.build())).unwrap();
        writer.write(&batch).unwrap();
        let bytes = bytes::Bytes::from(writer.into_inner().unwrap());
        ArrowReaderMetadata::load(
            &bytes,
            ArrowReaderOptions::default().with_offset_index_policy(pages),
        )
        .unwrap()
    }

    #[test]
    fn only_the_pages_that_hold_the_rows_are_wanted() {
        let (told, untold) = (
            metadata(PageIndexPolicy::Required),
            metadata(PageIndexPolicy::Skip),
        );
        let column = |group: usize| {
            let (from, length) = told.metadata().row_group(group).column(1).byte_range();
            from..from + length
        };
        assert_eq!(
            byte_ranges(untold.metadata(), 1, &(950..1050)),
            [column(0), column(1)]
        );
        assert_eq!(
            byte_ranges(told.metadata(), 1, &(0..2000)),
            [column(0), column(1)]
        );
        let few = byte_ranges(told.metadata(), 1, &(1310..1390));
        let bytes: u64 = few.iter().map(|s| s.end - s.start).sum();
        let whole = column(1);
        // The dictionary of a thousand values, and one page of ten.
        assert!(
            few.iter()
                .all(|s| whole.start <= s.start && s.end <= whole.end),
            "{few:?} in {whole:?}"
        );
        assert!(
            few.len() == 2 && bytes < whole.end - whole.start,
            "{few:?} in {whole:?}"
        );
        assert_eq!(byte_ranges(told.metadata(), 1, &(500..500)), []);
    }
}
