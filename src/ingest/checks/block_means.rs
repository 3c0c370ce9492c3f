//! Means of the channels over short blocks, from which the kinematic relations are computed.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::earth::air;
use crate::flight::{Correction, signal};
use crate::ingest::settings::Checks;
use crate::numerics::series::sample_count::whole_steps;
use crate::numerics::statistics::order_statistics::upper_median;

/// Signals that the relations and the checks of mass, inertias and engines use.
const USED: &[&str] = &[
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::VELOCITY,
    signal::MACH,
    signal::ALTITUDE,
    signal::AIR_TEMPERATURE,
    signal::P,
    signal::Q,
    signal::R,
    signal::THETA,
    signal::PHI,
    signal::PSI,
    signal::AN,
    signal::AX,
    signal::AY,
    signal::QBAR,
    signal::MASS,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
    signal::IX,
    signal::IY,
    signal::IZ,
    signal::IXZ,
    signal::THRUST,
    signal::RPM_LEFT,
    signal::RPM_RIGHT,
];

/// Relative difference below which two means are equal: rounding of sums of one value.
const SAME_MEAN: f64 = 1e-9;

/// Running mean of a signal over short blocks. A block with fewer than half of its samples is NaN.
#[derive(Clone, Debug)]
pub struct BlockAverager {
    /// Samples of a block.
    length: usize,
    /// Sum and count of the finite samples of the open block, and count of all its samples.
    sum: f64,
    finite: usize,
    count: usize,
    means: Vec<f64>,
}

impl BlockAverager {
    /// Averager of a signal; `None` if no relation uses it.
    #[must_use]
    pub fn of(signal: &str, step_s: f64, settings: &Checks) -> Option<BlockAverager> {
        USED.contains(&signal).then(|| BlockAverager {
            length: block_length(step_s, settings),
            sum: 0.0,
            finite: 0,
            count: 0,
            means: Vec::new(),
        })
    }

    /// Averager of a signal that has one value throughout.
    #[must_use]
    pub fn constant(
        signal: &str,
        value: f64,
        samples: usize,
        step_s: f64,
        settings: &Checks,
    ) -> Option<BlockAverager> {
        let mut averager = BlockAverager::of(signal, step_s, settings)?;
        averager.means = vec![value; samples / averager.length];
        Some(averager)
    }

    /// Takes the next samples.
    pub fn push(&mut self, values: &[f64]) {
        let mut values = values;
        while !values.is_empty() {
            let (now, later) = values.split_at(values.len().min(self.length - self.count));
            for value in now.iter().filter(|v| v.is_finite()) {
                self.sum += value;
                self.finite += 1;
            }
            self.count += now.len();
            values = later;
            if self.count == self.length {
                self.close_block();
            }
        }
    }

    fn close_block(&mut self) {
        let mean = if 2 * self.finite >= self.length {
            self.sum / self.finite as f64
        } else {
            f64::NAN
        };
        self.means.push(mean);
        (self.sum, self.finite, self.count) = (0.0, 0, 0);
    }
}

fn block_length(step_s: f64, settings: &Checks) -> usize {
    whole_steps(settings.block_s, step_s).max(1)
}

/// Block means of the signals that the relations use.
#[derive(Clone, Debug)]
pub struct BlockMeans {
    pub block_s: f64,
    pub count: usize,
    means: BTreeMap<&'static str, ScaledMeans>,
}

/// Block means of one signal, with the factor by which a trial correction multiplies them.
#[derive(Clone, Debug)]
struct ScaledMeans {
    /// Shared between the trials of a flight.
    means: Arc<Vec<f64>>,
    factor: f64,
}

impl BlockMeans {
    /// Block means of signals averaged over all samples of a record.
    #[must_use]
    pub fn of(
        mut averaged: BTreeMap<String, BlockAverager>,
        samples: usize,
        step_s: f64,
        settings: &Checks,
    ) -> BlockMeans {
        let length = block_length(step_s, settings);
        let mut means = BTreeMap::new();
        for signal in USED {
            if let Some(averager) = averaged.remove(*signal) {
                let means_of_signal = ScaledMeans {
                    means: Arc::new(averager.means),
                    factor: 1.0,
                };
                means.insert(*signal, means_of_signal);
            }
        }
        BlockMeans {
            block_s: length as f64 * step_s,
            count: samples / length,
            means,
        }
    }

    pub fn has(&self, signal: &str) -> bool {
        self.means.contains_key(signal)
    }

