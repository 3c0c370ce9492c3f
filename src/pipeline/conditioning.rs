//! Ingest of one flight, conducted: its files surveyed, every channel through its flow into the
//! store's record file, the whole judged.
//!
//! The channels of a row group flow in parallel, in batches that the memory allows; flights are
//! taken up by a few workers of their own, so that no thread of the pool begins another flight
//! while it waits for one.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Flight, INGEST_VERSION, Ingested, Run, inputs, problem};
use crate::error::{Error, Problem, ProblemStage, Result};
use crate::ingest::{self, ChannelReader, Context, Refusal, Signature, Stretch};
use crate::store::archive::{self, FlightFiles, Opened};
use crate::store::atomic::Draft;
use crate::store::record_file::{self, About, GROUP, SignalWriter};
use crate::store::{Digest, Fingerprint, object};

/// What the store keeps of a flight besides its records: what concerns all of it, and its
/// stretches.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Kept {
    pub problems: Vec<Problem>,
    pub stretches: Vec<(String, Ingested)>,
}

/// A flight after ingest: its stretches, and where its artefact lies.
pub(crate) struct Conditioned {
    pub stretches: Vec<Flight>,
    pub problems: Vec<Problem>,
    /// None where nothing is kept of it: what was refused for now may be read the next time.
    pub artefact: Option<PathBuf>,
}

impl Conditioned {
    /// Why its stretches were refused.
    pub fn reasons(&self) -> String {
        let problems = self.stretches.iter().flat_map(|f| &f.ingested.problems);
        problems
            .map(|p| p.reason.as_str())
            .collect::<Vec<_>>()
            .join("; ")
    }
}

/// The pieces in which a channel is read where memory allows: they stay in the processor's cache.
const PIECE: usize = 1 << 16;

/// The shortest pieces, samples.
const LEAST_PIECE: usize = 1 << 14;

/// What a channel holds per sample of its piece, from the file's numbers to the settled ones,
/// bytes.
const PER_SAMPLE: f64 = 64.0;

/// What a thread holds of encoded groups, bytes: a batch is written while the next is encoded.
const ENCODED: f64 = 2.0 * BATCH as f64 * 9.0 * GROUP as f64;

/// What a channel holds between its pieces, bytes.
const PER_CHANNEL: f64 = 0.25e6;

/// What a flight of ten hours holds beside it: the clock and the means over short blocks, bytes.
const PER_FLIGHT: f64 = 40e6;

/// Channels per thread that are encoded before they are written in their order.
const BATCH: usize = 2;

/// How many flights are in work at once and in what pieces their channels are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shares {
    pub flights: usize,
    pub piece: usize,
    pub batch: usize,
}

impl Shares {
    /// Half of the memory is for what flights hold, half for what threads hold.
    pub fn of(memory_mb: f64, channels: usize, threads: usize) -> Shares {
        let half = 0.5e6 * memory_mb;
        let whole = |value: f64, least: usize, most: usize| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "clamped to a range of counts"
            )]
            let whole = value.clamp(least as f64, most.max(least) as f64) as usize;
            whole
        };
        let flights = whole(
            half / (PER_FLIGHT + PER_CHANNEL * channels as f64),
            1,
            threads,
        );
        let workers = whole(
            half / (ENCODED + PER_SAMPLE * LEAST_PIECE as f64),
            1,
            threads,
        );
        let piece = whole(
            (half / workers as f64 - ENCODED) / PER_SAMPLE,
            LEAST_PIECE,
            PIECE,
        );
        Shares {
            flights,
            piece,
            batch: BATCH * workers,
        }
    }
}

