//! Is what the bounds say true? Maneuvers with known derivatives are recorded many times, each time
//! with other noise, and estimated; how far the estimates scatter is held against what each of them
//! said of itself.
//!
//! The maneuvers are the simulator's, whose equations of motion are not the estimator's.
//! Instruments have noise only; held values are the true ones.

use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{Output, WindTunnel};
use crate::estimate::{self, Basis, Estimated};
use crate::lab::simulator::{Flown, Instrument, Instruments};
use crate::maneuver::Class;
use crate::output_error::estimation::Weights;

/// What noise the records have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Residuals {
    /// White noise of the outputs.
    White,
    /// Coloured noise of the outputs, of the same size.
    Coloured,
    /// White noise on every channel, also those that the estimator takes as exact: surfaces,
    /// airspeed, the other axis.
    EveryChannel,
}

impl Residuals {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Residuals::White => "white",
            Residuals::Coloured => "coloured",
            Residuals::EveryChannel => "noise on every channel",
        }
    }
}

/// A maneuver that is recorded again and again.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    pub class: &'a Class,
    pub flown: &'a Flown,
    /// What each signal's noise is.
    pub instruments: &'a Instruments,
    pub basis: Basis<'a>,
}

/// One way of recording and weighting; the time constant is that of coloured noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    pub residuals: Residuals,
    pub coloured_time_s: f64,
    pub weights: Weights,
}

/// A table that says everywhere what was true in a maneuver.
#[must_use]
pub fn tunnel_of_truth(flown: &Flown) -> WindTunnel {
    let mut tunnel = WindTunnel::default();
    for truth in &flown.truth {
        for alpha_deg in [-180.0, 180.0] {
            let point = TunnelPoint {
                alpha_deg,
                mach: None,
                value: truth.value,
                uncertainty: None,
                source: None,
            };
            tunnel.insert(&truth.derivative, point);
        }
    }
    tunnel
}

impl Subject<'_> {
    /// The estimate from one record.
    pub fn estimate(&self, setting: Setting, seed: u64) -> Estimated {
        let record = self.flown.recorded(&self.noise_only(setting), seed);
        let settings = estimate::Settings {
            weights: setting.weights,
            ..self.basis.settings.clone()
        };
        estimate::maneuver(
            &record,
            &self.flown.maneuver,
            self.class,
            &Basis {
                settings: &settings,
                ..self.basis
            },
        )
    }

    /// Instruments with nothing but noise.
    fn noise_only(&self, setting: Setting) -> Instruments {
        let outputs = self.class.axis.outputs().map(Output::signal);
        let only = |(signal, instrument): (&String, &Instrument)| {
            let (noise, is_output) = (instrument.noise, outputs.contains(&signal.as_str()));
            let perfect = Instrument::default();
            let instrument = match setting.residuals {
                Residuals::Coloured if is_output => Instrument {
                    coloured: noise,
                    coloured_time_s: setting.coloured_time_s,
                    ..perfect
                },
                Residuals::White if is_output => Instrument { noise, ..perfect },
                Residuals::EveryChannel => Instrument { noise, ..perfect },
                Residuals::White | Residuals::Coloured => perfect,
            };
            (signal.clone(), instrument)
        };
        Instruments(self.instruments.0.iter().map(only).collect())
    }
}
