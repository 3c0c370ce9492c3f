//! Import: recordings in other formats come back from the archive bit by bit, with their units.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use harvest::inspection::{Column, Recording};
use harvest::store::{archive, unmapped_recording};

use crate::support::{Outcome, Random, harvest, run, write};

/// Values that a careless reader spoils.
const HARD: [f64; 8] = [
    0.1 + 0.2,
    1.0 / 3.0,
    -5e-324,
    1.797_693_134_862_315_7e308,
    123_456_789.123_456_78,
    -0.0,
    2.5e-7,
    1.0,
];

/// Three columns of random bits between hard values.
fn columns(rows: u32) -> Vec<(&'static str, &'static str, Vec<f64>)> {
    let mut random = Random::new(11);
    let mut values = |k: u32| match HARD.get(k as usize) {
        Some(value) => *value,
        None => (random.unit() - 0.5) * 10_f64.powi(i32::try_from(k % 40).unwrap() - 20),
    };
    let q = (0..rows).map(&mut values).collect();
    let de = (0..rows).map(&mut values).collect();
    let time = (0..rows).map(|k| f64::from(k) * 0.02).collect();
    vec![("time", "s", time), ("q", "rad/s", q), ("de", "deg", de)]
}

fn import(folder: &Path, file: &str) -> Outcome {
    import_with(folder, file, &[])
}

/// The imported recording.
fn imported(folder: &Path) -> Recording {
    let flights = archive::find(&folder.join("flights").display().to_string()).unwrap();
    assert_eq!(flights.len(), 1);
    unmapped_recording::first_rows(&flights[0], usize::MAX)
        .unwrap()
        .remove(0)
}

fn check(recording: &Recording, name: &str, unit: Option<&str>, values: &[f64]) {
    let column: &Column = recording.column(name).unwrap();
    assert_eq!(column.stated.as_deref(), unit, "{name}");
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&column.values), bits(values), "{name}");
}

#[test]
fn text_with_decimal_commas_and_a_row_of_units_comes_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(40_000);
    let mut text = "# Messung\ntime;q;de;mode\ns;rad/s;deg;\n".to_owned();
    for k in 0..columns[0].2.len() {
        let row = columns
            .iter()
            .map(|(_, _, v)| format!("{:?}", v[k]).replace('.', ","));
        text += &(row.collect::<Vec<_>>().join(";") + ";AUTO\r\n");
    }
    fs::write(folder.path().join("f.csv"), text).unwrap();
    let outcome = import(folder.path(), "f.csv");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(
        outcome
            .stdout
            .contains("columns of text are left out: mode"),
        "{}",
        outcome.stdout
    );
    let recording = imported(folder.path());
    for (name, unit, values) in &columns {
        check(&recording, name, Some(unit), values);
    }
    let manifest = fs::read_to_string(folder.path().join("flights/import.json")).unwrap();
    let bytes = fs::read(folder.path().join("f.csv")).unwrap();
    assert!(manifest.contains(&blake3::hash(&bytes).to_hex().to_string()));
    assert!(
        manifest.contains("rad/s") && manifest.contains("40000"),
        "{manifest}"
    );
}

#[test]
fn units_that_harvest_does_not_have_are_kept_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let text = "Zeit;q;alpha\ns;Grd/s;Grad\n0,1;1,5;2\n0,2;1,75;3\n";
    fs::write(folder.path().join("f.csv"), text).unwrap();
    let outcome = import(folder.path(), "f.csv");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let note = "this unit is unknown to harvest and kept as text: `Grd/s` of q";
    assert!(outcome.stdout.contains(note), "{}", outcome.stdout);
    let recording = imported(folder.path());
    check(&recording, "Zeit", Some("s"), &[0.1, 0.2]);
    check(&recording, "q", Some("Grd/s"), &[1.5, 1.75]);
    check(&recording, "alpha", Some("Grad"), &[2.0, 3.0]);
}

