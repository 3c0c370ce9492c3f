//! The survey of a flight: its files, their clocks, and the stretches that they make, from the time
//! channels alone.
//!
//! Files that hold the same channels are one stream: parts of a flight, copies, overlapping pieces.
//! Files that hold other channels are streams of their own, with clocks and rates of their own. The
//! stream with the most channels gives the record its clock; the channels of the others are brought
//! to it.

use std::collections::{BTreeMap, BTreeSet};

use super::clock::{Clock, Slots};
use super::pieces::{Piece, Scan, Scanned, Unusable};
use super::source::Source;
use super::stretches::{self, Plan, Stretch};
use super::{Settings, Spoilt, TIME, problem};
use crate::error::Problem;
use crate::flight::Channel;
use crate::units::Unit;

/// A stretch of a flight on its clock.
#[derive(Clone, Debug, PartialEq)]
pub struct Surveyed {
    /// The flight's own id for its first stretch, then `<flight>.2`, `<flight>.3`…
    pub flight_id: String,
    pub clock: Clock,
    /// The clocks of the other streams, each with the files that it is of.
    pub others: Vec<Clock>,
}

/// What the time channels say of a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    pub stretches: Vec<Surveyed>,
    /// What is wrong with the clocks, and what was done about it.
    pub problems: Vec<Problem>,
}

/// More rows than this share without a usable time, and the clock is not to be trusted.
const MOST_UNUSABLE: f64 = 0.1;

/// Rows that are compared to see whether two pieces hold the same.
const COMPARED: usize = 256;

/// This share of the recorded values of two rows must be the same for the rows to be.
const SAME: f64 = 0.9;

/// Surveys a flight.
///
/// # Errors
/// A problem that refuses the flight: no time channel, or one that cannot be followed.
pub fn survey(
    source: &(impl Source + ?Sized),
    channels: &BTreeMap<String, Channel>,
    settings: &Settings,
) -> Result<Survey, Problem> {
    let refused = |(place, reason): Spoilt| problem(source.flight_id(), place, reason);
    let surveyor = Surveyor {
        source,
        channels,
        settings,
    };
    surveyor.survey().map_err(refused)
}

struct Surveyor<'a, S: Source + ?Sized> {
    source: &'a S,
    channels: &'a BTreeMap<String, Channel>,
    settings: &'a Settings,
}

/// Files of the same channels.
struct Stream {
    columns: BTreeSet<String>,
    files: Vec<Scanned>,
    plan: Plan,
}

