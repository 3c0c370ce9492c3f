//! A maneuver as found in a record, or as given by the analyst.

use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Condition, WindTunnel};
use crate::schema::words;

/// One line of the analyst's list of events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    pub flight_id: String,
    pub class: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// One maneuver: its window in the record and its mean flight condition. A row of the `maneuvers`
/// table.
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
    pub origin: ManeuverOrigin,
    pub recognised: Recognised,
    pub quality: Quality,
}

impl Maneuver {
    /// Whether it should not be estimated.
    #[must_use]
    pub fn is_rejected(&self) -> bool {
        self.quality.verdict == Acceptance::Rejected
    }
}

/// What a maneuver was recognised by; nothing of it where the analyst gave the maneuver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recognised {
    pub first_input_s: Option<f64>,
    pub last_input_s: Option<f64>,
    /// Signals that moved on their own, with how often they stepped: `de_deg 5`.
    pub inputs: String,
    /// Signals that stepped with them, by gearing or feedback.
    pub followed: String,
    /// From 0 to 1: how much of what could speak for the class does.
    pub confidence: Option<f64>,
    /// What speaks for the class and what against it, in words.
    pub evidence: String,
}

words! {
    /// Origin of a maneuver.
    pub enum ManeuverOrigin {
        /// Recognised in the record.
        Found = "found",
        /// Given in the analyst's list of events.
        Given = "given",
        /// Mean of maneuvers that are estimated together; not in the table `maneuvers`.
        Joint = "joint",
        /// Flown by the simulator; not in the table `maneuvers`.
        Flown = "flown",
    }
}

words! {
    /// Verdict on a maneuver's quality.
    pub enum Acceptance {
        /// The maneuver is estimated. The analyst's own maneuvers always are.
        Accepted = "accepted",
        /// The maneuver is not estimated; the reason names the limits that it exceeds.
        Rejected = "rejected",
    }
}

impl Default for Acceptance {
    fn default() -> Acceptance {
        Acceptance::Accepted
    }
}

/// What a maneuver is worth before it is estimated; a measure that could not be taken does not
/// exist.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    pub verdict: Acceptance,
    /// Every limit that it is beyond, in words.
    pub reason: String,
    /// Angular rates of its axis in the lead-in over those in the maneuver, both root mean square
    /// about a straight line.
    pub lead_in_motion: Option<f64>,
    /// Root mean square of the angle of attack about its mean, deg.
    pub alpha_rms_deg: Option<f64>,
    /// Angular rates of the other axis over those of its own, both root mean square about a
    /// straight line.
    pub other_axis: Option<f64>,
    /// Angular rates of its axis, root mean square, over their noise from sample to sample; the
    /// best of them.
    pub signal_to_noise: Option<f64>,
    /// Share of the time of the inputs in which a surface rests at a stop; the surface that does so
    /// most.
    pub saturated_share: Option<f64>,
    /// Share of the time of the inputs in which a surface moves as fast as its actuator can; the
    /// surface that does so most.
    pub rate_limited_share: Option<f64>,
    /// Share of samples of its outputs and inputs that are not as recorded.
    pub marked_share: Option<f64>,
}

/// Excitation that fits no class. A row of the `unknown` table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    pub flight_id: String,
    /// First and last input, s on the record's own clock.
    pub start_s: f64,
    pub end_s: f64,
    /// What stepped and how often: `de_deg 5, dpv_deg 1`.
    pub inputs: String,
    /// The class that it comes nearest to.
    pub nearest_class: String,
    /// What keeps it from being of that class.
    pub reason: String,
}

impl Maneuver {
    /// Where a tunnel is read for this maneuver: its means, as far as the tunnel's third variable
    /// is among them.
    #[must_use]
    pub fn condition(&self, tunnel: &WindTunnel) -> Condition {
        let third = tunnel
            .settings()
            .third
            .as_ref()
            .and_then(|third| match third.name.as_str() {
                "altitude_ft" => Some(self.altitude_ft),
                "qbar_psf" => Some(self.qbar_psf),
                "velocity_ft_s" => Some(self.velocity_ft_s),
                "mass_slug" => Some(self.mass_slug),
                "x_cg_ft" => Some(self.x_cg_ft),
                _ => None,
            });
        Condition {
            alpha_deg: self.alpha_deg,
            mach: self.mach,
            third: third.filter(|v| v.is_finite()),
        }
    }
}
