//! A maneuver as found in a record, or as given by the analyst.

use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Condition, WindTunnel};

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

impl Maneuver {
    /// Where a tunnel is read for this maneuver: its means, as far as the tunnel's third variable is among them.
    #[must_use]
    pub fn condition(&self, tunnel: &WindTunnel) -> Condition {
        let third = tunnel.settings().third.as_ref().and_then(|third| match third.name.as_str() {
            "altitude_ft" => Some(self.altitude_ft),
            "qbar_psf" => Some(self.qbar_psf),
            "velocity_ft_s" => Some(self.velocity_ft_s),
            "mass_slug" => Some(self.mass_slug),
            "x_cg_ft" => Some(self.x_cg_ft),
            _ => None,
        });
        Condition { alpha_deg: self.alpha_deg, mach: self.mach, third: third.filter(|v| v.is_finite()) }
    }
}
