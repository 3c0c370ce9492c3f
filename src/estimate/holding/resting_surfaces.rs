//! Surfaces at rest in a maneuver. The maneuver has no information on their derivatives, which are
//! inactive in it.
//!
//! A class lists the surfaces that its maneuvers excite. If one of them rests nevertheless, its
//! derivatives are not identifiable: they cannot be separated from the constants.

use std::collections::BTreeSet;

use crate::estimate::settings::Hold;
use crate::estimate::task::Task;
use crate::flight::signal;
use crate::maneuver::{Class, Status};
use crate::output_error::identifiability::excitation;

/// Largest ratio, for a surface at rest, of its rms about the mean to its noise, which the
/// differences of successive samples give. At rest both are the noise of the transducer.
const AT_REST: f64 = 1.5;

/// Largest noise of a transducer, deg rms. Inputs of 2 Hz, recorded at 10 Hz, differ from sample to sample as
/// noise does, but are larger.
const LARGEST_NOISE: f64 = 0.2;

/// The class without the derivatives of surfaces that rest, and the names of these. With `hold: evidence`
/// the maneuver's evidence decides instead.
pub(super) fn class_of_moving_surfaces(task: &Task) -> (Class, BTreeSet<String>) {
    let resting = match task.context.settings.hold {
        Hold::Table => derivatives_at_rest(task),
        Hold::Evidence => BTreeSet::new(),
    };
    let class = task.class.with_status(&resting, Status::Inactive);
    (class, resting)
}

/// Derivatives to be estimated whose surfaces rest.
fn derivatives_at_rest(task: &Task) -> BTreeSet<String> {
    let derivatives = task.context.aero_model.derivatives_of(task.class.axis);
    let at_rest = derivatives.filter(|derivative| {
        let mut signals = derivative.regressor.signals();
        task.status(&derivative.name) == Some(Status::Estimated)
            && signals.any(|name| !signal::OF_THE_FLOW.contains(&name) && is_at_rest(task, name))
    });
    at_rest.map(|derivative| derivative.name.clone()).collect()
}

/// `true` for a signal that shows no more than noise in the maneuver.
fn is_at_rest(task: &Task, name: &str) -> bool {
    let samples = task.record.values(name).and_then(|v| v.get(task.range()));
    samples.is_some_and(is_noise)
}

/// `true` if samples show no motion. Their scatter about the mean is then small, and no larger than
/// that of white noise with the same differences from sample to sample.
fn is_noise(samples: &[f64]) -> bool {
    let steps = samples.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
    let count = samples.len().saturating_sub(1).max(1) as f64;
    let noise = (0.5 * steps.sum::<f64>() / count).sqrt();
    let excitation = excitation(samples);
    excitation <= LARGEST_NOISE && excitation <= AT_REST * noise
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::statistics::random::RandomStream;

    /// Ten seconds of a transducer with noise of 0.02 deg, of a surface with a doublet of this size.
    fn transducer(doublet_deg: f64) -> Vec<f64> {
        let mut stream = RandomStream::new(7, "a surface");
        let surface = |k: usize| match k {
            100..=139 => doublet_deg,
            140..=179 => -doublet_deg,
            _ => 0.0,
        };
        (0..400)
            .map(|k| 3.0 + surface(k) + 0.02 * stream.normal())
            .collect()
    }

    #[test]
    fn a_surface_rests_where_its_samples_are_noise() {
        assert!(is_noise(&transducer(0.0)));
        assert!(is_noise(&[2.5; 400]));
        assert!(!is_noise(&transducer(0.2)));
        assert!(!is_noise(&transducer(5.0)));
    }

    #[test]
    fn a_quick_sweep_on_a_slow_recorder_moves() {
        let sweep = (0..100).map(|k| (2.0 * std::f64::consts::TAU * 0.1 * f64::from(k)).sin());
        assert!(!is_noise(&sweep.collect::<Vec<f64>>()));
    }

    #[test]
    fn a_surface_that_drifts_slowly_moves() {
        let drift = transducer(0.0).into_iter().enumerate();
        let drift: Vec<f64> = drift.map(|(k, v)| v + 0.001 * k as f64).collect();
        assert!(!is_noise(&drift));
    }
}