#[test]
fn packed_text_with_calendar_times_is_read_as_seconds_from_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let text = "time,q [deg/s]\n2024-05-01T23:59:59.75Z,1.5\n2024-05-02T00:00:00.25Z,2.5\n";
    let file = fs::File::create(folder.path().join("f.csv.gz")).unwrap();
    let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::default());
    encoder.write_all(text.as_bytes()).unwrap();
    encoder.finish().unwrap();
    let outcome = import(folder.path(), "f.csv.gz");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let recording = imported(folder.path());
    check(&recording, "time", Some("s"), &[0.0, 0.5]);
    check(&recording, "q", Some("deg/s"), &[1.5, 2.5]);
    let files = fs::read_dir(folder.path().join("flights")).unwrap();
    let mut names: Vec<String> = files
        .map(|file| file.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, ["f.parquet", "import.json"]);
}

#[test]
fn tall_text_becomes_one_column_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(3_000);
    let mut text = b"time;name;value;unit\n".to_vec();
    for (k, time) in columns[0].2.iter().enumerate() {
        for (name, unit, values) in &columns[1..] {
            writeln!(text, "{time:?};{name};{:?};{unit}", values[k]).unwrap();
        }
    }
    fs::write(folder.path().join("f.csv"), text).unwrap();
    let outcome = import(folder.path(), "f.csv");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let recording = imported(folder.path());
    check(&recording, "time", None, &columns[0].2);
    check(&recording, "q", Some("rad/s"), &columns[1].2);
    check(&recording, "de", Some("deg"), &columns[2].2);
    assert_eq!(recording.columns.len(), 3);
}

#[test]
fn a_tall_file_in_any_order_becomes_one_column_a_name() {
    let columns = columns(20_000);
    let time = &columns[0].2;
    for by_time in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        let mut rows: Vec<(f64, &str, f64)> = Vec::new();
        for (name, _, values) in &columns[1..] {
            // The second channel is recorded at a fifth of the rate.
            let every = if *name == "de" { 5 } else { 1 };
            let each = time.iter().zip(values).step_by(every);
            rows.extend(each.map(|(t, v)| (*t, *name, *v)));
        }
        if by_time {
            rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let array = |f: &dyn Fn(&(f64, &str, f64)) -> f64| {
            Arc::new(rows.iter().map(f).map(Some).collect::<Float64Array>()) as ArrayRef
        };
        let names = Arc::new(rows.iter().map(|r| Some(r.1)).collect::<StringArray>()) as ArrayRef;
        let unit = |r: &(f64, &str, f64)| if r.1 == "q" { "rad/s" } else { "deg" };
        let units =
            Arc::new(rows.iter().map(|r| Some(unit(r))).collect::<StringArray>()) as ArrayRef;
        let batch = RecordBatch::try_from_iter([
            ("Time", array(&|r| r.0)),
            ("Parameter", names),
            ("Value", array(&|r| r.2)),
            ("Unit", units),
        ])
        .unwrap();
        write(&batch, &folder.path().join("tall.parquet"));
        let outcome = import(folder.path(), "tall.parquet");
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        let recording = imported(folder.path());
        check(&recording, "Time", None, time);
        check(&recording, "q", Some("rad/s"), &columns[1].2);
        let de = &recording.column("de").unwrap().values;
        for (k, (value, recorded)) in de.iter().zip(&columns[2].2).enumerate() {
            assert_eq!(value.is_nan(), k % 5 != 0, "{k}");
            assert!(k % 5 != 0 || value.to_bits() == recorded.to_bits(), "{k}");
        }
    }
}

/// Element of a MATLAB file: tag, bytes, padding.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend(u32::try_from(data.len()).unwrap().to_le_bytes());
    bytes.extend(data);
    if kind != 15 {
        bytes.resize(bytes.len().next_multiple_of(8), 0);
    }
    bytes
}

