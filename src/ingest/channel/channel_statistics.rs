//! Repairs and properties of a channel over a whole stretch.

use crate::flight::Mark;

/// Largest size of a measurement in any signal's unit: ten times the largest aircraft's moment of
/// inertia in slug ft². A larger number is no measurement.
pub const LARGEST: f64 = 1e9;

/// Number of kinds of [`Mark`].
const MARKS: usize = 6;

/// Repairs and properties of a channel over a whole stretch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelStatistics {
    /// Number of samples with each mark, by the mark's code.
    pub marks: [usize; MARKS],
    pub wraps: usize,
    /// Finest quantisation step of all spells.
    pub quantisation: Option<f64>,
    /// Median of the spells' noise, in the signal's unit.
    pub noise: Option<f64>,
    /// Samples of the record from one recorded value to the next: the median of the spells.
    pub period: usize,
    /// Intervals of samples in which the channel is stuck.
    pub stuck: Vec<(usize, usize)>,
    /// Number of missing samples for which the recording has no number. Repeated values that count as no
    /// measurement are not among them.
    pub absent: usize,
    /// Number of samples beyond [`LARGEST`], which count as missing, and the first of these
    /// samples.
    pub beyond: usize,
    pub first_beyond: Option<usize>,
    /// Number of fill values such as -9999, which count as missing, and the first of these samples with its value.
    pub fills: usize,
    pub first_fill: Option<(usize, f64)>,
}

impl ChannelStatistics {
    /// Number of samples with a mark.
    #[must_use]
    pub fn count(&self, mark: Mark) -> usize {
        self.marks[mark as usize]
    }

    /// Counts the marks of the samples from `first` on, which were recorded as these values.
    pub fn add(&mut self, first: usize, marks: &[Mark], recorded: &[f64]) {
        let mut from = 0;
        for run in marks.chunk_by(|a, b| a == b) {
            let (mark, to) = (run[0], from + run.len());
            self.marks[mark as usize] += run.len();
            match mark {
                Mark::Stuck => self.add_stuck(first + from, first + to),
                Mark::Missing => {
                    self.absent += recorded[from..to].iter().filter(|v| v.is_nan()).count();
                }
                _ => {}
            }
            from = to;
        }
    }

    fn add_stuck(&mut self, from: usize, to: usize) {
        match self.stuck.last_mut() {
            Some((_, end)) if *end == from => *end = to,
            _ => self.stuck.push((from, to)),
        }
    }
}
