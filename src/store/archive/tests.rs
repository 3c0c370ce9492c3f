//! Good and bad archives: the files found, the values read, and the messages about unreadable
//! files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, BooleanArray, Float32Array, Float64Array, Int8Array, Int64Array, RecordBatch,
    StringArray, TimestampMillisecondArray,
};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use proptest::prelude::*;
use tempfile::TempDir;

use super::*;
use crate::error::Problem;
use crate::flight::{Channel, RawFlight};
use crate::ingest::ColumnSource;
use crate::store::recorder::UNIT;

type Column = (&'static str, Option<&'static str>, ArrayRef);

fn parquet(columns: Vec<Column>) -> Vec<u8> {
    let field = |(name, unit, array): &Column| {
        let field = Field::new(*name, array.data_type().clone(), true);
        field.with_metadata(
            unit.map(|u| (UNIT.to_owned(), u.to_owned()))
                .into_iter()
                .collect(),
        )
    };
    let schema = Arc::new(Schema::new(
        columns.iter().map(field).collect::<Vec<Field>>(),
    ));
    let arrays = columns.into_iter().map(|c| c.2).collect();
    let batch = RecordBatch::try_new(schema.clone(), arrays).unwrap();
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, schema, None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

fn floats(values: &[f64]) -> ArrayRef {
    Arc::new(Float64Array::from(values.to_vec()))
}

fn simple(times: &[f64]) -> Vec<u8> {
    parquet(vec![
        ("time", Some("s"), floats(times)),
        ("q", Some("deg/s"), floats(times)),
    ])
}

fn channels() -> BTreeMap<String, Channel> {
    let channel =
        |name: &str, signal: &str, unit: &str| (name.to_owned(), Channel::plain(signal, unit));
    [
        channel("time", "time_s", "s"),
        channel("q", "q_deg_s", "deg/s"),
        channel("obes", "obes", "0/1"),
    ]
    .into()
}

/// An archive of these files, and the text that names it.
fn archive(files: &[(&str, &[u8])]) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let text = folder.path().display().to_string();
    (folder, text)
}

fn read_one(bytes: &[u8]) -> Result<RawFlight, Problem> {
    let (_folder, text) = archive(&[("f.parquet", bytes)]);
    read(&find(&text).unwrap()[0], &channels()).map(|mut files| files.swap_remove(0))
}

#[test]
fn a_folder_gives_its_parquet_files_sorted_by_flight() {
    let (_folder, text) = archive(&[
        ("b.parquet", b""),
        ("sub/a.parquet", b""),
        ("notes.txt", b""),
        ("_x.parquet", b""),
    ]);
    let ids: Vec<String> = find(&text)
        .unwrap()
        .into_iter()
        .map(|f| f.flight_id)
        .collect();
    assert_eq!(ids, ["a", "b"]);
    let ids: Vec<String> = find(&format!("{text}/b*"))
        .unwrap()
        .into_iter()
        .map(|f| f.flight_id)
        .collect();
    assert_eq!(ids, ["b"]);
}

#[test]
fn the_files_of_a_hive_folder_are_one_flight_in_the_order_of_their_names() {
    let (_folder, text) = archive(&[
        ("year=1995/flight=007/part-1.parquet", &simple(&[2.0, 3.0])),
        ("year=1995/flight=007/part-0.parquet", &simple(&[0.0, 1.0])),
        ("year=1995/flight=008/part-0.parquet", &simple(&[5.0])),
    ]);
    let found = find(&text).unwrap();
    let ids: Vec<&str> = found.iter().map(|f| f.flight_id.as_str()).collect();
    assert_eq!(ids, ["007", "008"]);
    let files = read(&found[0], &channels()).unwrap();
    assert_eq!(
        files
            .iter()
            .map(|f| f.columns["time"].values.clone())
            .collect::<Vec<_>>(),
        [[0.0, 1.0], [2.0, 3.0]]
    );
}

#[test]
fn a_second_record_of_one_name_is_the_first_s_rival() {
    let (_folder, text) = archive(&[
        ("one/f.parquet", b""),
        ("two/f.parquet", b""),
        ("two/g.parquet", b""),
    ]);
    let found = find(&text).unwrap();
    assert_eq!(found.len(), 2);
    assert!(
        found[0].files[0].ends_with("one/f.parquet")
            && found[0].rivals[0].ends_with("two/f.parquet")
    );
    assert!(found[1].rivals.is_empty());
}