/// Matrix of a MATLAB file: class, dimensions, name, and what follows.
fn matrix(class: u8, dimensions: [i32; 2], name: &str, rest: &[u8]) -> Vec<u8> {
    let mut data = element(6, &[class, 0, 0, 0, 0, 0, 0, 0]);
    data.extend(element(5, &dimensions.map(i32::to_le_bytes).concat()));
    data.extend(element(1, name.as_bytes()));
    data.extend(rest);
    element(14, &data)
}

fn doubles(name: &str, dimensions: [i32; 2], values: &[f64]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    matrix(6, dimensions, name, &element(9, &bytes))
}

fn characters(name: &str, text: &str) -> Vec<u8> {
    let codes: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    matrix(
        4,
        [1, i32::try_from(text.len()).unwrap()],
        name,
        &element(4, &codes),
    )
}

fn matlab(folder: &Path, variables: &[Vec<u8>]) {
    let mut bytes = format!("{:124}", "MATLAB 5.0 MAT-file").into_bytes();
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(variables.concat());
    fs::write(folder.join("f.mat"), bytes).unwrap();
}

/// The element as MATLAB's `-v7` writes it.
fn compressed(variable: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(variable).unwrap();
    element(15, &encoder.finish().unwrap())
}

#[test]
fn a_struct_that_holds_all_columns_is_left_out_of_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(500);
    let fields = [
        element(5, &8_i32.to_le_bytes()),
        element(1, b"time\0\0\0\0q\0\0\0\0\0\0\0"),
        doubles("", [500, 1], &columns[0].2),
        doubles("", [500, 1], &columns[1].2),
    ];
    let variables = [
        matrix(2, [1, 1], "rec", &fields.concat()),
        characters("aircraft", "DR400"),
    ];
    matlab(folder.path(), &variables);
    let outcome = import(folder.path(), "f.mat");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let note = "all names begin with `rec.`";
    assert!(outcome.stdout.contains(note), "{}", outcome.stdout);
    let recording = imported(folder.path());
    check(&recording, "time", None, &columns[0].2);
    check(&recording, "q", None, &columns[1].2);
}

#[test]
fn structs_of_an_array_have_the_names_of_their_labels() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(50);
    let signals = [
        element(5, &8_i32.to_le_bytes()),
        element(1, b"label\0\0\0values\0\0"),
        characters("", "q"),
        doubles("", [50, 1], &columns[1].2),
        characters("", "de"),
        doubles("", [50, 1], &columns[2].2),
    ];
    let fields = [
        element(5, &8_i32.to_le_bytes()),
        element(1, b"time\0\0\0\0signals\0"),
        doubles("", [50, 1], &columns[0].2),
        matrix(2, [1, 2], "", &signals.concat()),
    ];
    matlab(folder.path(), &[matrix(2, [1, 1], "out", &fields.concat())]);
    let outcome = import(folder.path(), "f.mat");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let recording = imported(folder.path());
    for (name, _, values) in &columns {
        check(&recording, name, None, values);
    }
}

#[test]
fn matlab_vectors_structs_and_matrices_come_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(3_000);
    let signal = [
        element(5, &8_i32.to_le_bytes()),
        element(1, b"data\0\0\0\0unit\0\0\0\0"),
        doubles("", [1, 3_000], &columns[2].2),
        characters("", "deg"),
    ];
    let pair: Vec<f64> = columns[1].2.iter().chain(&columns[2].2).copied().collect();
    let names = [characters("", "roll"), characters("", "yaw")].concat();
    matlab(
        folder.path(),
        &[
            doubles("time", [3_000, 1], &columns[0].2),
            compressed(&doubles("q", [3_000, 1], &columns[1].2)),
            compressed(&matrix(2, [1, 1], "de", &signal.concat())),
            doubles("rates", [3_000, 2], &pair),
            matrix(1, [1, 2], "names", &names),
            doubles("gain", [1, 1], &[4.0]),
            doubles("slow", [7, 1], &[1.0; 7]),
        ],
    );
    let outcome = import(folder.path(), "f.mat");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(
        outcome.stdout.contains("`slow` is left out: 7 values"),
        "{}",
        outcome.stdout
    );
    let recording = imported(folder.path());
    check(&recording, "time", None, &columns[0].2);
    check(&recording, "q", None, &columns[1].2);
    check(&recording, "de", Some("deg"), &columns[2].2);
    check(&recording, "roll", None, &columns[1].2);
    check(&recording, "yaw", None, &columns[2].2);
    assert_eq!(recording.columns.len(), 5);
}

