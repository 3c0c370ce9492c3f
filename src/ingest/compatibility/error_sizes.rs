//! Sizes of instrument errors: those of healthy instruments, and those from which an instrument is
//! faulty.

use serde::Serialize;

use super::parameters::{ALL_KINDS, INSTRUMENTS, KINDS, Kind, SIGNALS};
use crate::flight::signal as s;

/// Sizes of the errors of one instrument.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorSize {
    /// In the signal's unit.
    pub bias: f64,
    /// Relative.
    pub scale: f64,
    /// Against the other channels, s.
    pub delay_s: f64,
}

/// Sizes of the errors of all instruments.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorSizes([ErrorSize; INSTRUMENTS]);

/// Bias in the signal's unit, and relative scale error: ordinary ones, then those of a fault.
struct Sizes {
    bias: [f64; 2],
    scale: [f64; 2],
}

// Sources. The default sizes are those of usual flight-test instrumentation. An analyst who has a
// calibration states its sizes: `instruments: <signal>: ordinary` and `fault` of aircraft.yaml. An
// ordinary size is the standard deviation of a prior. Too small a size pulls a real error towards
// zero and its remainder into other instruments. Too large a size widens the bounds of errors that
// the flight does not determine, and fewer are corrected. The size of a fault decides from where an
// instrument is named, not what is estimated.

/// Rate gyros, deg/s. Usual instrumentation; 0.1 deg/s is the sixfold of a last bit of 12 over ±30 deg/s.
const GYRO: Sizes = Sizes {
    bias: [0.1, 0.5],
    scale: [0.005, 0.05],
};
/// Accelerometers, g. Usual instrumentation; 0.01 g is the effect of a tilt of 0.6°, 0.05 g of 3°.
const ACCELEROMETER: Sizes = Sizes {
    bias: [0.01, 0.05],
    scale: [0.003, 0.05],
};
/// Flow vanes, deg. Usual instrumentation: alignment of the vane, and what is left of the upwash after its
/// correction.
const FLOW_VANE: Sizes = Sizes {
    bias: [0.3, 2.0],
    scale: [0.02, 0.1],
};
/// Airspeed, ft/s. A third of what 14 CFR 25.1323 allows an airspeed system, 5 kt (8.4 ft/s) and 3 %; a fault is
/// beyond that.
const AIRSPEED: Sizes = Sizes {
    bias: [3.0, 20.0],
    scale: [0.01, 0.05],
};
/// Altitude, ft. Bias: the static-pressure error that 14 CFR 25.1325 allows (30 ft per 100 kt) at
/// 330 kt. Scale: the error on a day 1 % (3 K) off the standard atmosphere.
const ALTITUDE: Sizes = Sizes {
    bias: [100.0, 1000.0],
    scale: [0.01, 0.05],
};
/// Dynamic pressure, lbf/ft². Usual instrumentation; it is 2 % where the airspeed is 1 %, the rest is that of
/// the static pressure.
const DYNAMIC_PRESSURE: Sizes = Sizes {
    bias: [1.0, 10.0],
    scale: [0.03, 0.15],
};
/// Mach number. Usual instrumentation; 0.005 is 5.6 ft/s at sea level, of airspeed and temperature.
const MACH: Sizes = Sizes {
    bias: [0.005, 0.05],
    scale: [0.02, 0.1],
};
/// Pitch attitude, bank and heading, deg. Usual instrumentation: a vertical gyro or a strapdown platform.
const ATTITUDE: Sizes = Sizes {
    bias: [0.2, 1.0],
    scale: [0.005, 0.05],
};

/// Delay against the other channels, s: an ordinary one is less than half a sample at the usual 40 Hz. From
/// three times that the phase of a mode of 1 Hz is wrong by 11°. Usual instrumentation.
const DELAY_S: [f64; 2] = [0.01, 0.03];

impl Sizes {
    fn of_signal(signal: &str) -> &'static Sizes {
        match signal {
            s::P | s::Q | s::R => &GYRO,
            s::AX | s::AY | s::AN => &ACCELEROMETER,
            s::ALPHA_VANE | s::BETA_VANE => &FLOW_VANE,
            s::VELOCITY => &AIRSPEED,
            s::ALTITUDE => &ALTITUDE,
            s::QBAR => &DYNAMIC_PRESSURE,
            s::MACH => &MACH,
            _ => &ATTITUDE,
        }
    }
}

impl ErrorSizes {
    /// Standard deviations of the errors of healthy instruments.
    pub(super) fn ordinary() -> ErrorSizes {
        ErrorSizes::of_column(0)
    }

    /// Sizes from which an error is a fault: several times the ordinary ones.
    pub(super) fn faulty() -> ErrorSizes {
        ErrorSizes::of_column(1)
    }

    /// Ordinary sizes (0) or those of a fault (1).
    fn of_column(column: usize) -> ErrorSizes {
        ErrorSizes(SIGNALS.map(|signal| {
            let sizes = Sizes::of_signal(signal);
            ErrorSize {
                bias: sizes.bias[column],
                scale: sizes.scale[column],
                delay_s: DELAY_S[column],
            }
        }))
    }

    /// Size of one error of an instrument.
    pub(super) fn of(&self, instrument: usize, kind: Kind) -> f64 {
        let size = &self.0[instrument];
        match kind {
            Kind::Bias => size.bias,
            Kind::Scale => size.scale,
            Kind::Delay => size.delay_s,
        }
    }

    /// Size of a parameter.
    pub(super) fn of_parameter(&self, parameter: usize) -> f64 {
        self.of(parameter / KINDS, ALL_KINDS[parameter % KINDS])
    }

    /// Sizes of the instrument of a signal; `None` for a signal that no kinematic equation has.
    pub fn of_signal(&mut self, signal: &str) -> Option<&mut ErrorSize> {
        let instrument = SIGNALS.iter().position(|s| *s == signal)?;
        self.0.get_mut(instrument)
    }
}