impl<S: Source + ?Sized> Surveyor<'_, S> {
    fn survey(&self) -> Result<Survey, Spoilt> {
        let mut streams = self.streams()?;
        for stream in &mut streams {
            let name = |file| self.source.name(file);
            let columns = &stream.columns;
            let mut same = |a: &Piece, b: &Piece| self.same(columns, a, b);
            let plan = stretches::plan(&stream.files, self.settings, &name, &mut same);
            stream.plan = plan.map_err(|reason| self.at_time(reason))?;
        }
        // The most channels, then the highest rate.
        let step = |s: &Stream| s.files.first().map_or(f64::INFINITY, |f| f.step_s);
        streams.sort_by(|a, b| {
            b.columns
                .len()
                .cmp(&a.columns.len())
                .then(step(a).total_cmp(&step(b)))
        });
        let mut survey = Survey::default();
        for stream in &streams {
            self.tell(stream, &mut survey.problems)?;
        }
        let Some((main, others)) = streams.split_first() else {
            return Err(self.at_time("there are no files".to_owned()));
        };
        self.clocks(main, others, &mut survey)?;
        Ok(survey)
    }

    fn at_time(&self, reason: String) -> Spoilt {
        let name = self
            .channels
            .iter()
            .find(|(_, c)| c.signal == TIME)
            .map_or("", |(name, _)| name.as_str());
        (format!("channel `{name}`"), reason)
    }

    /// The time channel of a file with the factor that makes seconds of it.
    fn time(&self, file: usize) -> Result<(&str, f64), Spoilt> {
        let mut clocks = self
            .channels
            .iter()
            .filter(|(_, c)| c.signal == TIME)
            .peekable();
        if clocks.peek().is_none() {
            let reason = format!("no channel is mapped to `{TIME}`; the record has no clock");
            return Err(("channel map".to_owned(), reason));
        }
        let Some((name, channel)) = clocks.find(|(name, _)| self.source.has(file, name)) else {
            let names: Vec<String> = self
                .channels
                .iter()
                .filter(|(_, c)| c.signal == TIME)
                .map(|(name, _)| format!("`{name}`"))
                .collect();
            return Err(self.at_time(format!(
                "the time channel {} is not in the file",
                names.join(", ")
            )));
        };
        let factor = Unit::parse(&channel.unit)
            .ok()
            .and_then(|u| u.factor_to(Unit::of_signal(TIME)));
        let factor = factor
            .ok_or_else(|| self.at_time(format!("`{}` is not a unit of time", channel.unit)))?;
        Ok((name, factor * channel.sign * channel.scale))
    }

    /// Hands over the times of some rows of a file, s.
    fn times(
        &self,
        file: usize,
        rows: std::ops::Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), Spoilt> {
        let (name, factor) = self.time(file)?;
        let mut times = Vec::new();
        let mut scaled = |values: &[f64]| {
            times.clear();
            times.extend(values.iter().map(|t| t * factor));
            sink(&times);
        };
        self.source
            .read(file, name, rows, &mut scaled)
            .map_err(|reason| (self.source.name(file), reason))
    }

    /// The files by what they hold; each is scanned.
    fn streams(&self) -> Result<Vec<Stream>, Spoilt> {
        let mut streams: Vec<Stream> = Vec::new();
        for file in 0..self.source.files() {
            let mapped = self.channels.iter().filter(|(_, c)| c.signal != TIME);
            let columns: BTreeSet<String> = mapped
                .map(|(name, _)| name.clone())
                .filter(|name| self.source.has(file, name))
                .collect();
            let mut scan = Scan::of_file(file);
            self.times(file, 0..self.source.rows(file), &mut |times| {
                scan.push(times)
            })?;
            let pieces = scan.finish();
            let half = |stream: &&mut Stream| {
                let common = stream.columns.intersection(&columns).count();
                2 * common >= stream.columns.len().min(columns.len())
            };
            match streams.iter_mut().find(half) {
                Some(stream) => {
                    stream.columns.extend(columns);
                    stream.files.push(pieces);
                }
                None => streams.push(Stream {
                    columns,
                    files: vec![pieces],
                    plan: Plan::default(),
                }),
            }
        }
        Ok(streams)
    }

    /// Whether the rows of the second piece that have times of the first are its rows again.
    fn same(
        &self,
        columns: &BTreeSet<String>,
        first: &Piece,
        second: &Piece,
    ) -> Result<bool, String> {
        let common = |name: &&String| {
            self.source.has(first.file, name) && self.source.has(second.file, name)
        };
        let from_s = first.start_s.max(second.start_s);
        let (a, b) = (
            self.rows_from(first, from_s)?,
            self.rows_from(second, from_s)?,
        );
        let (mut same, mut all) = (0_usize, 0_usize);
        let pairs = meeting(&a, &b);
        for name in columns.iter().filter(common) {
            let [x, y] = [(first, &a), (second, &b)].map(|(piece, rows)| {
                let mut values = Vec::new();
                let range = rows.row..rows.row + rows.times.len();
                self.source
                    .read(piece.file, name, range, &mut |v| {
                        values.extend_from_slice(v)
                    })
                    .map(|()| values)
            });
            let (x, y) = (x?, y?);
            let still = x.windows(2).all(|p| p[0].to_bits() == p[1].to_bits());
            for (i, j) in &pairs {
                if let (Some(x), Some(y)) = (x.get(*i), y.get(*j))
                    && !still
                {
                    all += 1;
                    same += usize::from(x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan()));
                }
            }
        }
        Ok(all > 0 && same as f64 >= SAME * all as f64)
    }

    /// The first rows of a piece at or after a time.
    fn rows_from(&self, piece: &Piece, from_s: f64) -> Result<Rows, String> {
        let (mut found, mut row) = (
            Rows {
                row: piece.row,
                times: Vec::new(),
            },
            piece.row,
        );
        let mut take = |times: &[f64]| {
            for time in times {
                if *time >= from_s && found.times.len() < COMPARED {
                    if found.times.is_empty() {
                        found.row = row;
                    }
                    found.times.push(*time);
                }
                row += 1;
            }
        };
        self.times(piece.file, piece.row..piece.row + piece.rows, &mut take)
            .map_err(|(_, reason)| reason)?;
        Ok(found)
    }

    /// What is wrong with a stream's clock.
    fn tell(&self, stream: &Stream, problems: &mut Vec<Problem>) -> Result<(), Spoilt> {
        let id = self.source.flight_id();
        let rows: usize = stream.files.iter().map(|f| f.rows).sum();
        let mut unreadable = Unusable::default();
        let mut still = Unusable::default();
        for file in &stream.files {
            for (sum, own) in [
                (&mut unreadable, &file.unreadable),
                (&mut still, &file.still),
            ] {
                sum.rows += own.rows;
                sum.first = sum.first.or(own.first);
            }
        }
        stream
            .plan
            .stray
            .iter()
            .for_each(|p| (0..p.rows).for_each(|i| unreadable.add(p.file, p.row + i)));
        let first = |u: &Unusable| {
            u.first
                .map(|(file, row)| format!("row {row} of {}", self.source.name(file)))
                .unwrap_or_default()
        };
        if unreadable.rows + still.rows > 0
            && (unreadable.rows + still.rows) as f64 > MOST_UNUSABLE * rows as f64
        {
            let (no, stands) = (unreadable.rows, still.rows);
            return Err(self.at_time(format!(
                "of {rows} rows {no} have a time that is not a number or fits nowhere and {stands} one that stands \
                 still, the first in {}: the clock cannot be followed",
                first(if no > 0 { &unreadable } else { &still })
            )));
        }
        let mut tell = |(place, reason): Spoilt| problems.push(problem(id, place, reason));
        if unreadable.rows > 0 {
            let (n, first) = (unreadable.rows, first(&unreadable));
            tell(self.at_time(format!(
                "{n} rows have a time that is not a number or fits nowhere, the first is {first}; they are left out"
            )));
        }
        if still.rows > 0 {
            let (n, first) = (still.rows, first(&still));
            tell(self.at_time(format!(
                "time stands still in {n} rows, the first is {first}; they are left out"
            )));
        }
        for piece in &stream.plan.again {
            let Piece {
                row,
                rows,
                start_s,
                end_s,
                file,
            } = *piece;
            tell((
                self.source.name(file),
                format!(
                    "rows from row {} on ({rows} rows, {start_s:.3} s to {end_s:.3} s) are there already, as far as \
                     the times overlap; they are used once",
                    row + 1
                ),
            ));
        }
        Ok(())
    }

    /// The clocks of the main stream's stretches, with those of the other streams beside them.
    fn clocks(&self, main: &Stream, others: &[Stream], survey: &mut Survey) -> Result<(), Spoilt> {
        let id = self.source.flight_id();
        let others: Vec<Vec<Clock>> = others
            .iter()
            .map(|stream| {
                stream
                    .plan
                    .stretches
                    .iter()
                    .map(|s| self.clock(s))
                    .collect::<Result<_, _>>()
            })
            .collect::<Result<_, Spoilt>>()?;
        let count = main.plan.stretches.len();
        for (i, stretch) in main.plan.stretches.iter().enumerate() {
            let own = if i == 0 {
                id.to_owned()
            } else {
                format!("{id}.{}", i + 1)
            };
            if count > 1 && stretch.end_s - stretch.start_s < self.settings.least_stretch_s {
                let reason = format!(
                    "the stretch from {:.3} s to {:.3} s is shorter than least_stretch_s = {} s; it is left out",
                    stretch.start_s, stretch.end_s, self.settings.least_stretch_s
                );
                survey
                    .problems
                    .push(problem(id, format!("stretch `{own}`"), reason));
                continue;
            }
            let clock = self.clock(stretch)?;
            if let Some(because) = &stretch.because {
                let reason = format!("{because}: what follows is a record of its own, `{own}`");
                survey
                    .problems
                    .push(problem(id, format!("stretch `{own}`"), reason));
            }
            let beside = |clocks: &Vec<Clock>| -> Vec<Clock> {
                if clocks.len() == count {
                    clocks.get(i).cloned().into_iter().collect()
                } else {
                    clocks.clone()
                }
            };
            let others = others.iter().flat_map(beside).collect();
            survey.stretches.push(Surveyed {
                flight_id: own,
                clock,
                others,
            });
        }
        if survey.stretches.is_empty() {
            return Err(self.at_time(match count {
                0 => "0 rows are no record; at least 2 are needed".to_owned(),
                _ => format!(
                    "time jumps {} times and leaves no stretch that is long enough",
                    count - 1
                ),
            }));
        }
        Ok(())
    }

    fn clock(&self, stretch: &Stretch) -> Result<Clock, Spoilt> {
        let mut slots = Slots::of(stretch);
        for used in &stretch.pieces {
            let mut row = used.piece.row;
            let rows = used.piece.row..used.piece.row + used.piece.rows;
            let mut push = |times: &[f64]| {
                slots.push(used, row, times);
                row += times.len();
            };
            self.times(used.piece.file, rows, &mut push)?;
        }
        slots
            .finish(self.settings)
            .map_err(|reason| self.at_time(reason))
    }
}

/// Rows one after the other with their times.
struct Rows {
    row: usize,
    times: Vec<f64>,
}

/// Rows of the two that have the same time.
fn meeting(a: &Rows, b: &Rows) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let mut j = 0;
    for (i, time) in a.times.iter().enumerate() {
        let near = 1e-6_f64.max(1e-9 * time.abs());
        while b.times.get(j).is_some_and(|t| *t < time - near) {
            j += 1;
        }
        if b.times.get(j).is_some_and(|t| (t - time).abs() <= near) {
            pairs.push((i, j));
        }
    }
    pairs
}
