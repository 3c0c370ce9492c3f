//! Sorting of values by time on the disk. Each value is written to its span of time, and a span is
//! small enough to be sorted in memory. The time taken is proportional to the number of values, for
//! any order.

use std::fs::File;
use std::io::{Read, Result, Seek, SeekFrom, Write};
use std::path::Path;

/// Value of a name at a time: time, index of the name, value.
pub type Placed = (f64, usize, f64);

/// Bytes of a value in the file.
const BYTES: usize = 24;

/// Bytes of a span that are written at once.
const BUFFER: usize = 1 << 16;

/// Spans of time in one temporary file that has no name. Each has room for the number of values
/// that was counted for it.
#[derive(Debug)]
pub struct SpanFile {
    file: File,
    spans: Vec<Span>,
}

/// Values of one span.
#[derive(Debug, Default)]
struct Span {
    /// Its place in the file.
    start: u64,
    written: u64,
    /// Values not written yet.
    waiting: Vec<u8>,
}

impl SpanFile {
    /// Creates the file in a folder, for spans of at most these numbers of values.
    ///
    /// # Errors
    /// The folder has no room for it.
    pub fn of(folder: &Path, counts: &[usize]) -> Result<SpanFile> {
        let mut start = 0;
        let span = |count: &usize| {
            let own = start;
            start += (count * BYTES) as u64;
            Span {
                start: own,
                ..Span::default()
            }
        };
        Ok(SpanFile {
            spans: counts.iter().map(span).collect(),
            file: tempfile::tempfile_in(folder)?,
        })
    }

    /// Adds a value to a span.
    ///
    /// # Errors
    /// The disk fails.
    pub fn push(&mut self, span: usize, (time, place, value): Placed) -> Result<()> {
        let span = &mut self.spans[span];
        span.waiting.extend(time.to_le_bytes());
        span.waiting.extend((place as u64).to_le_bytes());
        span.waiting.extend(value.to_le_bytes());
        if span.waiting.len() >= BUFFER {
            span.write(&mut self.file)?;
        }
        Ok(())
    }

    /// Values of a span in the order of time; values of one time stay in the order in which they
    /// were added.
    ///
    /// # Errors
    /// The disk fails.
    pub fn sorted(&mut self, span: usize) -> Result<Vec<Placed>> {
        let span = &mut self.spans[span];
        span.write(&mut self.file)?;
        self.file.seek(SeekFrom::Start(span.start))?;
        let mut bytes = Vec::new();
        (&mut self.file)
            .take(span.written)
            .read_to_end(&mut bytes)?;
        let word = |bytes: &[u8]| u64::from_le_bytes(bytes.try_into().unwrap_or_default());
        let value = |bytes: &[u8]| {
            let [time, place, value] = [0, 8, 16].map(|at| word(&bytes[at..at + 8]));
            #[expect(
                clippy::cast_possible_truncation,
                reason = "a place that was one before"
            )]
            let place = place as usize;
            (f64::from_bits(time), place, f64::from_bits(value))
        };
        let mut values: Vec<Placed> = bytes.chunks_exact(BYTES).map(value).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(values)
    }
}

impl Span {
    /// Writes the values not written yet.
    fn write(&mut self, file: &mut File) -> Result<()> {
        file.seek(SeekFrom::Start(self.start + self.written))?;
        file.write_all(&self.waiting)?;
        self.written += self.waiting.len() as u64;
        self.waiting.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_each_span_come_in_the_order_of_time_and_of_their_coming() {
        let folder = tempfile::tempdir().unwrap();
        let count = 20_000;
        let mut file = SpanFile::of(folder.path(), &[count, 0, count]).unwrap();
        for k in 0..count {
            let time = ((k * 7919) % count / 2) as f64;
            file.push(0, (time, k, -1.5)).unwrap();
            file.push(2, (-time, usize::MAX, k as f64)).unwrap();
        }
        let first = file.sorted(0).unwrap();
        assert_eq!(first.len(), count);
        assert!(
            first
                .windows(2)
                .all(|pair| (pair[0].0, pair[0].1) < (pair[1].0, pair[1].1))
        );
        assert!(file.sorted(1).unwrap().is_empty());
        let last = file.sorted(2).unwrap();
        assert!(last.iter().all(|(_, place, _)| *place == usize::MAX) && last.len() == count);
        assert!(last.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }
}
