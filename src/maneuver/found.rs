//! A maneuver as found in a record, or as given by the analyst.

use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Condition, WindTunnel};
use crate::flight::signal;
use crate::schema::{table, words};

/// One line of the analyst's list of events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    pub flight_id: String,
    pub class: String,
    pub start_s: f64,
    pub end_s: f64,
}

table! {
    /// Maneuvers, with their mean flight condition and quality.
    ///
    /// Times are seconds on the record's own clock. The quality measures have limits, which are
    /// settings: `segment: quality:`. A measure that could not be taken is empty.
    pub struct Maneuver in "maneuvers" per "maneuver" {
        /// Flight, and start in whole seconds: `flight_001_t00118`. The second maneuver that begins in
        /// that second is `flight_001_t00118.2`.
        pub maneuver_id: String,
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Set of equations.
        pub axis: Axis,
        /// Start: about a second of trimmed flight before the inputs. Maneuvers close together
        /// share the pause between them (`segment: expert: shared_lead_in:`).
        pub start_s: f64 ["s"],
        /// End, after the decay of the response or where the pilot takes over.
        pub end_s: f64 ["s"],
        /// Mean angle of attack at the c.g., from the vanes.
        pub alpha_deg: f64 ["deg"],
        /// Mean Mach number.
        pub mach: f64 ["1"],
        /// Mean dynamic pressure.
        pub qbar_psf: f64 ["lbf/ft²"],
        /// Mean true airspeed.
        pub velocity_ft_s: f64 ["ft/s"],
        /// Mean altitude.
        pub altitude_ft: f64 ["ft"],
        /// Mean mass.
        pub mass_slug: f64 ["slug"],
        /// Mean position of the c.g.
        pub x_cg_ft: f64 ["ft"],
        /// Number of samples on the record's clock.
        pub samples: usize ["samples"],
        /// Origin of the maneuver; the columns from `confidence` to `evidence` are empty for a given
        /// one.
        pub origin: ManeuverOrigin,
        /// Basis of the recognition.
        pub recognised: Recognised,
        /// Quality before the estimation.
        pub quality: Quality,
    }
}

impl Maneuver {
    /// `true` for a maneuver that is not estimated.
    #[must_use]
    pub fn is_rejected(&self) -> bool {
        self.quality.verdict == Acceptance::Rejected
    }

    /// Longitudinal maneuver of class `A` in flight `f`, for tests.
    #[cfg(test)]
    #[must_use]
    pub fn example(id: &str, alpha_deg: f64) -> Maneuver {
        Maneuver {
            maneuver_id: id.into(),
            flight_id: "f".into(),
            class: "A".into(),
            axis: Axis::Longitudinal,
            start_s: 0.0,
            end_s: 10.0,
            alpha_deg,
            mach: 0.3,
            qbar_psf: 52.0,
            velocity_ft_s: 320.0,
            altitude_ft: 25_000.0,
            mass_slug: 1050.0,
            x_cg_ft: 38.0,
            samples: 401,
            origin: ManeuverOrigin::Found,
            recognised: Recognised::default(),
            quality: Quality::default(),
        }
    }
}

table! {
    /// Columns of `maneuvers` about the recognition.
    #[derive(Default)]
    pub struct Recognised {
        /// Confidence from 0 to 1, a product of factors: 0.8 for each flag that contradicts the
        /// class (it may be stuck); 0.95 for each flag that is not recorded; 0.9 for each signal of
        /// `moves` whose motion is unclear; 0.5 to 1 for the fit of the pulses' lengths; 0.9 for a
        /// record without pilot controls.
        pub confidence: Option<f64> ["1"],
        /// Time of the first step of the inputs.
        pub first_input_s: Option<f64> ["s"],
        /// Time of the last step of the inputs.
        pub last_input_s: Option<f64> ["s"],
        /// Signals that moved on their own, with their number of steps: `de_deg 5`.
        pub inputs: String,
        /// Signals that stepped with them, by gearing or feedback.
        pub followed: String,
        /// Evidence in words: flags, vanes, the unit of pulses; the penalties of the cut.
        pub evidence: String,
    }
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
    pub enum Acceptance default Accepted {
        /// The maneuver is estimated. The analyst's own maneuvers always are.
        Accepted = "accepted",
        /// The maneuver is not estimated; the reason names the limits that it exceeds.
        Rejected = "rejected",
    }
}

table! {
    /// Columns of `maneuvers` about the quality.
    #[derive(Default)]
    pub struct Quality {
        /// Verdict on the quality.
        pub verdict: Acceptance,
        /// Limits that the maneuver exceeds, in words.
        pub reason: String,
        /// Angular rates of the maneuver's axis before the first input over those in the whole
        /// maneuver, root mean squares; large if the maneuver does not start trimmed.
        pub lead_in_motion: Option<f64> ["1"],
        /// Root mean square of the angle of attack about its mean.
        pub alpha_rms_deg: Option<f64> ["deg"],
        /// Angular accelerations due to the motion of the other axis, by the products of rates in
        /// Euler's equations, over all angular accelerations of the maneuver's axis; root mean
        /// squares about their means.
        pub other_axis: Option<f64> ["1"],
        /// Root mean square of the axis's angular rate over its noise from sample to sample; the
        /// better one of roll and yaw.
        pub signal_to_noise: Option<f64> ["1"],
        /// Share of the inputs' time in which a surface rests at its stop; the worst surface. None
        /// where no actuator is configured.
        pub saturated_share: Option<f64> ["1"],
        /// Share of the inputs' time in which a surface moves at its actuator's full rate; the worst
        /// surface. None where no actuator is configured.
        pub rate_limited_share: Option<f64> ["1"],
        /// Share of samples of its outputs and inputs that are bridged, despiked, missing or stuck;
        /// samples between those of a slow channel do not count.
        pub marked_share: Option<f64> ["1"],
    }
}

table! {
    /// Excitation that fits no class.
    pub struct UnclassifiedExcitation in "unknown" per "excitation that fits no class" {
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// Time of the first step.
        pub start_s: f64 ["s"],
        /// Time of the last step.
        pub end_s: f64 ["s"],
        /// Signals that stepped, with their number of steps: `de_deg 5, dpv_deg 1`.
        pub inputs: String,
        /// Class whose inputs explain the most steps.
        pub nearest_class: String,
        /// Difference from that class: too few steps, pulses of other lengths, the pilot's hand. Or
        /// the classes that fit alike. Or the maneuver whose inputs overlap, with the reason for a
        /// rejection.
        pub reason: String,
    }
}

impl Maneuver {
    /// Condition at which the tunnel is read for this maneuver: its means. If the tunnel's third
    /// variable is no mean of a maneuver, it has the value in the tunnel's settings.
    #[must_use]
    pub fn condition(&self, tunnel: &WindTunnel) -> Condition {
        let third = tunnel.settings().third.as_ref().map(|third| {
            let mean = match third.name.as_str() {
                signal::ALTITUDE => self.altitude_ft,
                signal::QBAR => self.qbar_psf,
                signal::VELOCITY => self.velocity_ft_s,
                signal::MASS => self.mass_slug,
                signal::X_CG => self.x_cg_ft,
                _ => third.at,
            };
            if mean.is_finite() { mean } else { third.at }
        });
        Condition {
            alpha_deg: self.alpha_deg,
            mach: self.mach,
            third,
        }
    }
}
