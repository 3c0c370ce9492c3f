//! Quantities as linear functions of the derivatives, and the limits between their levels.

use approx::assert_relative_eq;

use super::fixture::{linear, posterior, specification};
use crate::aero::Axis;
use crate::model::LocalPosterior;
use crate::qualities::judged_quantity::at_mean;
use crate::tables::Quantity;

fn value(axis: Axis, posterior: &LocalPosterior, quantity: Quantity) -> f64 {
    let linear = linear(axis, posterior);
    let judged = (&specification(), quantity);
    at_mean(axis, &linear, posterior, judged).unwrap().0
}

#[test]
fn its_slopes_are_those_of_differences() {
    for (axis, quantity) in [
        (Axis::Longitudinal, Quantity::ControlAnticipation),
        (Axis::Longitudinal, Quantity::PhugoidDamping),
        (Axis::Lateral, Quantity::DutchRollDamping),
        (Axis::Lateral, Quantity::RollTimeConstant),
    ] {
        let about = posterior(axis, 0.1);
        let judged = (&specification(), quantity);
        let (_, slopes, _) = at_mean(axis, &linear(axis, &about), &about, judged).unwrap();
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
        let judged = (&specification(), quantity);
        at_mean(axis, &linear(axis, &about), &about, judged)
            .unwrap()
            .2
    };
    // Category A: Level 1 from 0.28 to 3.6, Level 2 from 0.16 to 10, Level 3 from 0.16.
    let found = limits(Axis::Longitudinal, Quantity::ControlAnticipation);
    assert_eq!(found, [0.16, 0.28, 3.6, 10.0]);
    // Level 3 has no limit of its own.
    let found = limits(Axis::Longitudinal, Quantity::PhugoidDamping);
    assert_eq!(found, [0.0, 0.04]);
    // Levels 2 and 3 have the same.
    assert_eq!(
        limits(Axis::Lateral, Quantity::DutchRollFrequency),
        [0.4, 1.0]
    );
}

#[test]
fn a_limit_rises_with_the_mean_of_another_quantity() {
    let about = posterior(Axis::Lateral, 0.1);
    let bank = value(Axis::Lateral, &about, Quantity::DutchRollBank);
    let mut judged = specification();
    let limits = judged.requirements.iter_mut().flat_map(|r| &mut r.limits);
    for limit in limits {
        if let Some(raised) = &mut limit.raised {
            raised.above = 0.5 * bank;
        }
    }
    let judged = (&judged, Quantity::DutchRollDecay);
    let linear = linear(Axis::Lateral, &about);
    let (.., limits) = at_mean(Axis::Lateral, &linear, &about, judged).unwrap();
    // Category A: 0.35 and 0.05, with rises of 0.014, 0.009 and 0.005; Level 3 has no minimum.
    let expected = [0.05 + 0.009 * 0.5 * bank, 0.35 + 0.014 * 0.5 * bank];
    assert_eq!(limits.len(), 2);
    for (found, expected) in limits.iter().zip(expected) {
        assert_relative_eq!(*found, expected, max_relative = 1e-12);
    }
}
