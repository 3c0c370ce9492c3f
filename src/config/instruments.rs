//! Sizes of instrument errors, `instruments:` in `aircraft.yaml`, by signal.

use std::collections::BTreeMap;

use crate::ingest::compatibility::ErrorSize;
use crate::output_error::calibration_errors::Calibration;
use crate::settings::{elements, settings};

settings! {
    /// Sizes of the errors of one instrument.
    pub struct InstrumentErrors {
        /// Uncertainty that calibration leaves.
        pub uncertainty: Calibration = Calibration::default(),
        /// Errors of the healthy instrument as installed, standard deviations.
        pub ordinary: OrdinaryErrors = OrdinaryErrors::default(),
        /// Errors from which the instrument is faulty.
        pub fault: FaultyErrors = FaultyErrors::default(),
    }
}
elements!(BTreeMap<String, InstrumentErrors>: InstrumentErrors as "<signal>");

settings! {
    /// Errors of a healthy instrument, in place of those of its kind.
    #[derive(Copy)]
    pub struct OrdinaryErrors {
        /// Standard deviation of the bias, in the signal's unit. Larger: the compatibility check
        /// finds larger biases, with less certainty.
        pub bias: Option<f64> = None,
        /// Standard deviation of the scale error, percent. Larger: larger scale errors are found, with
        /// less certainty.
        pub scale_pct: Option<f64> = None,
        /// Standard deviation of the delay against the other channels, s. Larger: larger delays are
        /// found, with less certainty.
        pub delay_s: Option<f64> = None,
    }
}

settings! {
    /// Errors from which an instrument is faulty, in place of those of its kind.
    #[derive(Copy)]
    pub struct FaultyErrors {
        /// Bias from which the instrument is faulty, in the signal's unit. Larger: fewer faults are
        /// named.
        pub bias: Option<f64> = None,
        /// Scale error from which the instrument is faulty, percent. Larger: fewer faults are named.
        pub scale_pct: Option<f64> = None,
        /// Delay from which the instrument is faulty, s. Larger: fewer faults are named.
        pub delay_s: Option<f64> = None,
    }
}

impl OrdinaryErrors {
    /// Sizes as the file gives them: bias, scale in percent, delay.
    pub fn given(&self) -> [Option<f64>; 3] {
        [self.bias, self.scale_pct, self.delay_s]
    }
}

impl FaultyErrors {
    /// Sizes as the file gives them: bias, scale in percent, delay.
    pub fn given(&self) -> [Option<f64>; 3] {
        [self.bias, self.scale_pct, self.delay_s]
    }
}

/// Puts given sizes in place of those of the instrument's kind.
pub fn replace(size: &mut ErrorSize, [bias, scale_pct, delay_s]: [Option<f64>; 3]) {
    size.bias = bias.unwrap_or(size.bias);
    size.scale = scale_pct.map_or(size.scale, |pct| pct / 100.0);
    size.delay_s = delay_s.unwrap_or(size.delay_s);
}
