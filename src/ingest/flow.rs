//! The flow of one channel from its files to settled samples: rows into the samples of the clock,
//! slower or faster streams brought to it, through the conditioner, piece by piece.

use std::ops::Range;

use super::clock::{Clock, Run, index};
use super::conditioner::{Conditioner, Done};
use super::motion::Averaging;
use super::signature::Samples;
use super::source::Source;
use super::survey::Surveyed;
use super::{Plan, Settings, Spoilt};
use crate::flight::Channel;
use crate::flight::record::Series;

/// Rows further apart than this in a file are read one after the other, not through what lies
/// between.
const FAR: usize = 1 << 16;

/// One channel on its way.
#[derive(Clone, Debug)]
pub struct Flow<'a> {
    /// The column of the files, and what it means.
    name: &'a str,
    channel: &'a Channel,
    stretch: &'a Surveyed,
    conditioner: Conditioner,
    averaging: Option<Averaging>,
    samples: Samples,
}

/// What a channel leaves behind when it has flowed.
#[derive(Clone, Debug)]
pub struct Flowed<'a> {
    pub name: &'a str,
    pub channel: &'a Channel,
    pub done: Done,
    /// Its means over short blocks, where a relation uses it.
    pub averaging: Option<Averaging>,
    pub samples: Samples,
}

impl<'a> Flow<'a> {
    /// A planned channel over a stretch.
    #[must_use]
    pub fn new(plan: &Plan<'a>, stretch: &'a Surveyed, settings: &Settings) -> Flow<'a> {
        let Plan {
            name,
            channel,
            factor,
        } = *plan;
        let (step_s, samples) = (stretch.clock.step_s, stretch.clock.samples);
        Flow {
            name,
            channel,
            stretch,
            conditioner: Conditioner::new(channel, factor, step_s, samples, settings),
            averaging: Averaging::of(&channel.signal, step_s, &settings.checks),
            samples: Samples::of(&stretch.clock),
        }
    }

    #[must_use]
    pub fn signal(&self) -> &'a str {
        &self.channel.signal
    }

    /// Hands over the samples up to `until`, settled, in order; they are conditioned in pieces of
    /// `piece` samples or hardly more.
    ///
    /// # Errors
    /// What cannot be read, or what `sink` says.
    pub fn run(
        &mut self,
        source: &(impl Source + ?Sized),
        until: usize,
        piece: usize,
        sink: &mut dyn FnMut(&Series) -> Result<(), String>,
    ) -> Result<(), Spoilt> {
        let range = self.conditioner.pushed()
            ..self
                .conditioner
                .wanted(until)
                .max(self.conditioner.pushed());
        let clock = &self.stretch.clock;
        let on_clock = |c: &Clock| c.runs.iter().any(|r| source.has(r.file, self.name));
        let (conditioner, averaging, samples) = (
            &mut self.conditioner,
            &mut self.averaging,
            &mut self.samples,
        );
        let mut said = Ok(());
        let mut through = |values: &[f64]| {
            conditioner.push(values);
            let ready = conditioner.ready().min(until);
            let enough = if ready == until { 1 } else { piece };
            if said.is_ok() && ready >= conditioner.settled() + enough {
                let series = conditioner.settle(ready);
                if let Some(averaging) = averaging {
                    averaging.push(&series.values);
                }
                samples.push(&series);
                said = sink(&series);
            }
        };
        let feed = if on_clock(clock) {
            rows_into(source, self.name, clock, range, &mut through)
        } else {
            let beside: Vec<&Clock> = self.stretch.others.iter().filter(|c| on_clock(c)).collect();
            brought_to(
                source,
                self.name,
                clock,
                &beside,
                range,
                piece,
                &mut through,
            )
        };
        feed?;
        // What was pushed with an earlier piece may be all that is wanted.
        through(&[]);
        said.map_err(|reason| (format!("channel `{}`", self.name), reason))
    }

    /// What the channel leaves behind.
    #[must_use]
    pub fn finish(self) -> Flowed<'a> {
        let Flow {
            name,
            channel,
            averaging,
            samples,
            ..
        } = self;
        Flowed {
            name,
            channel,
            done: self.conditioner.finish(),
            averaging,
            samples,
        }
    }
}

/// Runs of one file that are read in one go.
struct Group {
    file: usize,
    rows: Range<usize>,
    runs: Vec<Run>,
}

