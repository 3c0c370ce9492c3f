//! Values that maneuvers hold, read from the posterior of the other flights.

use approx::{assert_abs_diff_eq, assert_relative_eq};

use super::fixture::{Flown, aero_model, at, diagonal, exact, posterior, tunnel};
use super::parts::{campaign, data, scales};
use crate::model::Settings;
use crate::model::fusion::other_flights::OtherFlights;
use crate::model::fusion::posterior::{gaussian, information};
use crate::numerics::linear_algebra::root::EXACT;
use crate::output_error::error_effect::SharedError;
use crate::tables::EstimateRow;

/// CN_alpha by a maneuver that held CN_q and took 0.01 of each of its units for CN_alpha.
fn holding(id: &str, flight: &str) -> Flown {
    let covariance = diagonal([0.002]);
    let mut flown = Flown::new(id, flight, 20.0, &[("CN_alpha", 0.08)], &covariance).with(
        SharedError::Held("CN_q".into()),
        0.8,
        &[0.01 * 0.8],
    );
    let row = &mut flown.estimates[1];
    (row.bound, row.bound_held) = (Some(0.002f64.hypot(0.008)), Some(0.008));
    row.bound_corrected = Some(0.003f64.hypot(0.008));
    flown
}

fn estimating(id: &str, flight: &str, value: f64) -> Flown {
    Flown::new(id, flight, 20.0, &[("CN_q", value)], &diagonal([0.1]))
}

/// Rows of the first maneuver of a campaign.
fn rows(flown: &[Flown]) -> Vec<EstimateRow> {
    let model = posterior(flown, &tunnel(None), &exact());
    let evidence = flown[0].evidence();
    let with = model.with_held(&evidence);
    let own = flown[0].estimates.iter();
    own.map(|row| with.row(row, &aero_model().combined))
        .collect()
}

#[test]
fn the_other_flights_are_as_if_one_s_own_had_not_been_there() {
    let flown = campaign();
    let (terms, data) = data(&flown, &Settings::default());
    let weights = vec![1.0; flown.len()];
    let root = data.unknowns.root(&terms, &scales(), EXACT);
    let of = |flights: &[_]| gaussian(&root, &information(flights, &weights, data.unknowns.count));
    let whole = of(&data.flights).unwrap();
    let mut others = data.flights.clone();
    let own = others.remove(1);
    let rest = of(&others).unwrap();
    let asked = vec![vec![(0, 1.0), (4, -0.5)], vec![(7, 2.0)]];
    let without = OtherFlights::new(&rest, None, &weights)
        .unwrap()
        .means_and_covariance(&asked);
    let left = OtherFlights::new(&whole, Some(&own), &weights)
        .unwrap()
        .means_and_covariance(&asked);
    assert_relative_eq!(left.0, without.0, epsilon = 1e-9);
    assert_relative_eq!(left.1, without.1, epsilon = 1e-9);
}

#[test]
fn an_estimate_moves_by_the_other_flights_differences_of_its_held_values() {
    let flown = [holding("a", "f"), estimating("b", "g", 9.0)];
    let others = posterior(&flown[1..], &tunnel(None), &exact());
    let (value, deviation) = at(&others, "CN_q", 20.0);
    let [slope, rate] = &rows(&flown)[1..] else {
        panic!("two rows")
    };
    // Scales of the whole campaign are almost those of the others: the first has little information
    // on CN_q.
    assert_relative_eq!(rate.value.unwrap(), value, max_relative = 1e-3);
    let moved = 0.08 - 0.01 * (rate.value.unwrap() - rate.wind_tunnel.unwrap());
    assert_relative_eq!(slope.value.unwrap(), moved, max_relative = 1e-12);
    let held = slope.bound_held.unwrap();
    assert_relative_eq!(held, 0.01 * deviation, max_relative = 1e-2);
    assert_relative_eq!(
        slope.bound.unwrap(),
        0.002f64.hypot(held),
        max_relative = 1e-9
    );
    assert_relative_eq!(
        slope.bound_corrected.unwrap(),
        0.003f64.hypot(held),
        max_relative = 1e-9
    );
}

#[test]
fn a_flight_does_not_change_what_its_own_maneuvers_hold() {
    // Another maneuver of the flight determines CN_q; no other flight does.
    let own = rows(&[holding("a", "f"), estimating("b", "f", 9.0)]);
    assert_relative_eq!(
        own[2].value.unwrap(),
        own[2].wind_tunnel.unwrap(),
        max_relative = 1e-6
    );
    assert_abs_diff_eq!(own[1].value.unwrap(), 0.08, epsilon = 1e-6);
}
