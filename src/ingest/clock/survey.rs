//! The survey of a flight: its files, their clocks, and the stretches that they make, from the time
//! channels alone.
//!
//! Files that hold the same channels are one stream: parts of a flight, copies, overlapping pieces.
//! Files that hold other channels are streams of their own, with clocks and rates of their own. The
//! stream with the most values per second is the main stream and gives the record its clock. The
//! channels of the other streams are interpolated to that clock.

use std::collections::{BTreeMap, BTreeSet};

use super::duplicates::are_same_rows;
use super::merge::{MergedPieces, PiecePart, PieceSequence, merge_pieces};
use super::pieces::{Piece, PieceScanner, ScannedFile, UnusableRows};
use super::sample_clock::{Clock, ClockBuilder};
use super::stream::Stream;
use super::time_channels::TimeChannels;
use crate::error::{Problem, ProblemStage};
use crate::flight::{Channel, signal::TIME};
use crate::ingest::column_source::ColumnSource;
use crate::ingest::refusal::Refusal;
use crate::ingest::settings::Settings;

/// Share of rows without a usable time above which a clock is refused: the remaining times would
/// leave gaps in most maneuvers.
const MOST_UNUSABLE: f64 = 0.1;

/// Rates of recorders of flight mechanics, Hz. A slower recorder does not resolve the short period;
/// a faster one probably has its time in another unit.
const RATES_HZ: std::ops::RangeInclusive<f64> = 2.0..=1000.0;

/// Usual rate of a recorder, Hz, by which the unit of a time is guessed.
const TYPICAL_RATE_HZ: f64 = 40.0;

/// A stretch of a flight on its clock.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// The flight's own id for its first stretch, then `<flight>.2`, `<flight>.3`…
    pub flight_id: String,
    pub clock: Clock,
    /// Clocks of the other streams.
    pub other_clocks: Vec<Clock>,
}

/// Stretches of a flight, with the faults of its clocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    pub stretches: Vec<Stretch>,
    /// Faults of the clocks and their consequences.
    pub problems: Vec<Problem>,
}

/// Checks that each file of a flight has a time channel.
///
/// # Errors
/// The problem that refuses the flight.
pub fn check_clocks(
    source: &(impl ColumnSource + ?Sized),
    channels: &BTreeMap<String, Channel>,
) -> Result<(), Problem> {
    let checked = TimeChannels::of(source, channels).check();
    checked.map_err(|refusal| refusal.into_problem(source.flight_id()))
}

/// Surveys a flight.
///
/// # Errors
/// A problem that refuses the flight: no time channel, or one that cannot be followed.
pub fn survey(
    source: &(impl ColumnSource + ?Sized),
    channels: &BTreeMap<String, Channel>,
    settings: &Settings,
) -> Result<Survey, Problem> {
    let surveyor = Surveyor {
        times: TimeChannels::of(source, channels),
        channels,
        settings,
        problems: Vec::new(),
    };
    surveyor
        .survey()
        .map_err(|refusal| refusal.into_problem(source.flight_id()))
}

/// Survey of a flight in the making.
struct Surveyor<'a, S: ColumnSource + ?Sized> {
    times: TimeChannels<'a, S>,
    channels: &'a BTreeMap<String, Channel>,
    settings: &'a Settings,
    problems: Vec<Problem>,
}

