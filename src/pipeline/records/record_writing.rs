//! Writing of a flight's records: the files are surveyed, every channel is conditioned and written
//! into the record's file, and the record is checked.
//!
//! The channels of a row group are processed in parallel, in batches that the memory allows.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use super::ingested::{IngestedFlight, IngestedStretch, StoredRecord};
use super::memory_shares::MemoryShares;
use crate::config::Config;
use crate::error::{Error, Problem, Result};
use crate::flight::Record;
use crate::ingest::{
    self, Assessment, ChannelPlan, ChannelReader, ComputedColumns, Context, Refusal, Stretch,
};
use crate::store::archive::{self, FlightFiles, Opened};
use crate::store::atomic::Draft;
use crate::store::record_file::{self, GROUP, RecordFile, RecordHeader, SignalChunk, SignalWriter};
use crate::store::{ArtefactName, Kind, Store};

/// Columns of a flight's files, and those that formulas add.
type Columns<'a> = ComputedColumns<'a, Opened>;

/// Reason that a record is not written.
enum WriteStop {
    /// A fault of the flight; it is rejected.
    Rejected(Problem),
    /// A fault of the disk; it stops the run.
    Disk(String),
}

/// Writer of a flight's records.
pub struct RecordWriting<'a> {
    pub config: &'a Config,
    pub store: &'a Store,
    pub shares: MemoryShares,
    /// Fingerprint of the flight's ingest, for the records' names.
    pub fingerprint: &'a str,
}

impl RecordWriting<'_> {
    /// Ingests the files of a flight: writes a record for each stretch that is accepted.
    ///
    /// # Errors
    /// [`Error::Store`] naming the record that cannot be written.
    pub fn ingest(&self, files: &FlightFiles) -> Result<IngestedFlight> {
        let rejected = |problem| Ok(IngestedFlight::rejected(&files.flight_id, problem));
        let basis = self.basis();
        let records = ArtefactName::new(Kind::Records, &files.flight_id, self.fingerprint);
        let scratch = self.store.path(&records);
        let opened = match archive::open(files, basis.channels, &scratch)? {
            Ok(opened) => opened,
            Err(problem) => return rejected(problem),
        };
        let opened = ComputedColumns::of(&opened, basis.channels);
        let (plans, mut problems) = match ingest::plan_channels(&opened, &basis) {
            Ok(plans) => plans,
            Err(problem) => return rejected(problem),
        };
        let survey = match ingest::survey(&opened, basis.channels, basis.settings) {
            Ok(survey) => survey,
            Err(problem) => return rejected(problem),
        };
        problems.extend(survey.problems);
        let stretches: Result<Vec<IngestedStretch>> = survey
            .stretches
            .iter()
            .map(|stretch| self.ingest_stretch(&opened, &plans, stretch))
            .collect();
        Ok(IngestedFlight {
            problems,
            stretches: stretches?,
        })
    }

    fn basis(&self) -> Context<'_> {
        let config = self.config;
        Context {
            channels: &config.channels,
            constants: &config.constants,
            aircraft: &config.aircraft,
            settings: &config.ingest,
        }
    }

    /// Writes and checks the record of a stretch. A rejected stretch leaves no file.
    fn ingest_stretch(
        &self,
        opened: &Columns,
        plans: &[ChannelPlan],
        stretch: &Stretch,
    ) -> Result<IngestedStretch> {
        let id = &stretch.flight_id;
        let name = ArtefactName::new(Kind::Records, id, self.fingerprint);
        let path = self.store.path(&name);
        let mut draft = Draft::create(&path)?;
        let mut readers: Vec<ChannelReader> = plans
            .iter()
            .map(|p| ChannelReader::new(p, stretch, &self.config.ingest))
            .collect();
        let written = self.write(opened, stretch, &mut readers, &mut draft);
        let checked = match written {
            Ok(()) => draft.sync_during(|| self.check(stretch, readers, &draft))?,
            Err(stop) => Err(stop),
        };
        let assessment = match checked {
            Ok(assessment) => assessment,
            Err(WriteStop::Rejected(problem)) => return Ok(IngestedStretch::rejected(id, problem)),
            Err(WriteStop::Disk(reason)) => return Err(Error::store(&path, &reason)),
        };
        let digest = draft.digest();
        draft.place()?;
        self.store.note_made(&name)?;
        Ok(IngestedStretch {
            flight_id: id.clone(),
            record: Some(StoredRecord { name, digest }),
            assessment,
        })
    }

    /// Checks a written record, which is read back by windows.
    fn check(
        &self,
        stretch: &Stretch,
        readers: Vec<ChannelReader>,
        draft: &Draft,
    ) -> Result<Assessment, WriteStop> {
        let written =
            record_file::open(draft.draft()).map_err(|e| WriteStop::Disk(e.to_string()))?;
        let reader = WindowReader::new(written);
        let flowed = readers.into_iter().map(ChannelReader::finish).collect();
        let judged = ingest::assess(stretch, flowed, &self.basis(), &|signals, samples| {
            reader.window(signals, samples)
        });
        match reader.into_failure() {
            Some(reason) => Err(WriteStop::Disk(reason)),
            None => judged.map_err(WriteStop::Rejected),
        }
    }

    /// Writes all channels of a stretch, row group by row group.
    fn write(
        &self,
        opened: &Columns,
        stretch: &Stretch,
        readers: &mut [ChannelReader],
        draft: &mut Draft,
    ) -> Result<(), WriteStop> {
        let samples = stretch.clock.samples;
        let signals: Vec<String> = readers.iter().map(|r| r.signal().to_owned()).collect();
        let mut writer = record_file::Writer::create(
            &self.header(stretch, &signals),
            signals.iter().map(String::as_str),
            draft.writer(),
        )
        .map_err(WriteStop::Disk)?;
        for start in (0..samples).step_by(GROUP) {
            let writers = writer.group().map_err(WriteStop::Disk)?;
            let mut group = GroupEncoding {
                opened,
                shares: self.shares,
                end: (start + GROUP).min(samples),
                pending: readers.iter_mut().zip(writers).collect(),
                fault: None,
            };
            let appended = writer.append(|| group.next_batch());
            match (appended, group.fault) {
                (Ok(()), _) => {}
                (Err(reason), None) => return Err(WriteStop::Disk(reason)),
                (Err(_), Some(refusal)) => {
                    return Err(WriteStop::Rejected(
                        refusal.into_problem(&stretch.flight_id),
                    ));
                }
            }
        }
        writer.finish().map_err(WriteStop::Disk)
    }

    /// Clock and constants of a record with these recorded signals.
    fn header(&self, stretch: &Stretch, signals: &[String]) -> RecordHeader {
        let clock = &stretch.clock;
        let constants = self.config.constants.iter();
        RecordHeader {
            flight_id: stretch.flight_id.clone(),
            start_s: clock.start_s,
            step_s: clock.step_s,
            samples: clock.samples,
            constants: constants
                .filter(|(name, _)| !signals.contains(*name))
                .map(|(name, value)| (name.clone(), *value))
                .collect(),
        }
    }
}