#[cfg(unix)]
#[test]
fn a_folder_is_entered_once_whatever_links_lead_to_it() {
    use std::os::unix::fs::symlink;
    let (folder, place) = archive(&[("a/f1.parquet", b"")]);
    for link in ["x", "y"] {
        symlink(folder.path(), folder.path().join(link)).unwrap();
        symlink(folder.path(), folder.path().join("a").join(link)).unwrap();
    }
    // Folders of which each leads to the next by two links: 2^20 paths to the last one.
    for level in 0..20 {
        let here = folder.path().join(format!("b{level}"));
        fs::create_dir(&here).unwrap();
        for link in ["x", "y"] {
            symlink(
                folder.path().join(format!("b{}", level + 1)),
                here.join(link),
            )
            .unwrap();
        }
    }
    let found = find(&place).unwrap();
    let ids: BTreeSet<&str> = found.iter().map(|f| f.flight_id.as_str()).collect();
    assert_eq!(ids, ["f1", "x", "y"].into());
    assert_eq!(found[0].files.len() + found[0].rivals.len(), 1);
    for glob in ["**/*.parquet", "**", "a/**/*.parquet", "**/f?.parquet"] {
        let again = find(&format!("{place}/{glob}")).unwrap();
        assert!(again.contains(&found[0]), "{glob}");
    }
    assert!(
        !matches!(find(&format!("{place}/**/g*.parquet")), Ok(all) if all[0].flight_id == "f1")
    );
}

#[test]
fn an_empty_archive_says_what_was_looked_for() {
    let (_folder, text) = archive(&[("notes.txt", b"")]);
    for nothing in [
        text.clone(),
        format!("{text}/*.parquet"),
        format!("{text}/nowhere"),
    ] {
        let error = find(&nothing).unwrap_err().to_string();
        assert!(
            error.starts_with(&nothing) && error.contains("*.parquet"),
            "{error}"
        );
    }
}

#[test]
fn every_kind_of_number_becomes_a_number_and_a_null_none() {
    let time: ArrayRef = Arc::new(Int64Array::from(vec![1, 2, 3]));
    let q: ArrayRef = Arc::new(Float32Array::from(vec![Some(0.5), None, Some(1.5)]));
    let obes: ArrayRef = Arc::new(BooleanArray::from(vec![true, false, true]));
    let other: ArrayRef = Arc::new(StringArray::from(vec!["not", "mapped", "here"]));
    let flight = read_one(&parquet(vec![
        ("time", None, time),
        ("comment", None, other),
        ("q", Some("deg/s"), q),
        ("obes", None, obes),
    ]))
    .unwrap();
    assert_eq!(
        flight.columns.keys().collect::<Vec<_>>(),
        ["obes", "q", "time"]
    );
    assert_eq!(flight.columns["time"].values, [1.0, 2.0, 3.0]);
    let q = &flight.columns["q"];
    assert_eq!(q.unit.as_deref(), Some("deg/s"));
    assert_eq!(
        (q.values[0], q.values[1].is_nan(), q.values[2]),
        (0.5, true, 1.5)
    );
    assert_eq!(flight.columns["obes"].values, [1.0, 0.0, 1.0]);
    let small: ArrayRef = Arc::new(Int8Array::from(vec![0, 1]));
    assert_eq!(
        read_one(&parquet(vec![("obes", None, small)]))
            .unwrap()
            .columns["obes"]
            .values,
        [0.0, 1.0]
    );
}

#[test]
fn timestamps_become_seconds() {
    let time: ArrayRef = Arc::new(TimestampMillisecondArray::from(vec![1_000, 1_025, 1_050]));
    let flight = read_one(&parquet(vec![("time", None, time)])).unwrap();
    assert_eq!(flight.columns["time"].values, [1.0, 1.025, 1.05]);
}

#[test]
fn a_column_of_text_is_named_with_the_type_found_and_expected() {
    let q: ArrayRef = Arc::new(StringArray::from(vec!["1.0", "2.0"]));
    let problem = read_one(&parquet(vec![
        ("time", None, floats(&[0.0, 1.0])),
        ("q", None, q),
    ]))
    .unwrap_err();
    assert_eq!(problem.flight_id, "f");
    assert!(problem.place.ends_with("f.parquet"));
    let expected = "column `q` (signal `q_deg_s`) is of type Utf8; expected a number (float, integer or boolean); write its numbers as numbers, or import the recording from CSV (`harvest import`)";
    assert_eq!(problem.reason, expected);
}