    /// Median of a signal's finite means.
    pub fn median(&self, signal: &str) -> Option<f64> {
        let means = self.means_of(signal);
        let means = (0..self.count).map(|block| means.mean(block));
        upper_median(means.filter(|mean| mean.is_finite()))
    }

    /// Median size of the changes of a signal from one block to the next.
    pub fn median_change(&self, signal: &str) -> Option<f64> {
        let means = self.means_of(signal);
        let change = |block: usize| (means.mean(block) - means.mean(block - 1)).abs();
        let changes = (1..self.count).map(change);
        upper_median(changes.filter(|change| change.is_finite()))
    }

    /// `true` if a signal never changes. Noise changes every signal except that of a dead sensor.
    pub fn is_constant(&self, signal: &str) -> bool {
        let Some(own) = self.means.get(signal) else {
            return true;
        };
        let mut finite = own.means.iter().filter(|v| v.is_finite());
        let Some(first) = finite.next() else {
            return true;
        };
        finite.all(|v| (v - first).abs() <= SAME_MEAN * first.abs())
    }

    /// `true` if airspeed, dynamic pressure or Mach number exceed the value for a velocity (ft/s)
    /// in most of the record. One of the three may be dead.
    pub fn is_flying_faster_than(&self, velocity_ft_s: f64) -> bool {
        // At sea level: higher up the same pressure takes a higher velocity.
        let sea_level = air(0.0);
        let pressure = 0.5 * sea_level.density_slug_ft3 * velocity_ft_s * velocity_ft_s;
        self.mostly_exceeds(signal::VELOCITY, velocity_ft_s)
            || self.mostly_exceeds(signal::QBAR, pressure)
            || self.mostly_exceeds(signal::MACH, velocity_ft_s / sea_level.sound_ft_s)
    }

    fn mostly_exceeds(&self, signal: &str, level: f64) -> bool {
        let means = self.means_of(signal);
        let means = (0..self.count).map(|block| means.mean(block));
        let (mut above, mut finite) = (0, 0);
        for mean in means.filter(|mean| mean.is_finite()) {
            above += usize::from(mean.abs() > level);
            finite += 1;
        }
        2 * above > finite
    }

    /// These means with one signal multiplied by a factor: a trial correction of its channel.
    pub fn with(&self, signal: &str, factor: f64) -> BlockMeans {
        let mut changed = self.clone();
        if let Some(own) = changed.means.get_mut(signal) {
            own.factor *= factor;
        }
        changed
    }

    /// These means without some signals, as if they were not recorded.
    pub fn without(&self, left_out: impl Fn(&str) -> bool) -> BlockMeans {
        let mut changed = self.clone();
        changed.means.retain(|signal, _| !left_out(signal));
        changed
    }

    /// These means with instrument errors removed.
    pub fn corrected(&self, corrections: &[Correction]) -> BlockMeans {
        let mut changed = self.clone();
        for correction in corrections.iter().filter(|c| c.changes_values()) {
            if let Some(own) = changed.means.get_mut(correction.signal.as_str()) {
                own.means = Arc::new(correction.of_values(&own.means, self.block_s));
            }
        }
        changed
    }

    /// Means of one signal over all blocks.
    pub fn means_of(&self, signal: &str) -> SignalMeans<'_> {
        let own = self.means.get(signal);
        SignalMeans {
            means: own.map_or(&[], |own| &own.means),
            factor: own.map_or(1.0, |own| own.factor),
        }
    }
}

/// Block means of one signal; none if it is not recorded.
#[derive(Clone, Copy, Debug)]
pub struct SignalMeans<'a> {
    means: &'a [f64],
    factor: f64,
}

impl SignalMeans<'_> {
    /// Mean over a block; NaN if the block has too few samples, or the signal is not recorded.
    pub fn mean(&self, block: usize) -> f64 {
        self.means
            .get(block)
            .map_or(f64::NAN, |mean| mean * self.factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_block_with_fewer_than_half_its_samples_has_no_mean() {
        let settings = Checks {
            block_s: 0.1,
            ..Checks::default()
        };
        let mut averager = BlockAverager::of(signal::Q, 0.025, &settings).unwrap();
        averager.push(&[1.0, f64::NAN, f64::NAN]);
        averager.push(&[f64::NAN, 1.0, f64::NAN, 3.0, f64::NAN, 7.0]);
        assert!(averager.means[0].is_nan());
        assert_relative_eq!(averager.means[1], 2.0);
        assert_eq!(averager.means.len(), 2);
    }
}
