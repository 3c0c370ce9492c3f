//! What the analyst may decide about ingest, with defaults reasoned from recorders and flight
//! mechanics.

use super::compatibility::Compatibility;
use serde::{Deserialize, Serialize};

/// The settings of ingest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// The recorder's rate, Hz; without it the median time step says.
    pub sampling_rate_hz: Option<f64>,
    /// The longest gap of a channel that a straight line bridges, s. A quarter of a second is short
    /// against the short period and the Dutch roll of a fighter; anything longer would be
    /// invention.
    pub longest_bridge_s: f64,
    /// The longest gap of the clock that is kept as missing samples, s; a longer one ends the
    /// stretch of the flight, and what follows is the next. No maneuver lasts as long.
    pub longest_clock_gap_s: f64,
    /// A stretch shorter than this holds no maneuver with its lead-in and decay, s; it is left out.
    pub least_stretch_s: f64,
    /// A stretch longer than this goes on as another one, h.
    pub longest_stretch_h: f64,
    /// What reading and conditioning may hold in memory at once, MB (10⁶ bytes), over all flights
    /// in work. It decides how many flights are in work at once and in what pieces they are read;
    /// results do not depend on it, so it is not among what decides them (fingerprints).
    #[serde(skip_serializing)]
    pub memory_mb: f64,
    pub spikes: Spikes,
    pub stuck: Stuck,
    /// What happens to a flight when a required channel fails its checks.
    pub on_failed_check: OnFailedCheck,
    pub checks: Checks,
    /// Biases, scale errors and delays of the instruments from the kinematic equations.
    pub compatibility: Compatibility,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            sampling_rate_hz: None,
            longest_bridge_s: 0.25,
            longest_clock_gap_s: 60.0,
            least_stretch_s: 10.0,
            longest_stretch_h: 24.0,
            memory_mb: 200.0,
            spikes: Spikes::default(),
            stuck: Stuck::default(),
            on_failed_check: OnFailedCheck::Refuse,
            checks: Checks::default(),
            compatibility: Compatibility::default(),
        }
    }
}

/// What happens to a flight when a required channel fails its checks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnFailedCheck {
    /// The flight is refused: derivatives from a wrong sign are worse than none.
    #[default]
    Refuse,
    /// The problem is reported and the flight goes on.
    Report,
}

/// When a channel that stands still is stuck.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Stuck {
    /// Whether stuck values are looked for at all.
    pub find: bool,
    /// A channel whose noise changes most of its samples is stuck when it does not change for this
    /// long, s: forty samples of a usual recorder, while noise of half a quantisation step repeats
    /// a value a few times.
    pub least_s: f64,
    /// The most samples in which the noise may leave the value as it is, a share: above it the
    /// recorder is so coarse that standing still is nothing unusual.
    pub most_repeats: f64,
}

impl Default for Stuck {
    fn default() -> Stuck {
        Stuck {
            find: true,
            least_s: 1.0,
            most_repeats: 0.5,
        }
    }
}

/// When a single sample is a spike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Spikes {
    /// Whether single-sample spikes are looked for at all.
    pub remove: bool,
    /// How far a spike stands off its neighbours, in standard deviations of the channel's noise:
    /// far beyond what noise does once in a campaign of ten million samples.
    pub deviations: f64,
    /// The time on either side of a sample in which its local noise is measured, s.
    pub window_s: f64,
    /// How well the samples before and those after must agree about the value between them, as a
    /// share of the spike's height: where they do not, the motion itself is fast and the sample may
    /// be real.
    pub agreement: f64,
}

impl Default for Spikes {
    fn default() -> Spikes {
        Spikes {
            remove: true,
            deviations: 8.0,
            window_s: 0.5,
            agreement: 0.5,
        }
    }
}

/// How units and signs are checked. Only gross faults count: a sign, a unit, a channel that belongs
/// elsewhere; biases, scale errors of some per cent and noise are the estimator's business.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Checks {
    /// Samples are averaged over blocks of this length first, s: noise falls, motion stays.
    pub block_s: f64,
    /// Relations are integrated over windows of this length, s.
    pub window_s: f64,
    /// Fewer excited windows than this decide nothing.
    pub least_windows: usize,
    /// How far the slope of a relation may be from one, as a factor. The smallest confusion of
    /// units that occurs, knots for feet per second, is 1.69.
    pub slope_factor: f64,
    /// The least correlation that counts as agreement between forces, flow and motion, which gusts
    /// blur.
    pub least_correlation: f64,
    /// The least correlation that counts as agreement between attitudes and rates, which nothing
    /// but noise blurs.
    pub least_attitude_correlation: f64,
    /// How many standard errors of the slope a verdict needs.
    pub standard_errors: f64,
    /// At most this share of a relation's windows, far off all others, are taken for jumps of the
    /// record and left out: parts of a flight put together, frames lost without a trace. A channel
    /// that is wrong is so wherever it moves; where most windows agree closely, the others are the
    /// record's.
    pub jumps_share: f64,
    /// Below this velocity the aircraft is not flying and the vanes mean nothing, ft/s.
    pub least_velocity_ft_s: f64,
    /// An instrument that has one and the same value in a whole record of at least this length is
    /// dead, s: even a coarse one sees some change of speed, height or attitude in a minute of
    /// flight.
    pub dead_s: f64,
    pub excitation: Excitation,
}

impl Default for Checks {
    fn default() -> Checks {
        Checks {
            block_s: 0.2,
            window_s: 1.0,
            least_windows: 8,
            slope_factor: 1.5,
            least_correlation: 0.5,
            least_attitude_correlation: 0.9,
            standard_errors: 4.0,
            jumps_share: 0.4,
            least_velocity_ft_s: 50.0,
            dead_s: 60.0,
            excitation: Excitation::default(),
        }
    }
}

/// From where on a window says something about a relation: twice what biases may leave of it where
/// nothing moves. Half of it is allowed for as an error of the relation that does not average out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Excitation {
    /// Change of an attitude, deg/s.
    pub attitude_deg_s: f64,
    /// Normal acceleration, g.
    pub normal_g: f64,
    /// Axial acceleration, g.
    pub axial_g: f64,
    /// Change of a body-axis velocity, ft/s².
    pub velocity_ft_s2: f64,
    /// Climb, ft/s; a vane that is off by a degree or two alone makes half of it.
    pub climb_ft_s: f64,
    /// Dynamic pressure, lbf/ft².
    pub qbar_psf: f64,
    pub mach: f64,
    /// Lateral acceleration, g. It is small beside the terms that balance it, whose noise reaches
    /// this level: the windows are chosen by the next item instead.
    pub lateral_g: f64,
    /// The share of the windows, those with the largest lateral acceleration, in which it is
    /// checked.
    pub lateral_share: f64,
}

impl Default for Excitation {
    fn default() -> Excitation {
        Excitation {
            attitude_deg_s: 1.0,
            normal_g: 0.3,
            axial_g: 0.1,
            velocity_ft_s2: 5.0,
            climb_ft_s: 30.0,
            qbar_psf: 10.0,
            mach: 0.05,
            lateral_g: 0.01,
            lateral_share: 0.05,
        }
    }
}
