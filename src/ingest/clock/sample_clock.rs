//! The uniform clock of a stretch, and the sample of each recorded row on it.
//!
//! A recorder's time jitters by some tenths of a millisecond, loses frames and runs a little off
//! its nominal rate. Rows keep their values: each goes into the sample nearest to its time, and
//! nothing is interpolated. Rows without a gap between them are one [`Run`], so a long flight's
//! clock is a short list.

use std::ops::Range;

use super::merge::{PiecePart, PieceSequence};
use crate::ingest::settings::Settings;
use crate::numerics::series::sample_count::nearest;

/// Consecutive rows that are consecutive samples: row `row + i` of the file is sample `sample + i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    pub file: usize,
    pub row: usize,
    pub sample: usize,
    pub count: usize,
}

/// Uniform clock of a stretch: sample `k` is at `start_s + k step_s`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clock {
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    pub runs: Vec<Run>,
    /// Rows used.
    pub rows: usize,
    /// Rows left out because their sample has a row already.
    pub repeated: usize,
    /// Standard deviation of the time stamps about the clock, s.
    pub jitter_s: f64,
}

/// Largest number of samples per recorded row. With more empty samples than that the step is not
/// the recorder's, or the recorder was off.
const SAMPLES_PER_ROW: usize = 10;

/// Smallest mean number of rows in a run of a recorder that was off. With a step that is not the
/// recorder's, most rows are runs by themselves.
const ROWS_PER_RUN: usize = 10;

/// Upper limit of a sample's number, which only a damaged time reaches.
const MOST_SAMPLES: usize = usize::MAX / 2;

/// Largest relative difference between the configured rate and the recorded one. Recorders keep their rate to a
/// part in a thousand; usual rates (20, 25, 32, 36, 40, 50 Hz) differ by a tenth and more.
const RATE_TOLERANCE: f64 = 0.05;

/// Gain of the filter that follows a drift of the recorder's phase, per sample: slow against
/// jitter, fast against drift.
const PHASE_GAIN: f64 = 0.05;

/// Largest share of a step by which a row may be early and still be the next sample. An earlier row
/// repeats a sample.
const EARLY: f64 = 0.75;

/// Distance of two clocks, in steps of the slower one, beyond which no value is interpolated from
/// one to the other. It is more than the interpolation reaches.
const NEAR_STEPS: f64 = 8.0;

/// Largest scatter of the time stamps, as a share of a step, at which the nearest sample still is
/// the row's own.
const MOST_JITTER: f64 = 0.3;

/// Second pass over the times of a sequence: assigns its rows to samples.
#[derive(Clone, Debug)]
pub struct ClockBuilder {
    /// Step by which samples are counted, s; the finished clock's follows from the last row.
    step_s: f64,
    /// Running mean of the time stamps' deviation from their samples, in steps.
    phase: f64,
    last_s: f64,
    /// Sum of the squared deviations from the phase, in steps².
    squares: f64,
    clock: Clock,
}

impl ClockBuilder {
    #[must_use]
    pub fn of(sequence: &PieceSequence) -> ClockBuilder {
        let clock = Clock {
            start_s: sequence.start_s,
            step_s: sequence.step_s,
            ..Clock::default()
        };
        ClockBuilder {
            step_s: sequence.step_s,
            phase: 0.0,
            last_s: f64::NAN,
            squares: 0.0,
            clock,
        }
    }

    /// Takes the times of rows of a piece, from row `row` of its file on.
    pub fn push(&mut self, part: &PiecePart, row: usize, times: &[f64]) {
        for (i, time) in times.iter().enumerate() {
            if *time > part.after_s {
                self.push_row(part.piece.file, row + i, *time);
            } else {
                self.clock.repeated += 1;
            }
        }
    }

    fn push_row(&mut self, file: usize, row: usize, time: f64) {
        let steps = (time - self.clock.start_s) / self.step_s;
        let Some(sample) = self.sample_of(steps, time) else {
            self.clock.repeated += 1;
            return;
        };
        let deviation = steps - sample as f64 - self.phase;
        self.phase += PHASE_GAIN * deviation;
        self.squares += deviation * deviation;
        self.last_s = time;
        self.clock.append_row(file, row, sample);
    }