/// Imports a file with further arguments.
fn import_with(folder: &Path, file: &str, options: &[&str]) -> Outcome {
    let mut command = harvest();
    command
        .current_dir(folder)
        .args(["import", file, "--to", "flights"])
        .args(options);
    run(&mut command)
}

#[test]
fn columns_without_names_take_those_of_the_analyst_and_a_step_their_clock() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(900);
    let rows = (0..900).map(|k| format!("{:?} 7 {:?}\n", columns[1].2[k], columns[2].2[k]));
    fs::write(folder.path().join("f.asc"), rows.collect::<String>()).unwrap();
    let outcome = import(folder.path(), "f.asc");
    let note = "names none of its 3 columns";
    assert!(outcome.stdout.contains(note), "{}", outcome.stdout);
    let names = ["--names", "q [rad/s], -, de [deg]", "--step", "0.02"];
    let outcome = import_with(folder.path(), "f.asc", &names);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(!outcome.stdout.contains("names none"), "{}", outcome.stdout);
    let recording = imported(folder.path());
    for (name, unit, values) in &columns {
        check(&recording, name, Some(unit), values);
    }
    assert_eq!(recording.columns.len(), 3);
    let refused = import_with(folder.path(), "f.asc", &["--names", "q, de"]);
    let message = "--names has 2 names, and the file 3 columns";
    assert!(
        refused.code == Some(1) && refused.stderr.contains(message),
        "{}",
        refused.stderr
    );
}

#[test]
fn utf16_text_with_separators_of_thousands_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let text =
        "irig,altitude [ft]\r\n214:23:59:59.5,\"24,999.5\"\r\n215:00:00:00.0,\"25,000.25\"\r\n";
    let mut bytes = vec![0xff, 0xfe];
    bytes.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
    fs::write(folder.path().join("f.txt"), bytes).unwrap();
    let outcome = import(folder.path(), "f.txt");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let recording = imported(folder.path());
    check(&recording, "irig", Some("s"), &[18_575_999.5, 18_576_000.0]);
    check(&recording, "altitude", Some("ft"), &[24_999.5, 25_000.25]);
}

#[test]
fn a_note_beside_the_recordings_of_a_folder_is_left_out_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let from = folder.path().join("runs");
    fs::create_dir(&from).unwrap();
    fs::write(from.join("a.csv"), "time,q\n0,1\n0.1,2\n").unwrap();
    fs::write(from.join("README.txt"), "Dear reader,\nno numbers here.\n").unwrap();
    let outcome = import(folder.path(), "runs");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let note = "README.txt: left out, it has no table of numbers";
    assert!(outcome.stdout.contains(note), "{}", outcome.stdout);
    check(&imported(folder.path()), "q", None, &[1.0, 2.0]);
    fs::remove_file(from.join("a.csv")).unwrap();
    let outcome = import(folder.path(), "runs");
    assert_eq!(outcome.code, Some(1), "{}", outcome.stdout);
}

