//! Records are read back bit by bit, whole and in windows; a file that is no record is refused.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
use parquet::arrow::ArrowWriter;
use parquet::file::properties::WriterProperties;

use super::layout::{MARK, PAGE};
use super::*;
use crate::error::Error;
use crate::flight::record::Series;
use crate::flight::{Mark, Record};

/// Writes a record that is in memory.
fn write(record: &Record, out: &mut Vec<u8>) -> Result<(), String> {
    let header = RecordHeader {
        flight_id: record.flight_id.clone(),
        start_s: record.start_s,
        step_s: record.step_s,
        samples: record.samples,
        constants: BTreeMap::new(),
    };
    let mut writer = Writer::create(&header, record.signals.keys().map(String::as_str), out)?;
    for from in (0..record.samples).step_by(GROUP) {
        let to = (from + GROUP).min(record.samples);
        let mut parts = writer.group()?.into_iter().zip(record.signals.values());
        writer.append(|| {
            let Some((mut signal, series)) = parts.next() else {
                return Ok(None);
            };
            signal.push(&series.values[from..to], &series.marks[from..to])?;
            Ok(Some(vec![signal.close()?]))
        })?;
    }
    writer.finish()
}

/// Reads a whole record.
fn read(path: &Path) -> Result<Record, Error> {
    let file = open(path)?;
    file.window(None, 0..file.header.samples)
}

fn record() -> Record {
    let values = vec![
        1.5,
        f64::from_bits(0x7ff8_0000_0000_0001),
        -0.0,
        1e-310,
        57.295_779_513_082_32,
    ];
    let marks = vec![
        Mark::Measured,
        Mark::Missing,
        Mark::Bridged,
        Mark::Despiked,
        Mark::Measured,
    ];
    let flag = Series {
        values: vec![0.0, 0.0, 1.0, 1.0, 1.0],
        marks: vec![Mark::Measured; 5],
    };
    let dead = Series {
        values: vec![f64::NAN; 5],
        marks: vec![Mark::Missing; 5],
    };
    let alpha = Series { values, marks };
    Record {
        flight_id: "flight 007 ä".to_owned(),
        start_s: 0.1 + 0.2,
        step_s: 0.025_000_000_000_000_3,
        samples: 5,
        signals: [
            ("alpha_vane_deg".to_owned(), alpha),
            ("mach".to_owned(), dead),
            ("obes".to_owned(), flag),
        ]
        .into(),
        remaining_errors: BTreeMap::new(),
    }
}

fn bytes(record: &Record) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(record, &mut bytes).expect("written");
    bytes
}

fn saved(bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.parquet");
    std::fs::write(&path, bytes).expect("written");
    (folder, path)
}

#[test]
fn a_record_comes_back_to_the_bit() {
    let (given, (_folder, path)) = (record(), saved(&bytes(&record())));
    let back = read(&path).expect("a record");
    assert_eq!(
        (&back.flight_id, back.samples),
        (&given.flight_id, given.samples)
    );
    assert_eq!(back.start_s.to_bits(), given.start_s.to_bits());
    assert_eq!(back.step_s.to_bits(), given.step_s.to_bits());
    assert!(back.signals.keys().eq(given.signals.keys()));
    for (a, b) in back.signals.values().zip(given.signals.values()) {
        assert_eq!(a.marks, b.marks);
        let bits = |s: &Series| s.values.iter().map(|v| v.to_bits()).collect::<Vec<u64>>();
        assert_eq!(bits(a), bits(b));
    }
}

#[test]
fn the_same_record_is_the_same_bytes() {
    assert_eq!(bytes(&record()), bytes(&record()));
}

/// A signal of several row groups and pages.
fn long() -> Record {
    let samples = GROUP + 3 * PAGE + 77;
    let values: Vec<f64> = (0..samples).map(|k| (k as f64 * 0.01).sin()).collect();
    let mark = |k: usize| {
        if k % 1000 == 3 {
            Mark::Bridged
        } else {
            Mark::Measured
        }
    };
    let q = Series {
        values,
        marks: (0..samples).map(mark).collect(),
    };
    Record {
        samples,
        signals: [("q_deg_s".to_owned(), q)].into(),
        ..record()
    }
}

#[test]
fn a_window_is_the_part_of_the_record() {
    let (given, (_folder, path)) = (long(), saved(&bytes(&long())));
    let file = open(&path).expect("a record");
    let (start_s, end_s) = (given.time_s(GROUP - 40), given.time_s(GROUP + 90));
    let (part, own) = (
        given.part(start_s, end_s),
        file.part(None, start_s, end_s).expect("a part"),
    );
    assert_eq!(own.signals, part.signals);
    assert_eq!(
        (own.samples, own.start_s.to_bits()),
        (part.samples, part.start_s.to_bits())
    );
    let none = BTreeSet::from(["mach".to_owned()]);
    assert!(
        file.window(Some(&none), 0..10)
            .expect("a window")
            .signals
            .is_empty()
    );
    assert_eq!(
        file.window(None, given.samples - 5..given.samples + 5)
            .expect("a window")
            .samples,
        5
    );
}