#[test]
fn a_timestamp_where_no_time_is_meant_is_refused() {
    let q: ArrayRef = Arc::new(TimestampMillisecondArray::from(vec![1]));
    let problem = read_one(&parquet(vec![("q", None, q)])).unwrap_err();
    assert!(
        problem.reason.contains("is of type Timestamp"),
        "{}",
        problem.reason
    );
}

#[test]
fn truncated_and_other_files_are_named_with_the_reason() {
    let whole = simple(&[0.0, 1.0, 2.0]);
    for bytes in [
        &whole[..whole.len() - 10],
        &whole[..20],
        b"",
        b"time,q\n0,1\n",
    ] {
        let problem = read_one(bytes).unwrap_err();
        assert!(problem.place.ends_with("f.parquet"));
        assert!(
            problem.reason.starts_with("not a readable Parquet file"),
            "{}",
            problem.reason
        );
    }
}

#[test]
fn rows_are_read_from_the_middle_of_row_groups_and_pages() {
    let schema = Arc::new(Schema::new(vec![Field::new("q", DataType::Float64, true)]));
    let properties = parquet::file::properties::WriterProperties::builder()
        .set_max_row_group_row_count(Some(1000))
        .set_data_page_row_count_limit(64)
        .set_write_batch_size(16)
        .build();
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, schema.clone(), Some(properties)).unwrap();
    let values: Vec<Option<f64>> = (0..5000_i32)
        .map(|k| (k % 7 != 0).then_some(f64::from(k)))
        .collect();
    writer
        .write(&RecordBatch::try_new(schema, vec![Arc::new(Float64Array::from(values))]).unwrap())
        .unwrap();
    writer.close().unwrap();
    let (_folder, text) = archive(&[("f.parquet", &bytes)]);
    let scratch = std::env::temp_dir().join("archive");
    let opened = open(&find(&text).unwrap()[0], &channels(), &scratch)
        .unwrap()
        .unwrap();
    assert_eq!((opened.files(), opened.rows(0)), (1, 5000));
    let mut read = Vec::new();
    opened
        .read(0, "q", 950..3100, &mut |v| read.extend_from_slice(v))
        .unwrap();
    assert_eq!(read.len(), 2150);
    let right = |row: usize, v: f64| {
        if row.is_multiple_of(7) {
            v.is_nan()
        } else {
            v.to_bits() == (row as f64).to_bits()
        }
    };
    assert!(read.iter().enumerate().all(|(i, v)| right(950 + i, *v)));
    assert!(opened.read(0, "q", 4900..5001, &mut |_| {}).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_reading_panic(mangled in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = simple(&[0.0, 0.025, 0.05, 0.075]);
        for (place, byte) in mangled {
            let k = place.index(bytes.len());
            bytes[k] = byte;
        }
        // Either outcome is fine, as long as there is one.
        let _ = read_one(&bytes);
    }
}

#[test]
fn mapped_columns_are_those_of_the_footer_or_the_names_of_a_tall_file() {
    let text = |words: &[&str]| Arc::new(StringArray::from(words.to_vec())) as ArrayRef;
    let tall = parquet(vec![
        ("time", Some("s"), floats(&[0.0, 0.0, 0.1])),
        ("name", None, text(&["q", "other", "q"])),
        ("value", None, floats(&[1.0, 2.0, 3.0])),
        ("unit", None, text(&["deg/s", "V", "deg/s"])),
    ]);
    let (_folder, archive) = archive(&[
        ("tall.parquet", &tall),
        ("text.parquet", b"no Parquet"),
        ("wide.parquet", &simple(&[0.0, 0.1])),
    ]);
    for flight in find(&archive).unwrap() {
        let listed = mapped_columns(&flight, &channels());
        if flight.flight_id == "text" {
            assert!(
                listed
                    .unwrap_err()
                    .reason
                    .contains("not a readable Parquet")
            );
            continue;
        }
        let listed = listed.unwrap();
        let units = listed[0].columns.iter();
        let units: Vec<(&str, Option<&str>)> = units
            .map(|(name, column)| (name.as_str(), column.unit.as_deref()))
            .collect();
        assert_eq!(units, [("q", Some("deg/s")), ("time", Some("s"))]);
    }
}