fn groups(runs: impl Iterator<Item = Run>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for run in runs {
        let near = |g: &&mut Group| {
            g.file == run.file && run.row >= g.rows.end && run.row - g.rows.end < FAR
        };
        match groups.last_mut().filter(near) {
            Some(group) => {
                group.rows.end = run.row + run.count;
                group.runs.push(run);
            }
            None => groups.push(Group {
                file: run.file,
                rows: run.row..run.row + run.count,
                runs: vec![run],
            }),
        }
    }
    groups
}

/// Hands over a range of samples of a channel that is on the clock, NaN where there is no row.
fn rows_into(
    source: &(impl Source + ?Sized),
    name: &str,
    clock: &Clock,
    range: Range<usize>,
    sink: &mut dyn FnMut(&[f64]),
) -> Result<(), Spoilt> {
    let mut at = range.start;
    for group in groups(clock.runs_of(range.clone()))
        .iter()
        .filter(|g| source.has(g.file, name))
    {
        let mut runs = group.runs.iter();
        let mut run = runs.next();
        let mut row = group.rows.start;
        let mut place = |values: &[f64]| {
            let batch = row..row + values.len();
            while let Some(current) = run {
                let (from, to) = (
                    current.row.max(batch.start),
                    (current.row + current.count).min(batch.end),
                );
                if from < to {
                    let sample = current.sample + from - current.row;
                    nothing(at..sample, sink);
                    sink(
                        values
                            .get(from - batch.start..to - batch.start)
                            .unwrap_or_default(),
                    );
                    at = sample + to - from;
                }
                if current.row + current.count > batch.end {
                    break;
                }
                run = runs.next();
            }
            row = batch.end;
        };
        let read = source.read(group.file, name, group.rows.clone(), &mut place);
        read.map_err(|reason| (source.name(group.file), reason))?;
    }
    nothing(at..range.end, sink);
    Ok(())
}

/// In this range of samples nothing is recorded.
fn nothing(samples: Range<usize>, sink: &mut dyn FnMut(&[f64])) {
    const NOTHING: [f64; 1024] = [f64::NAN; 1024];
    for from in samples.clone().step_by(NOTHING.len()) {
        sink(&NOTHING[..(samples.end - from).min(NOTHING.len())]);
    }
}

/// Hands over a range of samples of a channel that has a clock of its own: each of its values at
/// the sample nearest to it, moved along the line to its neighbour by the part of a step between
/// the two.
fn brought_to(
    source: &(impl Source + ?Sized),
    name: &str,
    clock: &Clock,
    beside: &[&Clock],
    range: Range<usize>,
    piece: usize,
    sink: &mut dyn FnMut(&[f64]),
) -> Result<(), Spoilt> {
    let mut from = range.start;
    while from < range.end {
        let to = (from + piece).min(range.end);
        let mut values = vec![f64::NAN; to - from];
        let mut nearest = vec![f64::INFINITY; to - from];
        for own in beside {
            let near = |sample: usize| (clock.time_s(sample) - own.start_s) / own.step_s;
            let reach = 2.0 + clock.step_s / own.step_s;
            let (first, last) = (
                index((near(from) - reach).floor()),
                index((near(to) + reach).ceil()),
            );
            let samples = first.min(own.samples)..last.min(own.samples);
            let mut recorded = Vec::with_capacity(samples.len());
            let mut keep = |v: &[f64]| recorded.extend_from_slice(v);
            rows_into(source, name, own, samples.clone(), &mut keep)?;
            for (i, value) in recorded.iter().enumerate().filter(|(_, v)| v.is_finite()) {
                let time_s = own.time_s(samples.start + i);
                let sample = index((time_s - clock.start_s) / clock.step_s);
                let off = (clock.time_s(sample) - time_s) / own.step_s;
                let Some(k) = sample
                    .checked_sub(from)
                    .filter(|k| *k < nearest.len() && off.abs() < nearest[*k])
                else {
                    continue;
                };
                let beyond = if off < 0.0 {
                    i.checked_sub(1)
                } else {
                    Some(i + 1)
                };
                let neighbour = beyond
                    .and_then(|j| recorded.get(j))
                    .copied()
                    .filter(|v| v.is_finite());
                (values[k], nearest[k]) = (
                    value + off.abs() * (neighbour.unwrap_or(*value) - value),
                    off.abs(),
                );
            }
        }
        sink(&values);
        from = to;
    }
    Ok(())
}