#[test]
fn complex_numbers_are_left_out_and_named_unless_they_are_real() {
    let folder = tempfile::tempdir().unwrap();
    let complex = |name: &str, imaginary: f64| {
        let part = |value: f64| element(9, &[value.to_le_bytes(); 3].concat());
        let mut data = element(6, &[6, 8, 0, 0, 0, 0, 0, 0]);
        data.extend(element(5, &[3_i32, 1].map(i32::to_le_bytes).concat()));
        data.extend(element(1, name.as_bytes()));
        data.extend([part(2.0), part(imaginary)].concat());
        element(14, &data)
    };
    let variables = [
        doubles("time", [3, 1], &[0.0, 0.1, 0.2]),
        complex("q", 0.0),
        complex("p", 0.5),
    ];
    matlab(folder.path(), &variables);
    let outcome = import(folder.path(), "f.mat");
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let note = "`p` is left out: complex numbers; save the real part";
    assert!(outcome.stdout.contains(note), "{}", outcome.stdout);
    let recording = imported(folder.path());
    check(&recording, "q", None, &[2.0; 3]);
    assert!(recording.column("p").is_none());
}

#[test]
fn a_matrix_without_names_takes_those_of_the_analyst() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns(900);
    let all: Vec<f64> = columns
        .iter()
        .flat_map(|(_, _, v)| v.iter().copied())
        .collect();
    matlab(folder.path(), &[doubles("fdata", [900, 3], &all)]);
    let outcome = import(folder.path(), "f.mat");
    let note = "names none of its 3 columns";
    assert!(outcome.stdout.contains(note), "{}", outcome.stdout);
    let names = ["--names", "time [s],q [rad/s],de [deg]"];
    let outcome = import_with(folder.path(), "f.mat", &names);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let recording = imported(folder.path());
    for (name, unit, values) in &columns {
        check(&recording, name, Some(unit), values);
    }
}

#[test]
fn a_tall_text_takes_no_names() {
    let folder = tempfile::tempdir().unwrap();
    let text = "time,name,value\n0,q,1\n0,de,2\n0.1,q,3\n";
    fs::write(folder.path().join("f.csv"), text).unwrap();
    let refused = import_with(folder.path(), "f.csv", &["--names", "time, q"]);
    assert_eq!(refused.code, Some(1));
    assert!(
        refused.stderr.contains("leave --names and --step out"),
        "{}",
        refused.stderr
    );
}

/// File of tests/data as a recording in a folder.
fn shipped(folder: &Path, name: &str) -> Vec<u8> {
    let bytes = fs::read(Path::new("tests/data").join(name)).unwrap();
    fs::write(folder.join(name), &bytes).unwrap();
    bytes
}

fn import_shipped(folder: &Path, name: &str) -> Outcome {
    shipped(folder, name);
    let outcome = import(folder, name);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    outcome
}

/// Values of both HDF5 files, for sample k.
fn written(value: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..200).map(|k| value(f64::from(k))).collect()
}

#[test]
fn matlab_7_3_comes_back_to_the_bit() {
    // By the HDF5 library, laid out as MATLAB lays it out: a column, a matrix with names, a struct of one signal.
    let folder = tempfile::tempdir().unwrap();
    let outcome = import_shipped(folder.path(), "matlab_7_3.mat");
    let slow = "`slow` is left out: 7 values";
    assert!(outcome.stdout.contains(slow), "{}", outcome.stdout);
    let recording = imported(folder.path());
    let q = |k: f64| (37.0 * k % 101.0) / 8.0;
    check(&recording, "time", None, &written(|k| k / 40.0));
    check(&recording, "q", None, &written(q));
    check(&recording, "de", Some("deg"), &written(|k| 2.0 * q(k)));
    check(
        &recording,
        "roll",
        None,
        &written(|k| (11.0 * k % 53.0) / 4.0 - 3.0),
    );
    check(&recording, "yaw", None, &written(|k| k * k / 64.0));
    check(&recording, "counts", None, &written(|k| k % 100.0 - 50.0));
    assert_eq!(recording.columns.len(), 6);
}

