//! Settings of the compatibility check, with defaults from the instruments of flight test.

use serde::{Deserialize, Serialize};

use super::error_sizes::ErrorSizes;
use super::parameters::Kind;
use crate::settings::{settings, single_values};
use crate::tables::InstrumentError;

settings! {
    /// Settings of flight-path reconstruction and of the corrections that follow.
    pub struct Compatibility {
        /// Ordinary biases: `apply` corrects the record by those that count, `report` only publishes
        /// them. Corrections change every estimate from the channel.
        pub bias: Action = Action::Apply,
        /// Ordinary scale errors: `apply` or `report`.
        pub scale: Action = Action::Apply,
        /// Ordinary delays: `apply` or `report`.
        pub delay: Action = Action::Report,
        /// Instruments with a fault: `apply` names the fault and corrects the channel, `report` names
        /// it, `refuse` names it and refuses the flight.
        pub fault: OnFault = OnFault::Apply,
        /// Size from which an error is corrected, standard errors: chance exceeds the default once in
        /// twenty errors. Larger: fewer corrections, and the errors that stay in the record widen
        /// `bound_corrected`.
        pub standard_errors: f64 = 2.0,
    }
    split expert {
        /// Flight-path reconstruction. `false` leaves all instruments unexamined.
        pub reconstruct: bool = true,
        /// Length of the windows, s: some periods of the Dutch roll. Longer: the wind changes within
        /// a window.
        pub window_s: f64 = 20.0,
        /// Most windows of a flight. More: smaller bounds of the errors, and time and memory in
        /// proportion.
        pub windows: usize = 20,
        /// Fewest windows for a result. Larger: short flights stay unexamined.
        pub least_windows: usize = 1,
        /// Longest delay of a channel that is searched, s. A larger one is not found.
        pub longest_delay_s: f64 = 0.3,
        /// Change of the wind along the flight path within a window, ft/s². A climb of 100 ft/s
        /// through a shear of 2 ft/s per thousand feet makes 0.2. Larger: wider bounds of errors of
        /// vanes and airspeed.
        pub wind_change_ft_s2: f64 = 0.1,
    }
    elsewhere {
        /// Size of an error, in standard errors, from which it is a fault, besides being beyond what
        /// is ordinary: `ingest: expert: fault_standard_errors`.
        pub fault_standard_errors: f64 = 4.0,
        /// Errors of healthy instruments, standard deviations: `instruments:` of aircraft.yaml.
        pub ordinary: ErrorSizes = ErrorSizes::ordinary(),
        /// Sizes from which an error is a fault: `instruments:` of aircraft.yaml.
        pub faulty: ErrorSizes = ErrorSizes::faulty(),
    }
}

impl Compatibility {
    /// `true` if an ordinary error corrects the record.
    #[must_use]
    pub fn corrects(&self, error: InstrumentError, value: f64, bound: f64) -> bool {
        let action = match error {
            InstrumentError::Bias => self.bias,
            InstrumentError::Scale => self.scale,
            InstrumentError::Delay => self.delay,
        };
        action == Action::Apply && value.abs() > self.standard_errors * bound
    }

    /// Standard errors from which an error counts as a fault. A channel ahead of the others needs
    /// twice as many: instruments and recorders delay, so all others would have to be late alike.
    pub(super) fn standard_errors_of_fault(&self, kind: Kind, value: f64) -> f64 {
        let is_ahead = kind == Kind::Delay && value < 0.0;
        if is_ahead {
            2.0 * self.fault_standard_errors
        } else {
            self.fault_standard_errors
        }
    }
}

/// Treatment of an ordinary error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// The channel is corrected where the error counts.
    Apply,
    /// It is published, and the channel stays as it is.
    Report,
}

/// Treatment of an instrument with a fault.
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

single_values!(Action, OnFault);
