//! Settings of ingest, with defaults from recorders and flight mechanics.

use serde::{Deserialize, Serialize};

use super::compatibility::Compatibility;
use crate::settings::{settings, single_values};

settings! {
    /// Settings of ingest.
    pub struct Settings {
        /// Longest gap of a channel that is bridged by a straight line, s. The default is short
        /// against the short period and the Dutch roll of a fighter. Larger: fewer maneuvers are
        /// lost to gaps, and more samples are invented. Signals that change slowly have longer bridges,
        /// see `docs/ingest.md`, and none if this is 0.
        pub longest_bridge_s: f64 = 0.25,
        /// Longest gap of the clock that is kept as missing samples, s. After a longer one the flight
        /// goes on as another stretch: `flight_001.2`, with instrument errors of its own. Many recorders
        /// are off between test points, for minutes.
        pub longest_clock_gap_s: f64 = 600.0,
        /// Memory that reading may use at once, MB (10⁶ bytes), over all flights in work. It sets how
        /// many flights are read at once and in how large pieces. Results do not depend on it.
        #[serde(skip_serializing)]
        pub memory_mb: f64 = 200.0,
        /// Flights in which a required channel has a wrong sign or unit: `refuse`, or `report` the
        /// problem and go on with the flight.
        pub on_failed_check: OnFailedCheck = OnFailedCheck::Refuse,
    }
    expert {
        /// Rate of the recorder, Hz. Without it the median time step sets the rate. A wrong rate
        /// puts samples on wrong times.
        pub sampling_rate_hz: Option<f64> = None,
        /// Shortest stretch of a flight that is kept, s. A shorter one holds no maneuver with its
        /// lead-in and decay.
        pub least_stretch_s: f64 = 5.0,
        /// Longest stretch of a flight, h. A longer one goes on as another stretch. Larger: more
        /// memory for the clock and the block means.
        pub longest_stretch_h: f64 = 24.0,
        /// Certainty from which an instrument is called faulty, standard errors, in the checks of
        /// units and signs and in the compatibility check. Larger: fewer false alarms, smaller
        /// faults pass.
        #[serde(skip_serializing)]
        pub fault_standard_errors: f64 = 4.0,
        /// Removal of spikes.
        pub spikes: Spikes = Spikes::default(),
        /// Detection of stuck channels.
        pub stuck: Stuck = Stuck::default(),
        /// Checks of units and signs.
        pub checks: Checks = Checks::default(),
    }
    split {
        /// Biases, scale errors and delays of the instruments from the kinematic equations.
        pub compatibility: Compatibility,
    }
}

impl Settings {
    /// Copies the keys that several parts of ingest share to each of them.
    pub(crate) fn share(&mut self) {
        self.checks.standard_errors = self.fault_standard_errors;
        self.compatibility.fault_standard_errors = self.fault_standard_errors;
    }
}

/// Treatment of a flight in which a required channel fails its checks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnFailedCheck {
    /// The flight is refused: derivatives from a wrong sign are worse than none.
    #[default]
    Refuse,
    /// The problem is reported and the flight goes on.
    Report,
}
single_values!(OnFailedCheck);

settings! {
    /// Detection of channels that are stuck.
    pub struct Stuck {
        /// Search for stuck values. `false` keeps them as measured.
        pub find: bool = true,
        /// Shortest time without change after which a noisy channel is stuck, s. The default is
        /// forty samples of a usual recorder; noise of half a quantisation step repeats a value a
        /// few times. Smaller: quiet flight is taken for a stuck channel.
        pub least_s: f64 = 1.0,
        /// Largest share of samples that repeat the value before them in a channel that is searched.
        /// Above it the recorder is so coarse that constant values are normal.
        pub most_repeats: f64 = 0.5,
    }
}

settings! {
    /// Removal of single-sample spikes.
    pub struct Spikes {
        /// Search for spikes. `false` keeps them as measured.
        pub remove: bool = true,
        /// Smallest height of a spike above its neighbours, standard deviations of the channel's
        /// noise. The default is beyond what noise reaches once in ten million samples. Smaller:
        /// real samples are replaced.
        pub deviations: f64 = 8.0,
        /// Time on either side of a sample over which its local noise is measured, s.
        pub window_s: f64 = 0.5,
        /// Largest disagreement of the samples before and after about the value between them, as a
        /// share of the spike's height. Larger: samples of fast motion are taken for spikes.
        pub agreement: f64 = 0.5,
    }
}

settings! {
    /// Checks of units and signs. They find gross faults: a sign, a unit, a channel that belongs
    /// elsewhere. Biases and scale errors of some per cent pass.
    pub struct Checks {
        /// Length of the blocks over which samples are averaged first, s. Longer: less noise, and
        /// fast motion is lost.
        pub block_s: f64 = 0.2,
        /// Length of the windows over which relations are integrated, s.
        pub window_s: f64 = 1.0,
        /// Fewest excited windows for a verdict. Larger: short flights stay unchecked.
        pub least_windows: usize = 8,
        /// Largest factor between the slope of a relation and one. The smallest confusion of units
        /// that occurs, knots for feet per second, is 1.69.
        pub slope_factor: f64 = 1.5,
        /// Least correlation that counts as agreement between forces, flow and motion, which gusts
        /// disturb.
        pub least_correlation: f64 = 0.5,
        /// Least correlation that counts as agreement between attitudes and rates, which only noise
        /// disturbs.
        pub least_attitude_correlation: f64 = 0.9,
        /// Largest share of a relation's windows that may be left out as jumps of the record. Such
        /// windows are far from all others: joined parts of a flight, lost frames. A faulty channel
        /// is wrong in all windows. Larger: faults that come and go pass as jumps.
        pub jumps_share: f64 = 0.4,
        /// Velocity below which the aircraft does not fly and the vanes have no meaning, ft/s.
        pub least_velocity_ft_s: f64 = 50.0,
        /// Shortest record in which an instrument with one constant value is dead, s. Even a coarse
        /// instrument sees some change of speed, height or attitude in a minute of flight.
        pub dead_s: f64 = 60.0,
        /// Least excitation of a window of each relation.
        pub excitation: Excitation = Excitation::default(),
    }
    elsewhere {
        /// Standard errors of the slope for a verdict: `ingest: expert: fault_standard_errors`.
        pub standard_errors: f64 = 4.0,
    }
}

settings! {
    /// Least excitation of a window: twice what biases may contribute where nothing moves. Half of it
    /// is allowed for as an error of the relation that does not average out. Smaller: more windows
    /// count, and biases disturb them.
    pub struct Excitation {
        /// Change of an attitude, deg/s.
        pub attitude_deg_s: f64 = 1.0,
        /// Normal acceleration, g.
        pub normal_g: f64 = 0.3,
        /// Axial acceleration, g.
        pub axial_g: f64 = 0.1,
        /// Change of a body-axis velocity, ft/s².
        pub velocity_ft_s2: f64 = 5.0,
        /// Climb, ft/s. A vane's bias of one or two degrees makes half of it.
        pub climb_ft_s: f64 = 30.0,
        /// Dynamic pressure, lbf/ft².
        pub qbar_psf: f64 = 10.0,
        /// Mach number.
        pub mach: f64 = 0.05,
        /// Lateral acceleration, g. It is small beside the terms that balance it, whose noise reaches
        /// this level, so `lateral_share` chooses the windows.
        pub lateral_g: f64 = 0.01,
        /// Share of the windows, those with the largest lateral acceleration, in which lateral
        /// acceleration is checked.
        pub lateral_share: f64 = 0.05,
    }
}