#[test]
fn hdf5_of_other_programs_has_its_units_as_attributes() {
    // Compressed chunks, shuffled bytes, big-endian integers, a group.
    let folder = tempfile::tempdir().unwrap();
    import_shipped(folder.path(), "recording.h5");
    let recording = imported(folder.path());
    check(&recording, "time", Some("s"), &written(|k| k / 40.0));
    let q = written(|k| (37.0 * k % 101.0) / 8.0);
    check(&recording, "adc.q", Some("deg/s"), &q);
    check(
        &recording,
        "adc.counts",
        None,
        &written(|k| k % 100.0 - 50.0),
    );
    assert_eq!(recording.columns.len(), 3);
}

#[test]
fn references_that_branch_at_every_level_are_refused() {
    // Each cell array refers ten times to the next one: 10^9 arrays for who follows them all.
    let folder = tempfile::tempdir().unwrap();
    shipped(folder.path(), "references.h5");
    let outcome = import(folder.path(), "references.h5");
    assert_eq!(outcome.code, Some(1));
    let wanted = "more than 100000 arrays and structs";
    assert!(outcome.stderr.contains(wanted), "{}", outcome.stderr);
}

#[cfg(target_os = "linux")]
#[test]
fn a_pipe_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.csv");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    for command in ["import", "init"] {
        let mut harvest = harvest();
        match command {
            "import" => harvest
                .args(["import"])
                .arg(&pipe)
                .arg("--to")
                .arg(folder.path()),
            _ => harvest.args(["init", "piped", "--from"]).arg(&pipe),
        };
        let outcome = run(&mut harvest);
        assert_eq!(outcome.code, Some(1), "{command}");
        let wanted = "which may never end";
        assert!(
            outcome.stderr.contains(wanted),
            "{command}: {}",
            outcome.stderr
        );
    }
}

#[test]
fn damaged_hdf5_is_refused_or_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random::new(23);
    for name in ["matlab_7_3.mat", "recording.h5"] {
        let whole = shipped(folder.path(), name);
        for trial in 0..40 {
            let mut bytes = whole.clone();
            if trial % 2 == 0 {
                bytes.truncate(520 + random.below(whole.len() - 520));
            } else {
                // The first bytes make it HDF5 at all.
                let at = 530 + random.below(4000);
                bytes[at] ^= 1 << random.below(8);
            }
            fs::write(folder.path().join(name), bytes).unwrap();
            let outcome = import(folder.path(), name);
            assert!(
                matches!(outcome.code, Some(0 | 1)),
                "{name}, {trial}: {outcome:?}"
            );
        }
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut hdf5 = format!("{:512}", "MATLAB 7.3 MAT-file").into_bytes();
    hdf5.extend(b"\x89HDF\r\n\x1a\n");
    let cut = doubles("time", [3, 1], &[1.0, 2.0, 3.0]);
    for (file, bytes, words) in [
        ("f.mat", hdf5, "an HDF5 file that cannot be read"),
        (
            "prose.txt",
            b"Dear reader,\nno numbers here.\n".to_vec(),
            "no table of numbers",
        ),
        ("old.mat", vec![0; 400], "'-v7'"),
        (
            "book.xlsx",
            b"PK\x03\x04 xl/workbook.xml".to_vec(),
            "as CSV",
        ),
    ] {
        fs::write(folder.path().join(file), bytes).unwrap();
        let outcome = import(folder.path(), file);
        assert_eq!(outcome.code, Some(1), "{file}");
        assert!(outcome.stderr.contains(words), "{file}: {}", outcome.stderr);
    }
    matlab(folder.path(), &[cut[..40].to_vec()]);
    let outcome = import(folder.path(), "f.mat");
    assert!(outcome.stderr.contains("cut off"), "{}", outcome.stderr);
    let wide =
        RecordBatch::try_from_iter([("a", Arc::new(Float64Array::from(vec![1.0])) as ArrayRef)])
            .unwrap();
    write(&wide, &folder.path().join("wide.parquet"));
    let outcome = import(folder.path(), "wide.parquet");
    assert!(
        outcome.stderr.contains("time, name, value"),
        "{}",
        outcome.stderr
    );
    assert!(!folder.path().join("flights").exists());
}