/// Encoding of one row group, batch by batch.
struct GroupEncoding<'f, 'a> {
    opened: &'f Columns<'f>,
    shares: MemoryShares,
    /// End of the row group, samples.
    end: usize,
    /// Channels that are not encoded yet.
    pending: Vec<(&'f mut ChannelReader<'a>, SignalWriter)>,
    /// Channel that cannot be read, and the reason.
    fault: Option<Refusal>,
}

impl GroupEncoding<'_, '_> {
    /// Encodes the next channels; `None` after the last.
    fn next_batch(&mut self) -> Result<Option<Vec<SignalChunk>>, String> {
        if self.pending.is_empty() {
            return Ok(None);
        }
        let count = self.shares.batch.min(self.pending.len());
        let batch: Vec<_> = self.pending.drain(..count).collect();
        let (opened, end, piece) = (self.opened, self.end, self.shares.piece);
        let encoded: Result<Vec<SignalChunk>, Refusal> = batch
            .into_par_iter()
            .map(|(reader, signal)| encode(reader, signal, opened, end, piece))
            .collect();
        encoded.map(Some).map_err(|fault| {
            let reason = fault.reason.clone();
            self.fault = Some(fault);
            reason
        })
    }
}

/// Encodes a channel as far as `end`. An error names the channel.
fn encode(
    reader: &mut ChannelReader,
    mut signal: SignalWriter,
    opened: &Columns,
    end: usize,
    piece: usize,
) -> Result<SignalChunk, Refusal> {
    reader.read_until(opened, end, piece, &mut |values, marks| {
        signal.push(values, marks)
    })?;
    signal.close().map_err(|reason| Refusal {
        place: reader.signal().to_owned(),
        reason,
    })
}

/// Reader of a record's windows that keeps the first failure of the disk.
struct WindowReader {
    record: RecordFile,
    failure: Mutex<Option<String>>,
}

impl WindowReader {
    fn new(record: RecordFile) -> WindowReader {
        WindowReader {
            record,
            failure: Mutex::default(),
        }
    }

    fn window(&self, signals: &BTreeSet<String>, samples: Range<usize>) -> Option<Record> {
        match self.record.window(Some(signals), samples) {
            Ok(window) => Some(window),
            Err(error) => {
                if let Ok(mut failure) = self.failure.lock() {
                    failure.get_or_insert(error.to_string());
                }
                None
            }
        }
    }

    fn into_failure(self) -> Option<String> {
        self.failure.into_inner().ok().flatten()
    }
}