impl<S: ColumnSource + ?Sized> Surveyor<'_, S> {
    fn survey(mut self) -> Result<Survey, Refusal> {
        let mut streams = self.streams()?;
        for stream in &mut streams {
            stream.merged = self.merge(stream)?;
        }
        streams.sort_by(Stream::by_size);
        for stream in &streams {
            self.report_unusable_rows(stream)?;
            self.report_duplicates(stream);
        }
        let Some((main, others)) = streams.split_first() else {
            return Err(self.times.refusal("there are no files".to_owned()));
        };
        Ok(Survey {
            stretches: self.stretches(main, others)?,
            problems: self.problems,
        })
    }

    /// Scans each file and groups the files by their channels.
    fn streams(&self) -> Result<Vec<Stream>, Refusal> {
        let mut streams: Vec<Stream> = Vec::new();
        let files = 0..self.times.source.files();
        let columns: Vec<BTreeSet<String>> = files.map(|file| self.columns(file)).collect();
        let any_mapped = columns.iter().any(|columns| !columns.is_empty());
        for (file, columns) in columns.into_iter().enumerate() {
            // A file without a mapped column has a clock that no channel needs.
            if any_mapped && columns.is_empty() {
                continue;
            }
            let scanned = self.scan(file)?;
            match streams.iter_mut().find(|s| s.shares_half(&columns)) {
                Some(stream) => {
                    stream.columns.extend(columns);
                    stream.files.push(scanned);
                }
                None => streams.push(Stream {
                    columns,
                    files: vec![scanned],
                    merged: MergedPieces::default(),
                }),
            }
        }
        Ok(streams)
    }

    /// Mapped columns of a file, without its time.
    fn columns(&self, file: usize) -> BTreeSet<String> {
        let mapped = self.channels.iter().filter(|(_, c)| c.signal != TIME);
        mapped
            .map(|(name, _)| name.clone())
            .filter(|name| self.times.source.has(file, name))
            .collect()
    }

    fn scan(&self, file: usize) -> Result<ScannedFile, Refusal> {
        let mut scanner = PieceScanner::of_file(file);
        let rows = 0..self.times.source.rows(file);
        self.times
            .read(file, rows, &mut |times| scanner.push(times))?;
        Ok(scanner.finish())
    }

    fn merge(&self, stream: &Stream) -> Result<MergedPieces, Refusal> {
        let file_name = |file| self.times.source.name(file);
        let mut same_rows =
            |a: &Piece, b: &Piece| are_same_rows(&self.times, &stream.columns, a, b);
        merge_pieces(&stream.files, self.settings, &file_name, &mut same_rows)
            .map_err(|reason| self.times.refusal(reason))
    }

    fn report(&mut self, refusal: Refusal) {
        let flight_id = self.times.source.flight_id();
        self.problems.push(refusal.into_problem(flight_id));
    }

    /// Reports the rows of a stream that have no usable time.
    ///
    /// # Errors
    /// A refusal where they are too many.
    fn report_unusable_rows(&mut self, stream: &Stream) -> Result<(), Refusal> {
        let (unreadable, repeated) = (stream.unreadable(), stream.repeated());
        let unusable = unreadable.rows + repeated.rows;
        if unusable == 0 {
            return Ok(());
        }
        let rows = stream.rows();
        if unusable as f64 > MOST_UNUSABLE * rows as f64 {
            let first = if unreadable.rows > 0 {
                &unreadable
            } else {
                &repeated
            };
            return Err(self.times.refusal(format!(
                "of {rows} rows {} have a time that is not a number or fits nowhere and {} one \
                 that stands still, the first in {}: the clock cannot be followed",
                unreadable.rows,
                repeated.rows,
                self.first_row(first)
            )));
        }
        if unreadable.rows > 0 {
            self.report(self.times.refusal(format!(
                "{} rows have a time that is not a number or fits nowhere, the first is {}; they \
                 are left out",
                unreadable.rows,
                self.first_row(&unreadable)
            )));
        }
        if repeated.rows > 0 {
            self.report(self.times.refusal(format!(
                "time stands still in {} rows, the first is {}; they are left out",
                repeated.rows,
                self.first_row(&repeated)
            )));
        }
        Ok(())
    }

    /// Place of the first of some rows, in words.
    fn first_row(&self, rows: &UnusableRows) -> String {
        rows.first
            .map(|(file, row)| format!("row {row} of {}", self.times.source.name(file)))
            .unwrap_or_default()
    }

    /// Reports the pieces of a stream whose rows another piece holds already.
    fn report_duplicates(&mut self, stream: &Stream) {
        for piece in &stream.merged.duplicates {
            let Piece {
                file,
                row,
                rows,
                start_s,
                end_s,
            } = *piece;
            self.report(Refusal {
                place: self.times.source.name(file),
                reason: format!(
                    "rows from row {} on ({rows} rows, {start_s:.3} s to {end_s:.3} s) are there \
                     already, as far as the times overlap; they are used once",
                    row + 1
                ),
            });
        }
    }

    /// Stretches of the main stream with their clocks, and the clocks of the other streams.
    fn stretches(&mut self, main: &Stream, others: &[Stream]) -> Result<Vec<Stretch>, Refusal> {
        let mut other_clocks = Vec::new();
        for stream in others {
            let sequences = stream.merged.sequences.iter();
            let clocks: Result<Vec<Clock>, Refusal> = sequences.map(|s| self.clock(s)).collect();
            other_clocks.push(clocks?);
        }
        let sequences = &main.merged.sequences;
        let mut stretches = Vec::new();
        for (i, sequence) in sequences.iter().enumerate() {
            let flight_id = self.stretch_id(i);
            if sequences.len() > 1 && sequence.length_s() < self.settings.least_stretch_s {
                self.report_short_stretch(&flight_id, sequence);
                continue;
            }
            let clock = self.clock(sequence)?;
            self.check_rate(&clock)?;
            if sequences.len() == 1 && sequence.length_s() < self.settings.least_stretch_s {
                self.report_short_record(&flight_id, sequence);
            }
            if let Some(cause) = &sequence.cause {
                // Nothing is rejected: recordings may hold several runs whose time starts again.
                let refusal = Refusal {
                    place: format!("stretch `{flight_id}`"),
                    reason: format!("{cause}: what follows is a record of its own, `{flight_id}`"),
                };
                let flight_id = self.times.source.flight_id();
                self.problems
                    .push(refusal.of_stage(ProblemStage::Recording, flight_id));
            }
            let beside = other_clocks
                .iter()
                .flat_map(|clocks| clocks_beside(clocks, i, sequences.len()));
            stretches.push(Stretch {
                flight_id,
                other_clocks: beside.filter(|own| clock.is_near(own)).cloned().collect(),
                clock,
            });
        }
        if stretches.is_empty() {
            return Err(self.times.refusal(no_stretch(sequences.len())));
        }
        Ok(stretches)
    }

    fn stretch_id(&self, index: usize) -> String {
        let flight_id = self.times.source.flight_id();
        if index == 0 {
            flight_id.to_owned()
        } else {
            format!("{flight_id}.{}", index + 1)
        }
    }

    /// Checks the rate of the main stream, which no setting states, against those of recorders.
    ///
    /// # Errors
    /// A refusal that names the time, and its probable unit.
    fn check_rate(&self, clock: &Clock) -> Result<(), Refusal> {
        let rate_hz = 1.0 / clock.step_s;
        if self.settings.sampling_rate_hz.is_some() || RATES_HZ.contains(&rate_hz) {
            return Ok(());
        }
        let unit = self.times.probable_unit(rate_hz, TYPICAL_RATE_HZ);
        let unit = unit.map_or_else(
            || ".".to_owned(),
            |unit| format!(": is the time in {unit}?"),
        );
        Err(self.times.refusal(format!(
            "by its time the record runs at {rate_hz:.6} Hz; recorders run at {} to {} Hz{unit} The \
             unit stands in aircraft.yaml; `ingest: expert: sampling_rate_hz` states another rate",
            RATES_HZ.start(),
            RATES_HZ.end()
        )))
    }

    fn report_short_record(&mut self, flight_id: &str, sequence: &PieceSequence) {
        self.report(Refusal {
            place: format!("stretch `{flight_id}`"),
            reason: format!(
                "the record is {:.3} s long, shorter than least_stretch_s = {} s: no maneuver with its \
                 lead-in and decay fits into it",
                sequence.length_s(),
                self.settings.least_stretch_s
            ),
        });
    }

    fn report_short_stretch(&mut self, flight_id: &str, sequence: &PieceSequence) {
        self.report(Refusal {
            place: format!("stretch `{flight_id}`"),
            reason: format!(
                "the stretch from {:.3} s to {:.3} s is shorter than least_stretch_s = {} s; it \
                 is left out",
                sequence.start_s, sequence.end_s, self.settings.least_stretch_s
            ),
        });
    }

    /// Reads the times of a sequence of pieces again and assigns their rows to samples.
    fn clock(&self, sequence: &PieceSequence) -> Result<Clock, Refusal> {
        let mut builder = ClockBuilder::of(sequence);
        for parts in sequence.parts.chunk_by(PiecePart::is_before) {
            self.read_parts(parts, &mut builder)?;
        }
        builder
            .finish(self.settings)
            .map_err(|reason| self.times.refusal(reason))
    }

    /// Reads the times of parts that follow each other in a file, at once: a clock with repeated
    /// rows has a part for each.
    fn read_parts(&self, parts: &[PiecePart], builder: &mut ClockBuilder) -> Result<(), Refusal> {
        let (Some(first), Some(last)) = (parts.first(), parts.last()) else {
            return Ok(());
        };
        let mut pending = parts;
        let mut row = first.piece.row;
        let mut push = |times: &[f64]| {
            let batch = row..row + times.len();
            while let Some((part, later)) = pending.split_first() {
                let from = part.piece.row.max(batch.start);
                let to = part.piece.end_row().min(batch.end);
                if from < to {
                    let own = from - batch.start..to - batch.start;
                    builder.push(part, from, times.get(own).unwrap_or_default());
                }
                if part.piece.end_row() > batch.end {
                    break;
                }
                pending = later;
            }
            row = batch.end;
        };
        let rows = first.piece.row..last.piece.end_row();
        self.times.read(first.piece.file, rows, &mut push)
    }
}

/// Clocks of another stream that belong to a stretch of the main one. If a stream has as many
/// stretches as the main one, both were interrupted together.
fn clocks_beside(clocks: &[Clock], stretch: usize, stretches: usize) -> &[Clock] {
    match clocks.get(stretch) {
        Some(own) if clocks.len() == stretches => std::slice::from_ref(own),
        _ => clocks,
    }
}

/// Reason for which a flight has no stretch, by the number of its sequences of pieces.
fn no_stretch(sequences: usize) -> String {
    match sequences {
        0 => "0 rows are no record; at least 2 are needed".to_owned(),
        _ => format!(
            "time jumps {} times and leaves no stretch that is long enough",
            sequences - 1
        ),
    }
}
