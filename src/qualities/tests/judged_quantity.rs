//! Quantities as linear functions of the derivatives, and the limits between their levels.

use approx::assert_relative_eq;

use super::fixture::{linear, posterior, specification};
use crate::aero::Axis;
use crate::model::LocalPosterior;
use crate::qualities::judged_quantity::at_mean;
use crate::tables::FlyingQuality;

fn value(axis: Axis, posterior: &LocalPosterior, quantity: FlyingQuality) -> f64 {
    let linear = linear(axis, posterior);
    let own = at_mean(axis, &linear, posterior, &specification(), quantity);
    own.unwrap().value
}

#[test]
fn its_slopes_are_those_of_differences() {
    for (axis, quantity) in [
        (Axis::Longitudinal, FlyingQuality::ControlAnticipation),
        (Axis::Longitudinal, FlyingQuality::PhugoidDamping),
        (Axis::Lateral, FlyingQuality::DutchRollDamping),
        (Axis::Lateral, FlyingQuality::RollTimeConstant),
    ] {
        let about = posterior(axis, 0.1);
        let linear = linear(axis, &about);
        let own = at_mean(axis, &linear, &about, &specification(), quantity);
        let slopes = own.unwrap().slopes;
        assert_eq!(slopes.len(), about.values.len());
        for (i, (named, slope)) in slopes.iter().enumerate() {
            assert_eq!(named, &about.values[i]);
            let step = 1e-5 * about.mean[i].abs().max(1e-3);
            let moved = |by: f64| {
                let mut moved = about.clone();
                moved.mean[i] += by;
                value(axis, &moved, quantity)
            };
            let difference = (moved(step) - moved(-step)) / (2.0 * step);
            assert_relative_eq!(*slope, difference, max_relative = 1e-4, epsilon = 1e-7);
        }
    }
}

#[test]
fn its_limits_are_where_the_level_changes() {
    let limits = |axis, quantity| {
        let about = posterior(axis, 0.1);
        let linear = linear(axis, &about);
        let own = at_mean(axis, &linear, &about, &specification(), quantity);
        own.unwrap().limits
    };
    // Category A: Level 1 from 0.28 to 3.6, Level 2 from 0.16 to 10, Level 3 from 0.16.
    let found = limits(Axis::Longitudinal, FlyingQuality::ControlAnticipation);
    assert_eq!(found, [0.16, 0.28, 3.6, 10.0]);
    // Level 3 has no limit of its own.
    let found = limits(Axis::Longitudinal, FlyingQuality::PhugoidDamping);
    assert_eq!(found, [0.0, 0.04]);
    // Levels 2 and 3 have the same.
    assert_eq!(
        limits(Axis::Lateral, FlyingQuality::DutchRollFrequency),
        [0.4, 1.0]
    );
}

#[test]
fn a_limit_rises_with_the_mean_of_another_quantity() {
    let about = posterior(Axis::Lateral, 0.1);
    let bank = value(Axis::Lateral, &about, FlyingQuality::DutchRollBank);
    let mut judged = specification();
    let limits = judged.requirements.iter_mut().flat_map(|r| &mut r.limits);
    for limit in limits {
        if let Some(raised) = &mut limit.raised {
            raised.above = 0.5 * bank;
        }
    }
    let linear = linear(Axis::Lateral, &about);
    let decay = FlyingQuality::DutchRollDecay;
    let own = at_mean(Axis::Lateral, &linear, &about, &judged, decay);
    let limits = own.unwrap().limits;
    // Category A: 0.35 and 0.05, with rises of 0.014, 0.009 and 0.005; that of Level 3 starts from zero.
    let rise = |per_unit: f64| per_unit * 0.5 * bank;
    let expected = [rise(0.005), 0.05 + rise(0.009), 0.35 + rise(0.014)];
    assert_eq!(limits.len(), expected.len());
    for (found, expected) in limits.iter().zip(expected) {
        assert_relative_eq!(*found, expected, max_relative = 1e-12);
    }
}
