//! The uniform clock of a stretch, and the sample on it that each recorded row is.
//!
//! A recorder's time jitters by some tenths of a millisecond, loses frames and runs a little off
//! its nominal rate. Rows keep their values: they are put into the sample nearest to their time,
//! nothing is interpolated. Rows without a hole between them are one [`Run`], so a long flight's
//! clock is a short list.

use super::Settings;
use super::stretches::{Stretch, Used};

/// Rows that are samples one after the other: row `row + i` of the file is sample `sample + i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    pub file: usize,
    pub row: usize,
    pub sample: usize,
    pub count: usize,
}

/// Sample `k` is at `start_s + k step_s`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clock {
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    pub runs: Vec<Run>,
    /// Rows used.
    pub rows: usize,
    /// Rows left out because their sample was there already.
    pub again: usize,
    /// Standard deviation of the time stamps about the clock, s.
    pub jitter_s: f64,
}

/// More empty samples than this per recorded row, and the step is not the recorder's.
const SAMPLES_PER_ROW: usize = 10;

/// How far a configured rate may be from the recorded one, relative.
const RATE_TOLERANCE: f64 = 0.05;

/// How fast the clock follows a drift of the recorder's phase, per sample: slow against jitter,
/// fast against drift.
const PHASE_GAIN: f64 = 0.05;

/// A row that is early by less than this share of a step is the next sample, one that is earlier is
/// there twice.
const NEXT: f64 = 0.75;

/// Time stamps that scatter by more than this share of a step do not tell which sample a row is.
const MOST_JITTER: f64 = 0.3;

/// The second pass over the times of a stretch: row by row into samples.
#[derive(Clone, Debug)]
pub struct Slots {
    step_s: f64,
    phase: f64,
    last_s: f64,
    squares: f64,
    clock: Clock,
}

impl Slots {
    #[must_use]
    pub fn of(stretch: &Stretch) -> Slots {
        let clock = Clock {
            start_s: stretch.start_s,
            step_s: stretch.step_s,
            ..Clock::default()
        };
        Slots {
            step_s: stretch.step_s,
            phase: 0.0,
            last_s: f64::NAN,
            squares: 0.0,
            clock,
        }
    }

    /// Times of rows of a piece, from row `row` of its file on.
    pub fn push(&mut self, used: &Used, row: usize, times: &[f64]) {
        for (i, time) in times.iter().enumerate() {
            if *time > used.after_s {
                self.row(used.piece.file, row + i, *time);
            } else {
                self.clock.again += 1;
            }
        }
    }

    fn row(&mut self, file: usize, row: usize, time: f64) {
        let steps = (time - self.clock.start_s) / self.step_s;
        let mut sample = index(steps - self.phase);
        let next = self.clock.samples;
        // Jitter may put a row a little before its sample: it is the next one, unless there is no
        // time for it.
        if sample < next && steps - self.phase > next as f64 - NEXT && time > self.last_s {
            sample = next;
        }
        if sample < next {
            self.clock.again += 1;
            return;
        }
        let off = steps - sample as f64 - self.phase;
        self.phase += PHASE_GAIN * off;
        self.squares += off * off;
        self.last_s = time;
        let clock = &mut self.clock;
        clock.rows += 1;
        clock.samples = sample + 1;
        let goes_on = |run: &&mut Run| {
            run.file == file && run.row + run.count == row && run.sample + run.count == sample
        };
        match clock.runs.last_mut().filter(goes_on) {
            Some(run) => run.count += 1,
            None => clock.runs.push(Run {
                file,
                row,
                sample,
                count: 1,
            }),
        }
    }

    /// The clock of all rows; the stretch is over.
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
        if let Some(rate) = settings.sampling_rate_hz
            && (self.step_s * rate - 1.0).abs() > RATE_TOLERANCE
        {
            return Err(format!(
                "the record runs at {:.2} Hz, sampling_rate_hz says {rate} Hz",
                1.0 / self.step_s
            ));
        }
        clock.jitter_s = (self.squares / clock.rows as f64).sqrt() * self.step_s;
        if clock.samples / SAMPLES_PER_ROW > clock.rows
            || clock.jitter_s > MOST_JITTER * self.step_s
        {
            return Err(format!(
                "{} rows span {:.1} s, {} steps of {:.3} ms, and scatter about them by {:.3} ms: the time step is not steady",
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

/// The nearest whole number, not below zero.
pub(super) fn index(value: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounded and not negative"
    )]
    let index = value.round().max(0.0) as usize;
    index
}

impl Clock {
    /// The time of a sample, s.
    #[must_use]
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 * self.step_s
    }

    /// The runs of a range of samples, cut to it.
    pub fn runs_of(&self, samples: std::ops::Range<usize>) -> impl Iterator<Item = Run> + '_ {
        let first = self
            .runs
            .partition_point(|r| r.sample + r.count <= samples.start);
        let within = self
            .runs
            .iter()
            .skip(first)
            .take_while(move |r| r.sample < samples.end);
        let (from, to) = (samples.start, samples.end);
        within.map(move |r| {
            let skipped = from.saturating_sub(r.sample);
            let count = (r.sample + r.count).min(to) - r.sample - skipped;
            Run {
                row: r.row + skipped,
                sample: r.sample + skipped,
                count,
                ..*r
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::pieces::{Piece, Scan};
    use super::super::stretches;
    use super::*;
    use approx::assert_abs_diff_eq;

    /// The clock of rows of one file that are one stretch.
    fn clock(times: &[f64]) -> Result<Clock, String> {
        with(times, &Settings::default())
    }

    fn with(times: &[f64], settings: &Settings) -> Result<Clock, String> {
        let mut scan = Scan::of_file(0);
        scan.push(times);
        let never = |_: &Piece, _: &Piece| Ok(false);
        let plan = stretches::plan(&[scan.finish()], settings, &|_| String::new(), &mut {
            never
        })?;
        let stretch = plan.stretches.first().ok_or("no rows")?;
        let mut slots = Slots::of(stretch);
        for used in &stretch.pieces {
            let row = used.piece.row;
            slots.push(used, row, &times[row..row + used.piece.rows]);
        }
        slots.finish(settings)
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
        let cut: Vec<Run> = clock.runs_of(1..6).collect();
        let run = |row, sample, count| Run {
            file: 0,
            row,
            sample,
            count,
        };
        assert_eq!(cut, [run(1, 1, 2), run(3, 5, 1)]);
        assert_eq!(clock.runs_of(3..5).count(), 0);
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
        assert_eq!((clock.rows, clock.samples, clock.again), (3000, 3000, 0));
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
            "the record runs at 40.00 Hz, sampling_rate_hz says 50 Hz"
        );
    }

    #[test]
    fn two_rows_for_one_sample_are_one() {
        let clock = clock(&[0.0, 0.025, 0.05, 0.050_1, 0.075, 0.1]).unwrap();
        assert_eq!((clock.samples, clock.again), (5, 1));
    }
}
