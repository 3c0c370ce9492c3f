//! The next flight as written in the cards: candidates of `harvest next`, their price and their limits.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::test_point::TestPoint;

/// Conditions of the next flight. Default: the test points of the flights, without limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NextFlight {
    /// Altitude of the cards; if not given, that of each test point's flight.
    pub altitude_ft: Option<f64>,
    /// Mass at the cards; if not given, that of each test point's flight.
    pub mass_slug: Option<f64>,
    /// Time to trim before a card and to recover after it.
    pub settle_s: f64,
    /// Time to change the angle of attack by one degree.
    pub change_s_per_deg: f64,
    /// Largest number of times that one card is flown.
    pub repeats: usize,
    pub limits: FlightLimits,
    /// Candidates in place of the flights' test points.
    pub candidates: Vec<TestPoint>,
}

impl Default for NextFlight {
    fn default() -> Self {
        NextFlight {
            altitude_ft: None,
            mass_slug: None,
            settle_s: 30.0,
            change_s_per_deg: 1.0,
            repeats: 2,
            limits: FlightLimits::default(),
            candidates: vec![],
        }
    }
}

/// Limits that a card keeps from its start to its end; each is a lowest and a highest value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlightLimits {
    /// Angle of attack, as the vane reads it.
    pub alpha_deg: Option<(f64, f64)>,
    /// Normal acceleration at its sensor.
    pub an_g: Option<(f64, f64)>,
    pub qbar_psf: Option<(f64, f64)>,
    /// Highest rate of each surface, by signal, deg/s.
    pub surface_rates_deg_s: BTreeMap<String, f64>,
}
