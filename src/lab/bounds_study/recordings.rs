//! Recordings of one maneuver with fresh noise, and the estimate from each.

use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{Output, WindTunnel};
use crate::estimate::{self, Context, Estimated};
use crate::lab::simulator::{FlownManeuver, Instrument, Instruments, TrueDerivative};
use crate::maneuver::Class;
use crate::tables::{Residuals, Weights};

/// A maneuver to be recorded many times.
#[derive(Clone, Debug)]
pub struct StudyManeuver<'a> {
    pub class: &'a Class,
    pub flown: &'a FlownManeuver,
    /// Instruments with the noise of each signal.
    pub instruments: &'a Instruments,
    pub context: Context<'a>,
}

/// Noise of the recordings and weights of the estimates; the time constant is that of coloured noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scenario {
    pub residuals: Residuals,
    pub coloured_time_s: f64,
    pub weights: Weights,
}

/// Tunnel tables that hold given derivatives at every angle of attack.
#[must_use]
pub fn true_tables(derivatives: &[TrueDerivative]) -> WindTunnel {
    let mut tables = WindTunnel::default();
    for truth in derivatives {
        for alpha_deg in [-180.0, 180.0] {
            let point = TunnelPoint {
                alpha_deg,
                mach: None,
                value: truth.value,
                uncertainty: None,
                source: None,
            };
            tables.insert(&truth.derivative, point);
        }
    }
    tables
}

impl StudyManeuver<'_> {
    /// Records the maneuver once and estimates it.
    pub fn estimate(&self, scenario: Scenario, seed: u64) -> Estimated {
        let record = self.flown.recorded(&self.noise_only(scenario), seed);
        let settings = estimate::Settings {
            weights: scenario.weights,
            ..self.context.settings.clone()
        };
        let context = Context {
            settings: &settings,
            ..self.context
        };
        estimate::maneuver(&record, &self.flown.maneuver, self.class, &context)
    }

    /// Instruments with the noise of a scenario and no other errors.
    fn noise_only(&self, scenario: Scenario) -> Instruments {
        let outputs = self.class.axis.outputs().map(Output::signal);
        let noise_only = |(signal, instrument): (&String, &Instrument)| {
            let is_output = outputs.contains(&signal.as_str());
            let noise = instrument.noise;
            let perfect = Instrument::default();
            let instrument = match scenario.residuals {
                Residuals::Coloured if is_output => Instrument {
                    coloured: noise,
                    coloured_time_s: scenario.coloured_time_s,
                    ..perfect
                },
                Residuals::White if is_output => Instrument { noise, ..perfect },
                Residuals::EveryChannel => Instrument { noise, ..perfect },
                Residuals::White | Residuals::Coloured => perfect,
            };
            (signal.clone(), instrument)
        };
        Instruments(self.instruments.0.iter().map(noise_only).collect())
    }
}