    /// Sample of a row that is `steps` after the first one; `None` if another row has this sample.
    /// A row that is early by jitter becomes the next sample.
    fn sample_of(&self, steps: f64, time: f64) -> Option<usize> {
        let sample = nearest(steps - self.phase).min(MOST_SAMPLES);
        let next = self.clock.samples;
        if sample >= next {
            return Some(sample);
        }
        let is_early = steps - self.phase > next as f64 - EARLY && time > self.last_s;
        is_early.then_some(next)
    }

    /// Returns the clock of all rows.
    ///
    /// # Errors
    /// In words: too few rows, a step that is not steady, or a rate other than the configured one.
    pub fn finish(self, settings: &Settings) -> Result<Clock, String> {
        let mut clock = self.clock;
        if clock.rows < 2 {
            return Err(format!(
                "{} rows are no record; at least 2 are needed",
                clock.rows
            ));
        }
        if self.step_s <= 0.0 {
            return Err("time stands still or runs backwards".to_owned());
        }
        if let Some(rate) = settings.sampling_rate_hz
            && (self.step_s * rate - 1.0).abs() > RATE_TOLERANCE
        {
            return Err(format!(
                "the record runs at {:.2} Hz, sampling_rate_hz is {rate} Hz",
                1.0 / self.step_s
            ));
        }
        clock.jitter_s = (self.squares / clock.rows as f64).sqrt() * self.step_s;
        let is_sparse = clock.samples / SAMPLES_PER_ROW > clock.rows
            && clock.rows / ROWS_PER_RUN < clock.runs.len();
        if is_sparse || clock.jitter_s > MOST_JITTER * self.step_s {
            return Err(format!(
                "{} rows span {:.1} s, {} steps of {:.3} ms, and scatter about them by {:.3} ms: \
                 the time step is not steady",
                clock.rows,
                self.last_s - clock.start_s,
                clock.samples - 1,
                self.step_s * 1e3,
                clock.jitter_s * 1e3
            ));
        }
        clock.step_s = (self.last_s - clock.start_s) / (clock.samples - 1) as f64;
        Ok(clock)
    }
}

impl Run {
    /// `true` if the run goes on with this row of a file as this sample.
    fn continues_with(&self, file: usize, row: usize, sample: usize) -> bool {
        self.file == file && self.row + self.count == row && self.sample + self.count == sample
    }
}

