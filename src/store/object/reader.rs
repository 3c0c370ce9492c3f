//! An object read by ranges: what Parquet's reader asks for, and a little ahead of it, never the
//! whole.

use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::{Buf, Bytes};
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, Length};

use super::client::Client;
use super::{About, Failure, at};

/// The most that is asked for at once beyond what is needed, bytes: a request costs as much as some
/// hundred kilobytes.
const AHEAD: u64 = 1 << 20;

/// An object that is being read; every copy reads the same content, or fails when it has been
/// replaced.
#[derive(Clone, Debug)]
pub struct Reader {
    source: Arc<Source>,
    position: u64,
}

#[derive(Debug)]
struct Source {
    client: Arc<Client>,
    key: String,
    about: About,
    /// The stretches of the object that will be read: nothing is asked for ahead beyond the end of
    /// one.
    wanted: Vec<Range<u64>>,
    /// What was asked for last, with its beginning.
    held: Mutex<(u64, Bytes)>,
}

impl Reader {
    /// Begins to read an object; none where there is none.
    pub(super) fn of(path: &Path) -> Result<Option<Reader>, Failure> {
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

    /// Begins to read an object that must be there.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub fn open(path: &Path) -> Result<Reader, Failure> {
        Reader::of(path)?
            .ok_or_else(|| Failure::Passing("there is no such object (any more)".to_owned()))
    }

    /// What is known of the object that is being read.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.source.about
    }

    /// The same object, of which only these stretches are read.
    #[must_use]
    pub fn of_stretches(&self, wanted: Vec<Range<u64>>) -> Reader {
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
    /// At least `least` bytes from `start` (none beyond the end).
    fn bytes(&self, start: u64, least: u64) -> Result<Bytes, Failure> {
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
