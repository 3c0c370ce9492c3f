//! Formats that harvest does not read, by the first bytes of a file, with the way to one that it reads.

use std::path::Path;

/// Beginning of a file, the format, and what to do.
const FORMATS: &[(&[u8], &str, &str)] = &[
    (b"\xd0\xcf\x11\xe0", "an Excel workbook", SAVE_SHEET),
    (b"TDSm", "a TDMS file of LabVIEW", EXPORT),
    (b"MDF ", "an MDF file of ASAM", EXPORT),
    (b"\x25\xeb", "a file of IRIG 106 chapter 10", EXPORT),
    (b"CDF\x01", "a netCDF file of the classic form", TO_NETCDF_4),
    (b"CDF\x02", "a netCDF file of the classic form", TO_NETCDF_4),
    (b"CDF\x05", "a netCDF file of the classic form", TO_NETCDF_4),
    (b"ARROW1", "an Arrow file", "write it as Parquet"),
    (
        b"\x93NUMPY",
        "an array of NumPy",
        "write its columns as CSV or Parquet",
    ),
    (
        b"SQLite format 3",
        "an SQLite database",
        "export the table as CSV",
    ),
    (b"BZh", "a file packed with bzip2", UNPACK),
    (b"\xfd7zXZ", "a file packed with xz", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a file packed with zstd", UNPACK),
    (b"7z\xbc\xaf", "a 7z archive", UNPACK),
    (ZIP, "a zip archive", UNPACK),
];

const ZIP: &[u8] = b"PK\x03\x04";
const SAVE_SHEET: &str = "save the sheet of the recording as CSV";
const EXPORT: &str = "export it as CSV, MATLAB or HDF5";
const TO_NETCDF_4: &str = "convert it to netCDF-4, which is HDF5";
const UNPACK: &str = "unpack it first";

/// Extensions of workbooks, which are zip archives.
const WORKBOOKS: [&str; 3] = ["xlsx", "xlsm", "ods"];

/// Message for a file of a format that harvest does not read, or of binary numbers; `None` for a text.
pub fn foreign_format(source: &Path, head: &[u8]) -> Option<String> {
    let extension = source.extension().and_then(|e| e.to_str());
    let is_workbook =
        extension.is_some_and(|e| WORKBOOKS.iter().any(|own| own.eq_ignore_ascii_case(e)));
    if is_workbook && head.starts_with(ZIP) {
        return Some(format!("it is a workbook: {SAVE_SHEET}"));
    }
    let known = FORMATS.iter().find(|(first, _, _)| head.starts_with(first));
    if let Some((_, format, remedy)) = known {
        return Some(format!("it is {format}: {remedy}"));
    }
    head.contains(&0)
        .then(|| format!("it is binary, of a format that harvest does not read: {EXPORT}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_formats_are_named_with_what_to_do() {
        let message = |name: &str, head: &[u8]| foreign_format(Path::new(name), head);
        for (name, head, words) in [
            ("a.xlsx", ZIP, "as CSV"),
            ("a.zip", ZIP, "unpack it"),
            ("a.tdms", b"TDSm\x0e".as_slice(), "LabVIEW"),
            ("a.nc", b"CDF\x01\0", "netCDF-4"),
            ("a.dat", b"\x01\0\0\0", "binary"),
        ] {
            assert!(
                message(name, head).is_some_and(|m| m.contains(words)),
                "{name}"
            );
        }
        assert_eq!(message("a.csv", b"time,q\n0,1\n"), None);
    }
}
