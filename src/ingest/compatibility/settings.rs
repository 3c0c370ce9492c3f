//! What the analyst may decide about data compatibility, with defaults reasoned from the
//! instruments of a flight test.

use serde::{Deserialize, Serialize};

/// How flight-path reconstruction is done and what follows from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Compatibility {
    /// Whether instruments are looked at at all.
    pub reconstruct: bool,
    /// What becomes of biases, scale errors and delays that the flight tells but that are ordinary.
    pub bias: Action,
    pub scale: Action,
    pub delay: Action,
    /// What becomes of an instrument with a fault.
    pub fault: OnFault,
    /// A correction counts when it is this many times its bound.
    pub standard_errors: f64,
    /// A fault is named when it is this many times its bound, besides being beyond what is
    /// ordinary. A channel that is ahead of the others needs twice as many: instruments and
    /// recorders delay, and for one to be ahead all others must be late alike.
    pub fault_standard_errors: f64,
    /// Length of the windows, s: some periods of the Dutch roll, and short enough that wind stays
    /// what it is.
    pub window_s: f64,
    /// The most windows of a flight; memory and time are proportional to them.
    pub windows: usize,
    /// Fewer windows than this decide nothing.
    pub least_windows: usize,
    /// The longest delay that is looked for, s.
    pub longest_delay_s: f64,
    /// How fast the wind that the aircraft meets may change within a window, ft/s²: a climb of 100
    /// ft/s through a shear of 2 ft/s in a thousand feet makes 0.2.
    pub wind_change_ft_s2: f64,
    /// What a healthy instrument of each kind is off by (standard deviations).
    pub ordinary: Errors,
    /// From where it is no longer an instrument's ordinary error but a fault to be named.
    pub faulty: Errors,
}

impl Default for Compatibility {
    fn default() -> Compatibility {
        Compatibility {
            reconstruct: true,
            bias: Action::Apply,
            scale: Action::Apply,
            delay: Action::Report,
            fault: OnFault::Apply,
            standard_errors: 3.0,
            fault_standard_errors: 4.0,
            window_s: 20.0,
            windows: 20,
            least_windows: 3,
            longest_delay_s: 0.3,
            wind_change_ft_s2: 0.1,
            ordinary: Errors::ordinary(),
            faulty: Errors::faulty(),
        }
    }
}

/// What becomes of an ordinary error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// The channel is corrected where the error counts.
    Apply,
    /// It is published, and the channel stays as it is.
    Report,
}

/// What becomes of an instrument with a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnFault {
    /// It is named, and the channel is corrected by what was found.
    Apply,
    /// It is named, and the channel stays as it is.
    Report,
    /// It is named and the flight refused.
    Refuse,
}

/// Bias in the unit of the kind, scale relative.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Error {
    pub bias: f64,
    pub scale: f64,
}

/// Sizes of errors by kind of instrument.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Errors {
    pub rate_deg_s: Error,
    pub accelerometer_g: Error,
    pub vane_deg: Error,
    pub velocity_ft_s: Error,
    pub attitude_deg: Error,
    pub altitude_ft: Error,
    pub qbar_psf: Error,
    pub mach: Error,
    /// Of any channel against the others, s.
    pub delay_s: f64,
}

impl Errors {
    fn ordinary() -> Errors {
        let error = |bias, scale| Error { bias, scale };
        Errors {
            rate_deg_s: error(0.1, 0.005),
            accelerometer_g: error(0.01, 0.003),
            vane_deg: error(0.3, 0.02),
            velocity_ft_s: error(3.0, 0.01),
            attitude_deg: error(0.2, 0.005),
            altitude_ft: error(100.0, 0.01),
            qbar_psf: error(1.0, 0.03),
            mach: error(0.005, 0.02),
            delay_s: 0.01,
        }
    }

    fn faulty() -> Errors {
        let error = |bias, scale| Error { bias, scale };
        Errors {
            rate_deg_s: error(0.5, 0.05),
            accelerometer_g: error(0.05, 0.05),
            vane_deg: error(2.0, 0.1),
            velocity_ft_s: error(20.0, 0.05),
            attitude_deg: error(1.0, 0.05),
            altitude_ft: error(1000.0, 0.05),
            qbar_psf: error(10.0, 0.15),
            mach: error(0.05, 0.1),
            delay_s: 0.03,
        }
    }
}
