//! A column of the files as samples of a clock: rows placed on their samples, or values of another
//! clock interpolated to it.

use std::ops::Range;

use crate::ingest::clock::{Clock, Run};
use crate::ingest::column_source::ColumnSource;
use crate::ingest::refusal::Refusal;
use crate::numerics::series::sample_count::nearest;

/// Gap between two runs, in rows, above which they are read separately; the rows of a smaller gap
/// are read and dropped. A column's page holds some ten thousand rows.
const SEPARATE_ROWS: usize = 1 << 16;

/// Samples of another clock that are read beyond each end of a range, in addition to one step's
/// samples. One is the interpolation's neighbour, one is for rounding.
const BEYOND_ENDS: f64 = 2.0;

/// One column of a flight's files.
pub struct ColumnSamples<'a, S: ColumnSource + ?Sized> {
    pub source: &'a S,
    pub name: &'a str,
}

impl<S: ColumnSource + ?Sized> ColumnSamples<'_, S> {
    /// `true` if a file of the clock has the column.
    pub fn is_on(&self, clock: &Clock) -> bool {
        let mut runs = clock.runs.iter();
        runs.any(|run| self.source.has(run.file, self.name))
    }

    /// Passes a range of samples to `sink`, NaN where the column has no row.
    pub fn read(
        &self,
        clock: &Clock,
        range: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), Refusal> {
        let mut next_sample = range.start;
        for group in grouped(clock.runs_in(range.clone())) {
            if !self.source.has(group.file, self.name) {
                continue;
            }
            let mut placement = Placement::of(&group, next_sample);
            let rows = group.rows.clone();
            self.source
                .read(group.file, self.name, rows, &mut |values| {
                    placement.place(values, sink);
                })
                .map_err(|reason| Refusal {
                    place: self.source.name(group.file),
                    reason,
                })?;
            next_sample = placement.next_sample;
        }
        pass_missing(next_sample..range.end, sink);
        Ok(())
    }

    /// Passes a range of samples of a column that has clocks of its own to `sink`, in pieces of
    /// `piece` samples.
    pub fn interpolate(
        &self,
        clock: &Clock,
        own_clocks: &[&Clock],
        range: Range<usize>,
        piece: usize,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), Refusal> {
        let mut from = range.start;
        while from < range.end {
            let to = (from + piece).min(range.end);
            let mut samples = NearestValues::none(from, to - from);
            for own in own_clocks {
                let range = overlapping_samples(clock, own, from..to);
                let mut recorded = Vec::with_capacity(range.len());
                let mut append = |values: &[f64]| recorded.extend_from_slice(values);
                self.read(own, range.clone(), &mut append)?;
                samples.take_nearer(clock, own, range.start, &recorded);
            }
            sink(&samples.values);
            from = to;
        }
        Ok(())
    }
}

/// Runs of one file that are read at once.
struct RunGroup {
    file: usize,
    rows: Range<usize>,
    runs: Vec<Run>,
}

impl RunGroup {
    /// `true` if a later run begins soon enough after the group's rows.
    fn reaches(&self, run: &Run) -> bool {
        let gap = run.row.checked_sub(self.rows.end);
        self.file == run.file && gap.is_some_and(|rows| rows < SEPARATE_ROWS)
    }
}

fn grouped(runs: impl Iterator<Item = Run>) -> Vec<RunGroup> {
    let mut groups: Vec<RunGroup> = Vec::new();
    for run in runs {
        match groups.last_mut() {
            Some(group) if group.reaches(&run) => {
                group.rows.end = run.row + run.count;
                group.runs.push(run);
            }
            _ => groups.push(RunGroup {
                file: run.file,
                rows: run.row..run.row + run.count,
                runs: vec![run],
            }),
        }
    }
    groups
}

/// Placement of a group's rows, as they are read, on their samples.
struct Placement<'a> {
    runs: &'a [Run],
    /// The next row to be read.
    row: usize,
    /// The next sample to be passed on.
    next_sample: usize,
}

impl<'a> Placement<'a> {
    fn of(group: &'a RunGroup, next_sample: usize) -> Placement<'a> {
        Placement {
            runs: &group.runs,
            row: group.rows.start,
            next_sample,
        }
    }

    /// Passes the samples of the next rows to `sink`, and NaN for the samples before them.
    fn place(&mut self, values: &[f64], sink: &mut dyn FnMut(&[f64])) {
        let batch = self.row..self.row + values.len();
        while let Some((run, later)) = self.runs.split_first() {
            let run_end = run.row + run.count;
            let (from, to) = (run.row.max(batch.start), run_end.min(batch.end));
            if from < to {
                let sample = run.sample + from - run.row;
                pass_missing(self.next_sample..sample, sink);
                let own = from - batch.start..to - batch.start;
                sink(values.get(own).unwrap_or_default());
                self.next_sample = sample + to - from;
            }
            if run_end > batch.end {
                break;
            }
            self.runs = later;
        }
        self.row = batch.end;
    }
}

/// Passes NaN for a range of samples.
fn pass_missing(samples: Range<usize>, sink: &mut dyn FnMut(&[f64])) {
    const MISSING: [f64; 1024] = [f64::NAN; 1024];
    for from in samples.clone().step_by(MISSING.len()) {
        sink(&MISSING[..(samples.end - from).min(MISSING.len())]);
    }
}

/// Samples of a clock `own` that a range of another clock's samples can depend on.
fn overlapping_samples(clock: &Clock, own: &Clock, range: Range<usize>) -> Range<usize> {
    let position = |sample: usize| (clock.time_s(sample) - own.start_s) / own.step_s;
    let reach = BEYOND_ENDS + clock.step_s / own.step_s;
    let first = nearest((position(range.start) - reach).floor());
    let last = nearest((position(range.end) + reach).ceil());
    first.min(own.samples)..last.min(own.samples)
}

/// For each given sample, the value recorded nearest to it. The value is moved along the line to
/// its neighbour by the fraction of a step between the two.
struct NearestValues {
    /// The first sample.
    first: usize,
    values: Vec<f64>,
    /// Distances of the recorded values, in steps of their own clock.
    distances: Vec<f64>,
}

impl NearestValues {
    fn none(first: usize, count: usize) -> NearestValues {
        NearestValues {
            first,
            values: vec![f64::NAN; count],
            distances: vec![f64::INFINITY; count],
        }
    }

    /// Takes the recorded values, from sample `start` of the clock `own` on, that are nearer than
    /// those taken before.
    fn take_nearer(&mut self, clock: &Clock, own: &Clock, start: usize, recorded: &[f64]) {
        for (i, value) in recorded.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let time_s = own.time_s(start + i);
            let sample = nearest((time_s - clock.start_s) / clock.step_s);
            let offset = (clock.time_s(sample) - time_s) / own.step_s;
            let distance = offset.abs();
            let Some(k) = sample.checked_sub(self.first) else {
                continue;
            };
            if k >= self.values.len() || distance >= self.distances[k] {
                continue;
            }
            let neighbour = if offset < 0.0 {
                i.checked_sub(1)
            } else {
                Some(i + 1)
            };
            let neighbour = neighbour
                .and_then(|j| recorded.get(j))
                .copied()
                .filter(|v| v.is_finite())
                .unwrap_or(*value);
            self.values[k] = value + distance * (neighbour - value);
            self.distances[k] = distance;
        }
    }
}
