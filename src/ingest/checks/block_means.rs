//! Means of the channels over short blocks, from which the kinematic relations are computed.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::flight::{Correction, signal};
use crate::ingest::atmosphere::atmosphere;
use crate::ingest::sample_count::whole_steps;
use crate::ingest::settings::Checks;

/// The signals that the relations use.
const USED: &[&str] = &[
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::VELOCITY,
    signal::MACH,
    signal::ALTITUDE,
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
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// Averages a signal over short blocks as its samples come by; a block with fewer than half of its
/// samples is NaN.
#[derive(Clone, Debug)]
pub struct BlockAverager {
    length: usize,
    sum: f64,
    known: usize,
    seen: usize,
    means: Vec<f64>,
}

impl BlockAverager {
    /// For a signal that a relation uses; none for the others.
    #[must_use]
    pub fn of(signal: &str, step_s: f64, settings: &Checks) -> Option<BlockAverager> {
        let length = block_length(step_s, settings);
        USED.contains(&signal).then(|| BlockAverager {
            length,
            sum: 0.0,
            known: 0,
            seen: 0,
            means: Vec::new(),
        })
    }

    /// The next samples.
    pub fn push(&mut self, values: &[f64]) {
        let mut values = values;
        while !values.is_empty() {
            let (now, later) = values.split_at(values.len().min(self.length - self.seen));
            for value in now.iter().filter(|v| v.is_finite()) {
                self.sum += value;
                self.known += 1;
            }
            self.seen += now.len();
            values = later;
            if self.seen == self.length {
                let mean = if 2 * self.known >= self.length {
                    self.sum / self.known as f64
                } else {
                    f64::NAN
                };
                self.means.push(mean);
                (self.sum, self.known, self.seen) = (0.0, 0, 0);
            }
        }
    }

    /// The same for a signal that is one value throughout.
    #[must_use]
    pub fn constant(
        signal: &str,
        value: f64,
        samples: usize,
        step_s: f64,
        settings: &Checks,
    ) -> Option<BlockAverager> {
        let mut averaging = BlockAverager::of(signal, step_s, settings)?;
        averaging.means = vec![value; samples / averaging.length];
        Some(averaging)
    }
}

fn block_length(step_s: f64, settings: &Checks) -> usize {
    whole_steps(settings.block_s, step_s).max(1)
}

/// The signals averaged over short blocks.
#[derive(Clone, Debug)]
pub struct BlockMeans {
    pub block_s: f64,
    pub count: usize,
    /// With the factor that a trial multiplies a signal by.
    values: BTreeMap<&'static str, (Arc<Vec<f64>>, f64)>,
}

impl BlockMeans {
    /// Of signals averaged over all samples of a record.
    #[must_use]
    pub fn of(
        averaged: BTreeMap<String, BlockAverager>,
        samples: usize,
        step_s: f64,
        settings: &Checks,
    ) -> BlockMeans {
        let length = block_length(step_s, settings);
        let mut averaged = averaged;
        let mut value =
            |name: &&'static str| Some((*name, (Arc::new(averaged.remove(*name)?.means), 1.0)));
        let values = USED.iter().filter_map(&mut value).collect();
        BlockMeans {
            block_s: length as f64 * step_s,
            count: samples / length,
            values,
        }
    }

    pub fn has(&self, signal: &str) -> bool {
        self.values.contains_key(signal)
    }

    /// Whether a signal never changes: a dead sensor's does not, noise makes every other's.
    pub fn still(&self, signal: &str) -> bool {
        let means = self.values.get(signal).map(|(means, _)| means.iter());
        let mut known = means.into_iter().flatten().filter(|v| v.is_finite());
        known
            .next()
            .is_none_or(|first| known.all(|v| (v - first).abs() <= 1e-9 * first.abs()))
    }

    /// Whether airspeed, dynamic pressure or Mach number say for most of the record that the
    /// aircraft is faster than this, ft/s. One of them may be dead.
    pub fn flies(&self, faster_ft_s: f64) -> bool {
        // Of this velocity at sea level: higher up it takes more of it.
        let (density, sound) = atmosphere(0.0);
        let pressure = 0.5 * density * faster_ft_s * faster_ft_s;
        let levels = [
            (signal::VELOCITY, faster_ft_s),
            (signal::QBAR, pressure),
            (signal::MACH, faster_ft_s / sound),
        ];
        let mostly = |(signal, level): (&str, f64)| {
            let known = || {
                (0..self.count)
                    .map(|k| self.at(signal, k))
                    .filter(|v| v.is_finite())
            };
            2 * known().filter(|v| v.abs() > level).count() > known().count()
        };
        levels.into_iter().any(mostly)
    }

    /// These blocks with one signal multiplied: what the record would say if that channel were
    /// wrong by the factor.
    pub fn with(&self, signal: &str, factor: f64) -> BlockMeans {
        let mut changed = self.clone();
        if let Some((_, own)) = changed.values.get_mut(signal) {
            *own *= factor;
        }
        changed
    }

    /// These blocks with signals corrected.
    pub fn corrected(&self, corrections: &[Correction]) -> BlockMeans {
        let mut changed = self.clone();
        for correction in corrections {
            if let Some((means, _)) = changed.values.get_mut(correction.signal.as_str()) {
                *means = Arc::new(correction.of_values(means, self.block_s));
            }
        }
        changed
    }

    pub fn at(&self, signal: &str, block: usize) -> f64 {
        let value = self
            .values
            .get(signal)
            .and_then(|(means, factor)| Some(means.get(block)? * factor));
        value.unwrap_or(f64::NAN)
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
        let mut averaging = BlockAverager::of(signal::Q, 0.025, &settings).unwrap();
        averaging.push(&[1.0, f64::NAN, f64::NAN]);
        averaging.push(&[f64::NAN, 1.0, f64::NAN, 3.0, f64::NAN, 7.0]);
        assert!(averaging.means[0].is_nan());
        assert_relative_eq!(averaging.means[1], 2.0);
        assert_eq!(averaging.means.len(), 2);
    }
}
