//! Reading of a record: signals and windows of time, with the corrections of the instruments.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::file::metadata::PageIndexPolicy;

use super::columns::Columns;
use super::header::RecordHeader;
use super::page_file::PageFile;
use crate::error::Error;
use crate::flight::record::{Series, with_margin};
use crate::flight::stand_in::GapExtent;
use crate::flight::{Completion, Correction, Record};
use crate::store::archive::guarded;
use crate::store::regular;

/// A record on the disk, read by signals and windows of time.
#[derive(Clone, Debug)]
pub struct RecordFile {
    path: PathBuf,
    pub(super) metadata: ArrowReaderMetadata,
    pub header: RecordHeader,
    /// Corrections applied as samples are read.
    corrections: Vec<Correction>,
    /// Stand-ins of signals.
    completion: Completion,
}

/// Opens a record.
///
/// # Errors
/// The file cannot be opened, is no Parquet file, or is not a record.
pub fn open(path: &Path) -> Result<RecordFile, Error> {
    let file = regular::open(path).map_err(Error::io(path, "cannot open the record"))?;
    let options = ArrowReaderOptions::new().with_offset_index_policy(PageIndexPolicy::Optional);
    let metadata = read_parquet(path, || ArrowReaderMetadata::load(&file, options))?;
    let header =
        RecordHeader::parse(metadata.schema().metadata()).map_err(|e| not_a_record(path, &e))?;
    Ok(RecordFile {
        path: path.to_owned(),
        metadata,
        header,
        corrections: vec![],
        completion: Completion::default(),
    })
}

/// Runs the Parquet reader, whose error or panic is a fault of the file.
fn read_parquet<T>(
    path: &Path,
    read: impl FnOnce() -> parquet::errors::Result<T>,
) -> Result<T, Error> {
    guarded(|| Ok(read()))
        .map_err(|_| not_a_record(path, &"the Parquet reader failed on its bytes"))?
        .map_err(|e| not_a_record(path, &e))
}

fn not_a_record(path: &Path, what: &dyn Display) -> Error {
    Error::damaged(
        path,
        &format!("not a record; remove it and run again: {what}"),
    )
}

impl RecordFile {
    /// Applies corrections to the record as it is read.
    #[must_use]
    pub fn corrected(self, corrections: Vec<Correction>) -> RecordFile {
        RecordFile {
            corrections,
            ..self
        }
    }

    /// Puts stand-ins in the place of signals, computed from the corrected others.
    #[must_use]
    pub fn completed(self, completion: Completion) -> RecordFile {
        RecordFile { completion, ..self }
    }

    /// Applies further corrections.
    #[must_use]
    pub fn corrected_further(mut self, further: impl Iterator<Item = Correction>) -> RecordFile {
        self.corrections.extend(further);
        self
    }

    /// Index of the sample nearest to a time, inside the record.
    #[must_use]
    pub fn sample_at(&self, time_s: f64) -> usize {
        self.header
            .record(&(0..self.header.samples))
            .sample_at(time_s)
    }

    /// Reads from one time to another with some samples more on each side, as [`Record::part`]
    /// does. A stand-in for a gap extends over the whole part.
    ///
    /// # Errors
    /// As [`RecordFile::window`].
    pub fn part(
        &self,
        signals: Option<&BTreeSet<String>>,
        start_s: f64,
        end_s: f64,
    ) -> Result<Record, Error> {
        let (first, last) = (self.sample_at(start_s), self.sample_at(end_s));
        let (samples, step_s) = (self.header.samples, self.header.step_s);
        let range = with_margin(first, last, samples, step_s);
        self.read(signals, range, GapExtent::WholePart)
    }

    /// Reads a range of samples of some signals, or of all. Signals that the record lacks are left
    /// out.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn window(
        &self,
        signals: Option<&BTreeSet<String>>,
        samples: Range<usize>,
    ) -> Result<Record, Error> {
        self.read(signals, samples, GapExtent::Samples)
    }

    fn read(
        &self,
        signals: Option<&BTreeSet<String>>,
        samples: Range<usize>,
        extent: GapExtent,
    ) -> Result<Record, Error> {
        let samples = samples.start.min(self.header.samples)..samples.end.min(self.header.samples);
        let reach = self
            .corrections
            .iter()
            .map(|c| c.reach(self.header.step_s))
            .max()
            .unwrap_or(0);
        let wide =
            samples.start.saturating_sub(reach)..(samples.end + reach).min(self.header.samples);
        let sources = signals.map(|signals| self.with_sources(signals));
        let mut record = self.as_written(sources.as_ref(), wide.clone())?;
        self.corrections
            .iter()
            .for_each(|correction| correction.apply(&mut record));
        self.completion.apply(&mut record, extent);
        if let Some(signals) = signals {
            record.signals.retain(|name, _| signals.contains(name));
        }
        if wide == samples {
            return Ok(record);
        }
        let inside = samples.start - wide.start..samples.end - wide.start;
        Ok(Record {
            start_s: self.header.record(&samples).start_s,
            ..record.cut(None, inside)
        })
    }

    /// Some signals, and those from which the stand-ins of the record are computed.
    fn with_sources(&self, signals: &BTreeSet<String>) -> BTreeSet<String> {
        let sources = self.completion.sources().map(str::to_owned);
        signals.iter().cloned().chain(sources).collect()
    }

    /// Samples as they were written, before corrections and stand-ins.
    fn as_written(
        &self,
        signals: Option<&BTreeSet<String>>,
        samples: Range<usize>,
    ) -> Result<Record, Error> {
        let mut record = self.header.record(&samples);
        let wanted = |name: &str| signals.is_none_or(|s| s.contains(name));
        let constants = self.header.constants.iter();
        for (name, value) in constants.filter(|(name, _)| wanted(name)) {
            let constant = Series::assumed(vec![*value; samples.len()]);
            record.signals.insert(name.clone(), constant);
        }
        self.add_columns(&mut record, samples, &wanted)?;
        Ok(record)
    }

    /// Adds the wanted signals' columns to a record of a range of samples.
    fn add_columns(
        &self,
        record: &mut Record,
        samples: Range<usize>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<(), Error> {
        let file =
            File::open(&self.path).map_err(Error::io(&self.path, "cannot open the record"))?;
        let columns = Columns::new(PageFile::new(file), self.metadata.metadata());
        let count = samples.len();
        read_parquet(&self.path, || columns.add_to(record, &samples, wanted))?;
        let whole = |s: &Series| s.values.len() == count && s.marks.len() == count;
        record
            .signals
            .iter()
            .find(|(_, s)| !whole(s))
            .map_or(Ok(()), |(name, _)| {
                let samples = self.header.samples;
                let what = format!("signal `{name}` has not {samples} samples");
                Err(not_a_record(&self.path, &what))
            })
    }
}
