//! Packed recordings: `flight.csv.gz`, unpacked into a temporary file.

use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;
use tempfile::NamedTempFile;

use super::imported_contents::{refused, scratch_in, unwritable};
use crate::error::{Error, Result};
use crate::store::regular;

/// First bytes of a packed file.
pub const SIGNATURE: &[u8] = b"\x1f\x8b";

/// Largest unpacked file: more than any recording, less than a disk.
const LARGEST_UNPACKED: u64 = 64 << 30;

/// Name of a file without `.gz` at its end.
pub fn unpacked_name(path: &Path) -> PathBuf {
    let is_packed = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    if is_packed {
        path.with_extension("")
    } else {
        path.to_owned()
    }
}

/// Unpacks a file into a temporary one in a folder, which has the extension of the unpacked name.
pub fn unpacked(source: &Path, folder: &Path) -> Result<NamedTempFile> {
    let extension = unpacked_name(source)
        .extension()
        .map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
    let mut unpacked = scratch_in(folder, &extension)?;
    let packed = regular::open(source).map_err(Error::io(source, "cannot open it"))?;
    let mut decoder = MultiGzDecoder::new(BufReader::new(packed)).take(LARGEST_UNPACKED);
    let mut bytes = vec![0; 1 << 16];
    loop {
        let count = decoder.read(&mut bytes).map_err(|e| {
            refused(
                source,
                &format!("it is damaged, or no gzip file: {e}; unpack it first"),
            )
        })?;
        let Some(bytes) = bytes.get(..count).filter(|bytes| !bytes.is_empty()) else {
            break;
        };
        unpacked.write_all(bytes).map_err(unwritable(folder))?;
    }
    if decoder.limit() == 0 {
        return Err(refused(source, "it unpacks to more than 64 GiB"));
    }
    unpacked.flush().map_err(unwritable(folder))?;
    Ok(unpacked)
}
