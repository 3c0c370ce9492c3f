//! Reading of objects by ranges: those that the Parquet reader asks for, with a little read-ahead.

use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::{Buf, Bytes};
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, Length};

use super::address::at;
use super::client::Client;
use super::failure::{ObjectInfo, RequestFailure};

/// Longest read-ahead of a request, bytes: the latency of a request equals the transfer of some
/// hundred kilobytes.
const AHEAD: u64 = 1 << 20;

/// Reader of an object. Every clone reads the same content, or fails after the object was replaced.
#[derive(Clone, Debug)]
pub struct Reader {
    source: Arc<Source>,
    position: u64,
}

#[derive(Debug)]
struct Source {
    client: Arc<Client>,
    key: String,
    about: ObjectInfo,
    /// Ranges of the object that will be read; read-ahead stops at the end of a range.
    wanted: Vec<Range<u64>>,
    /// Offset in the object, and bytes, of the last request.
    held: Mutex<(u64, Bytes)>,
}

impl Reader {
    /// Opens an object; `None` if there is no such object.
    pub(super) fn of(path: &Path) -> Result<Option<Reader>, RequestFailure> {
        let (client, key) = at(path)?;
        let Some(about) = client.about(&key)? else {
            return Ok(None);
        };
        let wanted = std::iter::once(0..about.bytes).collect();
        let source = Source {
            client,
            key,
            about,
            wanted,
            held: Mutex::default(),
        };
        Ok(Some(Reader {
            source: Arc::new(source),
            position: 0,
        }))
    }

    /// Opens an object that must exist.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(path: &Path) -> Result<Reader, RequestFailure> {
        Reader::of(path)?.ok_or_else(|| {
            RequestFailure::Transient("there is no such object (any more)".to_owned())
        })
    }

    /// Size and tag of the object.
    #[must_use]
    pub fn about(&self) -> &ObjectInfo {
        &self.source.about
    }

    /// Reader of the same object that reads these ranges only.
    #[must_use]
    pub fn of_ranges(&self, wanted: Vec<Range<u64>>) -> Reader {
        let Source {
            client, key, about, ..
        } = &*self.source;
        let (client, key, about) = (client.clone(), key.clone(), about.clone());
        Reader {
            source: Arc::new(Source {
                client,
                key,
                about,
                wanted,
                held: Mutex::default(),
            }),
            position: 0,
        }
    }
}

impl Source {
    /// Reads at least `least` bytes from `start`; none beyond the end.
    fn bytes(&self, start: u64, least: u64) -> Result<Bytes, RequestFailure> {
        let end = start.saturating_add(least).min(self.about.bytes);
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        let (from, bytes) = &*held;
        let until = from + bytes.len() as u64;
        if !(*from <= start && end <= until) {
            let stretch = self.wanted.iter().find(|wanted| wanted.contains(&start));
            let ahead = stretch.map_or(end, |wanted| wanted.end.min(start.saturating_add(AHEAD)));
            *held = (
                start,
                self.client
                    .range(&self.key, start..ahead.max(end), self.about.tag.as_deref())?,
            );
        }
        let (from, bytes) = &*held;
        let skipped = usize::try_from(start - from)
            .unwrap_or(usize::MAX)
            .min(bytes.len());
        Ok(bytes.slice(skipped..))
    }
}

impl Read for Reader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.position >= self.source.about.bytes || out.is_empty() {
            return Ok(0);
        }
        let bytes = self
            .source
            .bytes(self.position, 1)
            .map_err(io::Error::other)?;
        let count = bytes.len().min(out.len());
        bytes.slice(..count).copy_to_slice(&mut out[..count]);
        self.position += count as u64;
        Ok(count)
    }
}

impl Length for Reader {
    fn len(&self) -> u64 {
        self.source.about.bytes
    }
}

impl ChunkReader for Reader {
    type T = Reader;

    fn get_read(&self, start: u64) -> Result<Reader, ParquetError> {
        Ok(Reader {
            source: self.source.clone(),
            position: start,
        })
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        let bytes = self
            .source
            .bytes(start, length as u64)
            .map_err(|e| ParquetError::External(Box::new(e)))?;
        if bytes.len() < length {
            return Err(ParquetError::EOF(format!(
                "{length} bytes from {start} on are beyond the object's end"
            )));
        }
        Ok(bytes.slice(..length))
    }
}
