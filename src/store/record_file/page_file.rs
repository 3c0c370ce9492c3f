//! File of which single pages are read.

use std::fs::File;

use bytes::Bytes;
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{ChunkReader, Length};

/// File whose pages are read at their positions, with one system call each. Through a duplicate of
/// the file's descriptor, as a [`File`] does, it would be five.
pub(super) struct PageFile {
    file: File,
    length: u64,
}

impl PageFile {
    pub fn new(file: File) -> PageFile {
        let length = file.len();
        PageFile { file, length }
    }

    /// Reads into memory that is not cleared before.
    #[cfg(unix)]
    fn read_at(&self, start: u64, length: usize) -> Result<Bytes> {
        use rustix::{buffer::spare_capacity, io};
        let mut bytes = Vec::with_capacity(length);
        while bytes.len() < length {
            let from = start + bytes.len() as u64;
            let read =
                io::retry_on_intr(|| io::pread(&self.file, spare_capacity(&mut bytes), from));
            if read.map_err(std::io::Error::from)? == 0 {
                return Err(beyond_end(start, length));
            }
        }
        bytes.truncate(length);
        Ok(bytes.into())
    }

    #[cfg(not(unix))]
    fn read_at(&self, start: u64, length: usize) -> Result<Bytes> {
        self.file.get_bytes(start, length)
    }
}

impl Length for PageFile {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for PageFile {
    type T = <File as ChunkReader>::T;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        self.file.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        // Checked before so much memory is taken: a damaged file may state any length.
        let end = start.checked_add(length as u64);
        if end.is_none_or(|end| end > self.length) {
            return Err(beyond_end(start, length));
        }
        self.read_at(start, length)
    }
}

fn beyond_end(start: u64, length: usize) -> ParquetError {
    ParquetError::EOF(format!(
        "{length} bytes from {start} on are beyond the file's end"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_at_their_position_and_none_beyond_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pages");
        std::fs::write(&path, b"0123456789").unwrap();
        let file = PageFile::new(File::open(&path).unwrap());
        assert_eq!(file.len(), 10);
        assert_eq!(&file.get_bytes(6, 4).unwrap()[..], b"6789");
        assert_eq!(&file.get_bytes(2, 3).unwrap()[..], b"234");
        for (start, length) in [(6, 5), (0, usize::MAX), (u64::MAX, 1)] {
            assert!(matches!(
                file.get_bytes(start, length),
                Err(ParquetError::EOF(_))
            ));
        }
        std::fs::write(&path, b"01234").unwrap();
        let cut = file.get_bytes(2, 8).unwrap_err();
        assert!(
            matches!(cut, ParquetError::EOF(_)),
            "cut after it was opened"
        );
        assert!(file.get_bytes(10, 0).unwrap().is_empty());
    }
}