#[test]
fn an_outline_keeps_the_extremes_and_the_marks() {
    let mut given = long();
    given
        .signals
        .values_mut()
        .for_each(|s| s.values[300_001] = 40.0);
    let (_folder, path) = saved(&bytes(&given));
    let outline = open(&path)
        .expect("a record")
        .outline(5000)
        .expect("an outline");
    let q = &outline.signals["q_deg_s"];
    assert!((4000..=5000).contains(&outline.samples) && q.values.len() == outline.samples);
    let k = q.values.iter().position(|v| *v > 2.0).expect("the peak");
    assert!((outline.time_s(k) - given.time_s(300_001)).abs() < 2.0 * outline.step_s);
    assert!(q.marks.contains(&Mark::Bridged));
}

#[test]
fn constants_come_back_in_every_window() {
    let header = RecordHeader {
        samples: 3,
        step_s: 0.1,
        constants: [("mach".to_owned(), 0.3)].into(),
        ..RecordHeader::default()
    };
    let mut out = Vec::new();
    let mut writer = Writer::create(&header, ["obes"].into_iter(), &mut out).expect("a writer");
    let mut parts = writer.group().expect("a group").into_iter();
    let mut next = || {
        let Some(mut signal) = parts.next() else {
            return Ok(None);
        };
        signal.push(&[0.0; 3], &[Mark::Measured; 3])?;
        Ok(Some(vec![signal.close()?]))
    };
    writer.append(&mut next).expect("appended");
    writer.finish().expect("finished");
    let (_folder, path) = saved(&out);
    let window = open(&path)
        .expect("a record")
        .window(None, 1..3)
        .expect("a window");
    assert_eq!(window.values("mach"), Some(&[0.3, 0.3][..]));
    assert_eq!(window.values("obes"), Some(&[0.0, 0.0][..]));
}

#[test]
fn a_series_with_fewer_marks_than_values_is_refused() {
    let mut out = Vec::new();
    let header = RecordHeader::default();
    let mut writer = Writer::create(&header, ["obes"].into_iter(), &mut out).expect("a writer");
    let mut signals = writer.group().expect("a group");
    let refused = signals[0].push(&[0.0; 3], &[Mark::Measured; 2]);
    let refused = refused.expect_err("refused");
    assert!(refused.contains("more values than marks"), "{refused}");
}

#[test]
fn what_is_not_a_record_is_refused_and_named() {
    let whole = bytes(&record());
    for broken in [&whole[..whole.len() / 2], b"PAR1", b""] {
        let (_folder, path) = saved(broken);
        let error = read(&path).expect_err("refused").to_string();
        assert!(error.contains("record.parquet: not a record"), "{error}");
    }
    assert!(read(Path::new("no such record.parquet")).is_err());
}

#[test]
fn a_column_of_another_type_is_refused_and_named() {
    let header = RecordHeader {
        samples: 2,
        step_s: 0.1,
        ..RecordHeader::default()
    };
    let values: ArrayRef = Arc::new(Float64Array::from(vec![1.0, 2.0]));
    let codes =
        |codes: [Option<i64>; 2]| -> ArrayRef { Arc::new(Int64Array::from(codes.to_vec())) };
    let values_with_gap: ArrayRef = Arc::new(Float64Array::from(vec![Some(1.0), None]));
    let marks = format!("q_deg_s{MARK}");
    for (name, column) in [
        ("q_deg_s", codes([Some(1), Some(2)])),
        ("q_deg_s", values_with_gap),
        (marks.as_str(), codes([None, Some(2)])),
    ] {
        let columns = [("theta_deg", values.clone()), (name, column)];
        let batch = RecordBatch::try_from_iter(columns).expect("a batch");
        let properties =
            WriterProperties::builder().set_key_value_metadata(Some(header.metadata()));
        let mut out = Vec::new();
        let mut writer = ArrowWriter::try_new(&mut out, batch.schema(), Some(properties.build()))
            .expect("a writer");
        writer.write(&batch).expect("written");
        writer.close().expect("closed");
        let (_folder, path) = saved(&out);
        let error = read(&path).expect_err("refused").to_string();
        assert!(error.contains(&format!("column `{name}`")), "{error}");
    }
}

#[test]
fn a_record_with_a_damaged_byte_ends_no_program() {
    let whole = bytes(&record());
    for at in 0..whole.len() {
        let mut spoilt = whole.clone();
        spoilt[at] ^= 0x55;
        let (_folder, path) = saved(&spoilt);
        if let Ok(record) = read(&path) {
            let samples = record.samples;
            assert!(record.signals.values().all(|s| s.values.len() == samples));
        }
    }
}