impl Clock {
    /// Time of a sample, s.
    #[must_use]
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 * self.step_s
    }

    /// `true` if another clock has a sample within some steps of this clock's span, so that its
    /// values can be interpolated to this clock.
    pub(super) fn is_near(&self, other: &Clock) -> bool {
        let margin_s = NEAR_STEPS * self.step_s.max(other.step_s);
        let end_s = |clock: &Clock| clock.time_s(clock.samples) + margin_s;
        self.start_s <= end_s(other) && other.start_s <= end_s(self)
    }

    /// Runs of a range of samples, cut to the range.
    pub fn runs_in(&self, samples: Range<usize>) -> impl Iterator<Item = Run> + '_ {
        let first = self
            .runs
            .partition_point(|run| run.sample + run.count <= samples.start);
        let within = self
            .runs
            .iter()
            .skip(first)
            .take_while(move |run| run.sample < samples.end);
        within.map(move |run| {
            let skipped = samples.start.saturating_sub(run.sample);
            let count = (run.sample + run.count).min(samples.end) - run.sample - skipped;
            Run {
                row: run.row + skipped,
                sample: run.sample + skipped,
                count,
                ..*run
            }
        })
    }

    /// Appends a row as a sample after all others.
    fn append_row(&mut self, file: usize, row: usize, sample: usize) {
        self.rows += 1;
        self.samples = sample + 1;
        match self.runs.last_mut() {
            Some(run) if run.continues_with(file, row, sample) => run.count += 1,
            _ => self.runs.push(Run {
                file,
                row,
                sample,
                count: 1,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::merge::merge_pieces;
    use super::super::pieces::{Piece, PieceScanner};
    use super::*;
    use approx::assert_abs_diff_eq;

    /// The clock of rows of one file that are one sequence.
    fn clock(times: &[f64]) -> Result<Clock, String> {
        with(times, &Settings::default())
    }

    fn with(times: &[f64], settings: &Settings) -> Result<Clock, String> {
        let mut scanner = PieceScanner::of_file(0);
        scanner.push(times);
        let name = |_| String::new();
        let mut never = |_: &Piece, _: &Piece| Ok(false);
        let merged = merge_pieces(&[scanner.finish()], settings, &name, &mut never)?;
        let sequence = merged.sequences.first().ok_or("no rows")?;
        let mut builder = ClockBuilder::of(sequence);
        for part in &sequence.parts {
            let row = part.piece.row;
            builder.push(part, row, &times[row..row + part.piece.rows]);
        }
        builder.finish(settings)
    }

    /// The sample of every row that has one.
    fn samples(clock: &Clock) -> Vec<usize> {
        clock
            .runs
            .iter()
            .flat_map(|r| r.sample..r.sample + r.count)
            .collect()
    }

    #[test]
    fn lost_frames_are_samples_without_a_row() {
        let clock = clock(&[0.0, 0.025, 0.05, 0.125, 0.15]).unwrap();
        assert_eq!(samples(&clock), [0, 1, 2, 5, 6]);
        assert_eq!((clock.samples, clock.rows, clock.runs.len()), (7, 5, 2));
        let cut: Vec<Run> = clock.runs_in(1..6).collect();
        let run = |row, sample, count| Run {
            file: 0,
            row,
            sample,
            count,
        };
        assert_eq!(cut, [run(1, 1, 2), run(3, 5, 1)]);
        assert_eq!(clock.runs_in(3..5).count(), 0);
    }

    #[test]
    fn jitter_does_not_move_a_row_into_another_sample() {
        let jitter = [0.0, 0.0011, -0.0009, 0.0004, -0.0012, 0.0007];
        let times: Vec<f64> = (0..3000)
            .map(|k| k as f64 * 0.025 + jitter[k % 6])
            .collect();
        let clock = clock(&times).unwrap();
        assert!(
            samples(&clock)
                .iter()
                .enumerate()
                .all(|(k, sample)| k == *sample)
        );
        assert_abs_diff_eq!(clock.jitter_s, 0.000_85, epsilon = 1e-4);
    }

    #[test]
    fn jitter_of_more_than_half_a_step_now_and_then_loses_no_row() {
        let off = |k: usize| if k % 50 == 10 { -0.014 } else { 0.0 };
        let times: Vec<f64> = (0..3000).map(|k| k as f64 * 0.025 + off(k)).collect();
        let clock = clock(&times).unwrap();
        assert_eq!((clock.rows, clock.samples, clock.repeated), (3000, 3000, 0));
    }

    #[test]
    fn a_clock_slightly_off_its_nominal_rate_does_not_slip() {
        let settings = Settings {
            sampling_rate_hz: Some(40.0),
            ..Settings::default()
        };
        let times: Vec<f64> = (0..100_000).map(|k| f64::from(k) * 0.025_01).collect();
        let clock = with(&times, &settings).unwrap();
        assert_eq!(clock.samples, 100_000);
        assert_abs_diff_eq!(clock.step_s, 0.025_01, epsilon = 1e-12);
    }

    #[test]
    fn a_gap_is_counted_in_whole_steps_despite_jitter() {
        let jitter = [0.0, 0.0008, -0.0006, 0.0002, -0.0005];
        let rows: Vec<usize> = (0..2000).chain(4_000..6_000).collect();
        let times: Vec<f64> = rows
            .iter()
            .map(|&k| k as f64 * 0.025 + jitter[k % 5])
            .collect();
        assert_eq!(samples(&clock(&times).unwrap()), rows);
    }

    #[test]
    fn a_short_record_and_an_unsteady_step_are_refused() {
        assert!(clock(&[1.0]).unwrap_err().contains("1 rows"));
        let mut times: Vec<f64> = (0..20).map(|k| f64::from(k) * 1e-7).collect();
        times.extend((1..15).map(|k| f64::from(k) * 50.0));
        assert!(clock(&times).unwrap_err().contains("not steady"));
    }

    #[test]
    fn a_rate_other_than_the_configured_one_is_refused() {
        let settings = Settings {
            sampling_rate_hz: Some(50.0),
            ..Settings::default()
        };
        let what = with(&[0.0, 0.025, 0.05, 0.075], &settings).unwrap_err();
        assert_eq!(
            what,
            "the record runs at 40.00 Hz, sampling_rate_hz is 50 Hz"
        );
    }

    #[test]
    fn two_rows_for_one_sample_are_one() {
        let clock = clock(&[0.0, 0.025, 0.05, 0.050_1, 0.075, 0.1]).unwrap();
        assert_eq!((clock.samples, clock.repeated), (5, 1));
    }
}
