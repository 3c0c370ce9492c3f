//! Chance that a flight decides, against flights whose data are drawn.

use approx::{assert_relative_eq, relative_eq};

use crate::flight_plan::choice::Aim;
use crate::flight_plan::decision::Decision;
use crate::flight_plan::goal_points::Target;
use crate::numerics::statistics::random::RandomStream;

fn decision(mean: f64, limits: &[f64], rest: f64) -> Decision {
    Decision {
        mean,
        limits: limits.to_vec(),
        fixed_deviation: rest,
        required_probability: 0.9,
        follows_mean: false,
    }
}

/// Goals with one limit, with several, and with a part that no flight lowers.
fn decisions() -> Vec<Decision> {
    vec![
        decision(0.3, &[0.0], 0.0),
        decision(0.0, &[0.0], 0.0),
        decision(1.2, &[-1.0, 0.6, 3.0], 0.0),
        decision(-0.5, &[-1.0, 1.0], 0.25),
    ]
}

/// Share of simulated flights that decide. The data z = g + e have the noise by which the posterior's
/// standard deviation falls from 1 to `after`: 1/after² = 1 + 1/var(e).
fn simulated(decision: &Decision, after: f64) -> f64 {
    const FLIGHTS: usize = 40_000;
    let mut random = RandomStream::new(3, "flights");
    let noise = (after * after / (1.0 - after * after)).sqrt();
    let mut decided = 0;
    for _ in 0..FLIGHTS {
        let truth = decision.mean + random.normal();
        let read = truth + noise * random.normal();
        let tomorrow = Decision {
            mean: decision.mean + (1.0 - after * after) * (read - decision.mean),
            ..decision.clone()
        };
        let (_, probability) = tomorrow.most_probable(after);
        decided += usize::from(probability >= decision.required_probability);
    }
    decided as f64 / FLIGHTS as f64
}

#[test]
fn the_chance_of_a_decision_is_that_of_simulated_flights() {
    for decision in decisions() {
        for after in [0.2, 0.5, 0.8] {
            let (found, expected) = (
                decision.probability_of_decision(1.0, after),
                simulated(&decision, after),
            );
            // Three standard errors of 40,000 flights.
            assert!(
                relative_eq!(found, expected, epsilon = 0.0075),
                "{decision:?} {after}: {found} for {expected}"
            );
        }
    }
}

#[test]
fn with_one_limit_the_chance_has_the_closed_form() {
    // d = 0.3, z of 90 % = 1.281552, σ′ = 0.5, τ = 0.866025: Φ(-0.393492) + Φ(-1.086312).
    let found = decision(0.3, &[0.0], 0.0).probability_of_decision(1.0, 0.5);
    assert_relative_eq!(found, 0.346_978 + 0.138_671, epsilon = 2e-5);
}

#[test]
fn the_wanted_deviation_decides_with_the_stated_probability() {
    for decision in decisions().into_iter().take(3) {
        assert!(decision.is_open(1.0));
        let wanted = decision.largest_deciding_deviation(1.0);
        assert!(wanted > 0.0 && wanted < 1.0, "{decision:?}: {wanted}");
        assert_relative_eq!(
            decision.probability_of_decision(1.0, wanted),
            0.9,
            epsilon = 1e-6
        );
    }
}

#[test]
fn a_decided_goal_and_one_that_no_flight_decides_are_worth_nothing() {
    let decided = decision(3.0, &[0.0], 0.0);
    // Between two limits closer than the part that no flight lowers; below and above are improbable.
    let follows = Decision {
        follows_mean: true,
        ..decision(0.0, &[-1.0, 1.0], 2.0)
    };
    for decision in [decided, follows] {
        assert!(!decision.is_open(1.0));
        let aim = Aim {
            parts: vec![],
            weight: 1.0,
            wanted: Target::Decision(decision).wanted(1.0),
            point: 0,
        };
        for after in [0.9, 0.5, 0.01] {
            assert_relative_eq!(aim.worth(1.0, after * after), 0.0);
        }
    }
}

#[test]
fn limits_that_follow_the_mean_are_reached_for_certain() {
    // Φ(w/s) − Φ(−w/s) = 0.9 at w = 1.644854 s, with s² = σ′² + 0.09.
    let own = Decision {
        follows_mean: true,
        ..decision(0.0, &[-1.0, 1.0], 0.3)
    };
    let wanted = (1.0f64 / 1.644_854).powi(2) - 0.09;
    assert_relative_eq!(
        own.largest_deciding_deviation(1.0),
        wanted.sqrt(),
        max_relative = 1e-6
    );
    assert_relative_eq!(own.probability_of_decision(1.0, 0.99 * wanted.sqrt()), 1.0);
    assert_relative_eq!(own.probability_of_decision(1.0, 1.01 * wanted.sqrt()), 0.0);
}