impl Run<'_> {
    /// Does `work` on every flight, a few at once; results in the order of the flights.
    pub(crate) fn each_flight<T: Sync, R: Send>(
        &self,
        flights: &[T],
        name: impl Fn(&T) -> &str + Sync,
        work: impl Fn(&T) -> Result<R> + Sync,
    ) -> Result<Vec<R>> {
        self.progress.begin("ingest", flights.len());
        let next = AtomicUsize::new(0);
        let results: Mutex<Vec<Option<Result<R>>>> =
            Mutex::new(flights.iter().map(|_| None).collect());
        let worker = || {
            while let Some((i, flight)) = {
                let i = next.fetch_add(1, Ordering::Relaxed);
                flights.get(i).map(|flight| (i, flight))
            } {
                let result = work(flight);
                self.progress.advance(name(flight));
                if let Ok(mut results) = results.lock() {
                    results[i] = Some(result);
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.shares.flights.min(flights.len()) {
                scope.spawn(worker);
            }
        });
        self.progress.end();
        let results = results.into_inner().unwrap_or_default();
        let lost = || Error::store(&self.config.store, &"a flight was not ingested; run again");
        results
            .into_iter()
            .map(|r| r.unwrap_or_else(|| Err(lost())))
            .collect()
    }

    fn ingest_context(&self) -> Context<'_> {
        let config = self.config;
        Context {
            channels: &config.channels,
            constants: &config.constants,
            aircraft: &config.aircraft,
            settings: &config.ingest,
        }
    }

    /// Ingests a flight, unless it is up to date.
    pub(crate) fn ingest_flight(&self, files: &FlightFiles) -> Result<Conditioned> {
        let id = &files.flight_id;
        let content = match self.inputs.content(id) {
            Ok(content) => content,
            Err(reason) => {
                return Ok(self.refused(
                    id,
                    problem(ProblemStage::Ingest, id, &inputs::place(files), reason),
                ));
            }
        };
        if let Some(done) = self.ingested(id, content) {
            return Ok(done);
        }
        let fingerprint = self.ingest_fingerprint(id, content);
        let kept = self.ingest_files(files, &fingerprint)?;
        // What the network is at fault of is not kept.
        if let Some((file, why)) = files
            .files
            .iter()
            .find_map(|file| Some((file, object::failed(file)?)))
        {
            return Ok(self.refused(
                id,
                problem(ProblemStage::Ingest, id, &file.display().to_string(), &why),
            ));
        }
        // What was read must be what the fingerprint is of.
        if let Some(changed) = files
            .files
            .iter()
            .find(|file| !self.contents.is_unchanged(file))
        {
            let reason = "changed or vanished while it was read: is it still being copied? The next run will read it";
            return Ok(self.refused(
                id,
                problem(
                    ProblemStage::Ingest,
                    id,
                    &changed.display().to_string(),
                    reason,
                ),
            ));
        }
        let artefact = self.store.path("ingest", id, &fingerprint, "json");
        self.store.save(&artefact, &kept)?;
        Ok(self.conditioned(kept, &fingerprint, artefact))
    }

    /// A flight as the store has it: none unless it is up to date and its records hold what was
    /// written.
    pub(crate) fn ingested(&self, id: &str, content: &str) -> Option<Conditioned> {
        let fingerprint = self.ingest_fingerprint(id, content);
        let artefact = self.store.path("ingest", id, &fingerprint, "json");
        let kept: Kept = self.store.load(&artefact)?;
        let is_whole = |(id, ingested): &(String, Ingested)| match &ingested.record {
            Some(digest) => self.has_record(&self.record_path(id, &fingerprint), digest),
            None => !ingested.accepted,
        };
        kept.stretches
            .iter()
            .all(is_whole)
            .then(|| self.conditioned(kept, &fingerprint, artefact))
    }

    /// Whether a record is in the store as it was written. One that lies in the object store alone
    /// is looked at when it is fetched.
    fn has_record(&self, path: &Path, digest: &Digest) -> bool {
        let is_here = self.contents.of(path).is_ok_and(|found| found == *digest);
        if is_here {
            self.store.is_here(path);
        }
        is_here || !path.exists() && self.store.is_shared(path, digest.bytes)
    }

    /// The records that an artefact of ingest tells of, relative to the store, with what they hold;
    /// none of another kind.
    pub(crate) fn recorded(&self, artefact: &str) -> Vec<(PathBuf, Digest)> {
        let path = self.store.folder().join(artefact);
        let fingerprint = path
            .file_stem()
            .and_then(|stem| stem.to_str()?.rsplit_once('-').map(|(_, f)| f.to_owned()));
        let kept = if artefact.starts_with("ingest/") {
            self.store.load::<Kept>(&path)
        } else {
            None
        };
        let (Some(fingerprint), Some(kept)) = (fingerprint, kept) else {
            return vec![];
        };
        let record = |(id, ingested): (String, Ingested)| {
            let path = self.record_path(&id, &fingerprint);
            Some((
                path.strip_prefix(self.store.folder()).ok()?.to_owned(),
                ingested.record?,
            ))
        };
        kept.stretches.into_iter().filter_map(record).collect()
    }

    /// What decides a flight's records.
    fn ingest_fingerprint(&self, id: &str, content: &str) -> String {
        let config = self.config;
        Fingerprint::of("ingest", INGEST_VERSION)
            .with(&id)
            .with(&content)
            .with(&config.channels)
            .with(&config.constants)
            .with(&config.aircraft)
            .with(&config.ingest)
            .finish()
    }

    fn conditioned(&self, kept: Kept, fingerprint: &str, artefact: PathBuf) -> Conditioned {
        let stretch = |(flight_id, ingested): (String, Ingested)| Flight {
            record: self.record_path(&flight_id, fingerprint),
            fingerprint: fingerprint.to_owned(),
            flight_id,
            ingested,
        };
        let stretches = kept.stretches.into_iter().map(stretch).collect();
        Conditioned {
            stretches,
            problems: kept.problems,
            artefact: Some(artefact),
        }
    }

    /// A flight without a record, for a reason that is not kept.
    fn refused(&self, id: &str, problem: Problem) -> Conditioned {
        let flight = Flight {
            flight_id: id.to_owned(),
            fingerprint: String::new(),
            record: self.record_path(id, "none"),
            ingested: Ingested::refused(problem),
        };
        Conditioned {
            stretches: vec![flight],
            problems: vec![],
            artefact: None,
        }
    }

    pub(crate) fn record_path(&self, id: &str, fingerprint: &str) -> PathBuf {
        self.store.path("records", id, fingerprint, "parquet")
    }

    fn ingest_files(&self, files: &FlightFiles, fingerprint: &str) -> Result<Kept> {
        let refused = |problem: Problem| Kept {
            problems: vec![],
            stretches: vec![(files.flight_id.clone(), Ingested::refused(problem))],
        };
        let basis = self.ingest_context();
        let opened = match archive::open(files, basis.channels) {
            Ok(opened) => opened,
            Err(problem) => return Ok(refused(problem)),
        };
        let flows = ingest::plan_channels(&opened, &basis);
        let surveyed =
            flows.and_then(|f| Ok((f, ingest::survey(&opened, basis.channels, basis.settings)?)));
        let ((plans, mut problems), survey) = match surveyed {
            Ok(surveyed) => surveyed,
            Err(problem) => return Ok(refused(problem)),
        };
        problems.extend(survey.problems);
        let mut stretches = Vec::new();
        for stretch in &survey.stretches {
            let ingested = self.ingest_stretch(&opened, &plans, stretch, fingerprint)?;
            stretches.push((stretch.flight_id.clone(), ingested));
        }
        Ok(Kept {
            problems,
            stretches,
        })
    }

    /// Writes the record of a stretch; where the stretch is refused none is left.
    fn ingest_stretch(
        &self,
        opened: &Opened,
        plans: &[ingest::ChannelPlan],
        stretch: &Stretch,
        fingerprint: &str,
    ) -> Result<Ingested> {
        let basis = self.ingest_context();
        let path = self.record_path(&stretch.flight_id, fingerprint);
        let mut draft = Draft::of(&path)?;
        let mut readers: Vec<ChannelReader> = plans
            .iter()
            .map(|p| ChannelReader::new(p, stretch, basis.settings))
            .collect();
        let read = self.write_record(opened, stretch, &mut readers, &mut draft);
        let finished = read.and_then(|()| {
            let written =
                record_file::open(draft.draft()).map_err(|e| Halt::Store(e.to_string()))?;
            let spoilt = Mutex::new(None);
            let window = |signals: &BTreeSet<String>, samples: Range<usize>| {
                let window = written
                    .window(Some(signals), samples)
                    .map_err(|e| e.to_string());
                window
                    .map_err(|reason| spoilt.lock().map(|mut spoilt| *spoilt = Some(reason)))
                    .ok()
            };
            let flowed = readers.into_iter().map(ChannelReader::finish).collect();
            let judged = ingest::assess(stretch, flowed, &basis, &window).map_err(Halt::Refused);
            spoilt
                .into_inner()
                .ok()
                .flatten()
                .map_or(judged, |reason| Err(Halt::Store(reason)))
        });
        match finished {
            Ok(judged) => {
                let record = Some(draft.digest());
                draft.place()?;
                self.store.keep(&path)?;
                Ok(Ingested {
                    accepted: true,
                    record,
                    channels: judged.channels,
                    checks: judged.checks,
                    instruments: judged.instruments,
                    corrections: judged.corrections,
                    problems: judged.problems,
                    signature: judged.signature,
                })
            }
            Err(Halt::Refused(problem)) => Ok(Ingested::refused(problem)),
            Err(Halt::Store(reason)) => Err(Error::store(&path, &reason)),
        }
    }

    fn write_record(
        &self,
        opened: &Opened,
        stretch: &Stretch,
        readers: &mut [ChannelReader],
        draft: &mut Draft,
    ) -> std::result::Result<(), Halt> {
        let clock = &stretch.clock;
        let recorded: Vec<String> = readers.iter().map(|r| r.signal().to_owned()).collect();
        let constants = self
            .config
            .constants
            .iter()
            .filter(|(name, _)| !recorded.contains(*name));
        let about = About {
            flight_id: stretch.flight_id.clone(),
            start_s: clock.start_s,
            step_s: clock.step_s,
            samples: clock.samples,
            constants: constants
                .map(|(name, value)| (name.clone(), *value))
                .collect(),
        };
        let mut writer = record_file::Writer::create(
            &about,
            recorded.iter().map(String::as_str),
            draft.writer(),
        )
        .map_err(Halt::Store)?;
        for from in (0..clock.samples).step_by(GROUP) {
            let until = (from + GROUP).min(clock.samples);
            let writers = writer.group().map_err(Halt::Store)?;
            let mut work: Vec<(&mut ChannelReader, SignalWriter)> =
                readers.iter_mut().zip(writers).collect();
            let mut spoilt = None;
            let appended = writer.append(|| {
                if work.is_empty() {
                    return Ok(None);
                }
                let batch: Vec<_> = work.drain(..self.shares.batch.min(work.len())).collect();
                let encode = |(reader, mut signal): (&mut ChannelReader, SignalWriter)| {
                    reader.read_until(opened, until, self.shares.piece, &mut |series| {
                        signal.push(series)
                    })?;
                    signal.close().map_err(|reason| Refusal {
                        place: reader.signal().to_owned(),
                        reason,
                    })
                };
                let encoded: std::result::Result<Vec<_>, _> =
                    batch.into_par_iter().map(encode).collect();
                encoded.map(Some).map_err(|refusal: Refusal| {
                    let reason = refusal.reason.clone();
                    spoilt = Some(refusal);
                    reason
                })
            });
            match (appended, spoilt) {
                (Ok(()), _) => {}
                (Err(_), Some(refusal)) => {
                    return Err(Halt::Refused(refusal.into_problem(&stretch.flight_id)));
                }
                (Err(reason), None) => return Err(Halt::Store(reason)),
            }
        }
        writer.finish().map_err(Halt::Store)
    }
}

/// Why a record is not written: the flight is refused, or the disk says no.
enum Halt {
    Refused(Problem),
    Store(String),
}

impl Ingested {
    pub(crate) fn refused(problem: Problem) -> Ingested {
        Ingested {
            accepted: false,
            record: None,
            channels: vec![],
            checks: vec![],
            instruments: vec![],
            corrections: vec![],
            problems: vec![problem],
            signature: Signature::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_memory_is_more_flights_and_longer_pieces_up_to_the_threads() {
        let little = Shares::of(10.0, 100, 8);
        assert_eq!(
            little,
            Shares {
                flights: 1,
                piece: LEAST_PIECE,
                batch: BATCH
            }
        );
        let usual = Shares::of(150.0, 41, 2);
        assert_eq!(
            usual,
            Shares {
                flights: 1,
                piece: PIECE,
                batch: 2 * BATCH
            }
        );
        assert_eq!(
            Shares::of(10_000.0, 41, 8),
            Shares {
                flights: 8,
                piece: PIECE,
                batch: 8 * BATCH
            }
        );
    }
}
