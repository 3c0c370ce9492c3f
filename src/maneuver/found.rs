//! A maneuver as found in a record, or as given by the analyst.

use serde::{Deserialize, Serialize};

use crate::aero::Axis;

/// One line of the analyst's list of events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    pub flight_id: String,
    pub class: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// One maneuver: its window in the record and its mean flight condition. A row of the `maneuvers` table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Maneuver {
    pub maneuver_id: String,
    pub flight_id: String,
    pub class: String,
    pub axis: Axis,
    /// On the record's own clock.
    pub start_s: f64,
    pub end_s: f64,
    /// Mean angle of attack at the c.g.
    pub alpha_deg: f64,
    pub mach: f64,
    pub qbar_psf: f64,
    pub velocity_ft_s: f64,
    pub altitude_ft: f64,
    pub mass_slug: f64,
    pub x_cg_ft: f64,
    pub samples: usize,
    /// `found` in the record or `given` by the analyst.
    pub origin: String,
}
