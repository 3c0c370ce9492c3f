//! Limits of the cards.

use std::collections::BTreeMap;
use std::path::Path;

use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::flight_plan::candidate::candidates;
use crate::flight_plan::limits::{Extremes, broken};
use crate::lab::campaign::{FlightLimits, SimulatedCampaign};

/// A record at 10 Hz: α from 10 to 14 deg, 0.5 to 2 g, 90 to 100 psf, a surface that moves at 20 deg/s.
fn record() -> Record {
    let series = |values: [f64; 3]| Series {
        marks: vec![Mark::Measured; 3],
        values: values.to_vec(),
    };
    let signals = [
        (signal::ALPHA_VANE, [10.0, 14.0, 12.0]),
        (signal::AN, [1.0, 2.0, 0.5]),
        (signal::QBAR, [90.0, 95.0, 100.0]),
        ("elevator_deg", [0.0, -2.0, -2.0]),
    ];
    Record {
        flight_id: "f".into(),
        start_s: 0.0,
        step_s: 0.1,
        samples: 3,
        signals: signals
            .map(|(name, values)| (name.to_owned(), series(values)))
            .into(),
        remaining_errors: BTreeMap::new(),
    }
}

fn reason(limits: &FlightLimits) -> Option<String> {
    let record = record();
    broken(limits, &record, &Extremes::of(&record))
}

#[test]
fn each_limit_is_kept_on_both_sides() {
    let rate = |rate| FlightLimits {
        surface_rates_deg_s: BTreeMap::from([("elevator_deg".to_owned(), rate)]),
        ..FlightLimits::default()
    };
    let alpha = |low, high| FlightLimits {
        alpha_deg: Some((low, high)),
        ..FlightLimits::default()
    };
    let an = |low, high| FlightLimits {
        an_g: Some((low, high)),
        ..FlightLimits::default()
    };
    let qbar = |low, high| FlightLimits {
        qbar_psf: Some((low, high)),
        ..FlightLimits::default()
    };
    for kept in [
        FlightLimits::default(),
        rate(20.0),
        alpha(10.0, 14.0),
        an(0.5, 2.0),
        qbar(90.0, 100.0),
    ] {
        assert_eq!(reason(&kept), None, "{kept:?}");
    }
    let unknown = FlightLimits {
        surface_rates_deg_s: BTreeMap::from([("rudder_deg".to_owned(), 90.0)]),
        ..FlightLimits::default()
    };
    for (broken, said) in [
        (
            unknown,
            "`rudder_deg` has a limit of its rate, but the rehearsal records none",
        ),
        (
            rate(19.0),
            "`elevator_deg` moves at 20 deg/s; the limit is 19 deg/s",
        ),
        (
            alpha(10.0, 13.0),
            "alpha reaches 14.0 deg; the limit is 13 deg",
        ),
        (
            alpha(11.0, 20.0),
            "alpha reaches 10.0 deg; the limit is 11 deg",
        ),
        (
            an(0.5, 1.5),
            "normal acceleration reaches 2.0 g; the limit is 1.5 g",
        ),
        (
            an(0.6, 3.0),
            "normal acceleration reaches 0.5 g; the limit is 0.6 g",
        ),
        (
            qbar(0.0, 99.0),
            "dynamic pressure reaches 100.0 psf; the limit is 99 psf",
        ),
    ] {
        assert_eq!(reason(&broken).as_deref(), Some(said));
    }
}

#[test]
fn the_shipped_cards_keep_the_rates_of_all_surfaces() {
    let shipped = SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap();
    let rates = FlightLimits {
        surface_rates_deg_s: shipped.cards.next.limits.surface_rates_deg_s.clone(),
        ..FlightLimits::default()
    };
    let limited = rates.surface_rates_deg_s.keys();
    assert!(limited.eq(shipped.cards.aircraft.surfaces.keys()));
    let half = FlightLimits {
        surface_rates_deg_s: rates
            .surface_rates_deg_s
            .iter()
            .map(|(name, rate)| (name.clone(), 0.5 * rate))
            .collect(),
        ..FlightLimits::default()
    };
    let mut candidates = candidates(&shipped.cards, &shipped.config);
    candidates.retain(|own| [20.0, 40.0].contains(&own.card.alpha_deg));
    for candidate in candidates {
        let flown = shipped.simulator.fly(&candidate.card).unwrap();
        let extremes = Extremes::of(&flown.record);
        let found = |limits: &FlightLimits| broken(limits, &flown.record, &extremes);
        assert_eq!(found(&rates), None, "{:?}", candidate.card);
        assert!(found(&half).is_some(), "{:?}", candidate.card);
    }
}
