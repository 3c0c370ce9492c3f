//! UTF-16 text, which LabVIEW and spreadsheets write, as UTF-8 in a temporary file.

use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use super::imported_contents::{scratch_in, unwritable};
use crate::error::{Error, Result};
use crate::store::regular;

/// Marks at the beginning of the text, low byte first and high byte first.
pub const SIGNATURES: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];

/// Bytes that are read at once: an even number.
const AT_ONCE: usize = 1 << 16;

/// Writes a text as UTF-8 into a temporary file in a folder. A unit that is no character becomes the replacement
/// character.
pub fn as_utf8(source: &Path, folder: &Path) -> Result<NamedTempFile> {
    let unreadable = || Error::io(source, "cannot read it");
    let file = regular::open(source).map_err(Error::io(source, "cannot open it"))?;
    let mut reader = BufReader::new(file);
    let mut mark = [0; 2];
    reader.read_exact(&mut mark).map_err(unreadable())?;
    let is_high_first = mark == SIGNATURES[1];
    let mut decoded = scratch_in(folder, ".csv")?;
    let mut writer = BufWriter::new(decoded.as_file_mut());
    let mut bytes = Vec::with_capacity(AT_ONCE);
    // First half of a character that the bytes read so far cut.
    let mut half: Option<u16> = None;
    loop {
        bytes.clear();
        let mut part = reader.by_ref().take(AT_ONCE as u64);
        if part.read_to_end(&mut bytes).map_err(unreadable())? == 0 {
            break;
        }
        let units = bytes.chunks_exact(2).map(|pair| {
            let pair = [pair[0], pair[1]];
            if is_high_first {
                u16::from_be_bytes(pair)
            } else {
                u16::from_le_bytes(pair)
            }
        });
        let mut units: Vec<u16> = half.take().into_iter().chain(units).collect();
        half = units.pop_if(|last| (0xd800..0xdc00).contains(last));
        let text = String::from_utf16_lossy(&units);
        writer
            .write_all(text.as_bytes())
            .map_err(unwritable(folder))?;
    }
    writer.flush().map_err(unwritable(folder))?;
    drop(writer);
    Ok(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_byte_orders_become_utf8_across_the_parts_that_are_read() {
        // A pair of units lies across the end of the first part.
        let text = format!("{}𝛂 [°]\n0,1\n", "x".repeat(AT_ONCE / 2 - 1));
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("text.csv");
        for (order, signature) in SIGNATURES.into_iter().enumerate() {
            let mut bytes = signature.to_vec();
            bytes.extend(text.encode_utf16().flat_map(|unit| {
                if order == 0 {
                    unit.to_le_bytes()
                } else {
                    unit.to_be_bytes()
                }
            }));
            std::fs::write(&source, bytes).unwrap();
            let decoded = as_utf8(&source, folder.path()).unwrap();
            assert_eq!(std::fs::read_to_string(decoded.path()).unwrap(), text);
        }
    }
}
