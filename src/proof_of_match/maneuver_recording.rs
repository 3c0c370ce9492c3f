//! Maneuver as recorded: the inputs of its simulation, and the signals to match.

use super::aerodynamics::recorded_signals;
use super::outputs::{COUNT, MATCHED, Outputs};
use crate::aero::AeroModel;
use crate::aircraft::{Aircraft, Thrust};
use crate::dynamics::Motion;
use crate::dynamics::motion::{ManeuverSignals, MassProperties};
use crate::flight::Record;
use crate::maneuver::Maneuver;
use crate::numerics::series::differences;
use crate::numerics::statistics::order_statistics::median;
use crate::rigid_body::{Loading, Mass};

/// Least number of samples of a maneuver that can be flown again.
const FEWEST_SAMPLES: usize = 20;

/// Shortest time for matching the trim, s. At 40 Hz, 0.5 s gives the slope of a rate to 0.1 deg/s².
const LEAST_TRIM_S: f64 = 0.5;

/// Least noise of each output, standard deviation, in the order of the outputs: finer than any
/// resolution.
const LEAST_NOISE: Outputs = [
    1e-3, 1e-3, 1e-2, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4,
];

/// Inputs of the simulation at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationInputs {
    pub loading: Loading,
    pub mass: Mass,
    pub thrust: Thrust,
    pub engine_momentum: f64,
    pub gravity_ft_s2: f64,
}

/// Maneuver as recorded.
#[derive(Clone, Debug)]
pub struct ManeuverRecording {
    pub step_s: f64,
    pub start_s: f64,
    pub samples: usize,
    /// Samples over which initial state and trim are matched.
    pub trim_samples: usize,
    /// Inputs at samples and halfway between them.
    inputs: Vec<SimulationInputs>,
    /// Recorded signals of the build-up at the same points.
    signals: Vec<f64>,
    /// Number of the signals.
    width: usize,
    /// Measured motion at the samples of the trim.
    pub motions: Vec<Motion>,
    pub altitude_ft: f64,
    /// Recorded outputs at the samples.
    pub measured: Vec<Outputs>,
    /// Samples of each output that ingest repaired.
    pub repaired: Vec<[bool; COUNT]>,
    /// White noise of each output, standard deviation.
    pub noise: Outputs,
}

impl ManeuverRecording {
    /// Cuts a maneuver out of its record.
    ///
    /// # Errors
    /// A sentence that names the signal that is missing, or the length that is too short.
    pub fn new(
        record: &Record,
        maneuver: &Maneuver,
        (aircraft, aero_model): (&Aircraft, &AeroModel),
        longest_trim_s: f64,
    ) -> Result<ManeuverRecording, String> {
        let first = record.sample_at(maneuver.start_s);
        let range = first..record.sample_at(maneuver.end_s) + 1;
        let samples = range.len();
        if samples < FEWEST_SAMPLES {
            return Err(format!("it has {samples} samples only"));
        }
        let signals = recorded_signals(aero_model);
        let mass = MassProperties::Recorded;
        let window = ManeuverSignals::cut(
            aircraft,
            record,
            range.clone(),
            signals.iter().copied(),
            mass,
        )?;
        let motion = window.motion(aircraft);
        let measured = measured(record, range.clone());
        let trim_samples = trim_samples(record, maneuver, samples, longest_trim_s);
        Ok(ManeuverRecording {
            step_s: record.step_s,
            start_s: record.time_s(first),
            samples,
            trim_samples,
            inputs: motion.points().map(|point| inputs(&point)).collect(),
            signals: by_point(&window, &signals),
            width: signals.len(),
            motions: (0..trim_samples).map(|k| motion.at(2 * k)).collect(),
            altitude_ft: window
                .signal(crate::flight::signal::ALTITUDE)
                .first()
                .copied()
                .unwrap_or(0.0),
            noise: noise(&measured),
            repaired: repaired(record, range),
            measured,
        })
    }

    /// Inputs at a point: sample k is point 2k.
    #[must_use]
    pub fn inputs(&self, point: usize) -> &SimulationInputs {
        &self.inputs[point]
    }

    /// Recorded signals of the build-up at a point, in the order of [`recorded_signals`].
    #[must_use]
    pub fn signals(&self, point: usize) -> &[f64] {
        &self.signals[point * self.width..][..self.width]
    }

    /// Largest range over which a surface moves from a time on, deg.
    #[must_use]
    pub fn movement_after(&self, time_s: f64) -> f64 {
        let from = ((time_s - self.start_s) / self.step_s).max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative"
        )]
        let first = (from.ceil() as usize).min(self.samples);
        let range = |place: usize| {
            let values = (first..self.samples).map(|k| self.signals(2 * k)[place]);
            let ends = values.fold((f64::MAX, f64::MIN), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            (ends.1 - ends.0).max(0.0)
        };
        (0..self.width).map(range).fold(0.0, f64::max)
    }
}

fn inputs(motion: &Motion) -> SimulationInputs {
    let loading = Loading {
        mass_slug: motion.mass,
        x_cg_ft: motion.cg.x_ft,
        y_cg_ft: motion.cg.y_ft,
        z_cg_ft: motion.cg.z_ft,
        ix_slug_ft2: motion.ix,
        iy_slug_ft2: motion.iy,
        iz_slug_ft2: motion.iz,
        ixz_slug_ft2: motion.ixz,
    };
    SimulationInputs {
        loading,
        mass: loading.mass(),
        thrust: motion.thrust,
        engine_momentum: motion.engine_momentum,
        gravity_ft_s2: motion.gravity,
    }
}

/// Values of some signals, point by point.
fn by_point(window: &ManeuverSignals, names: &[&str]) -> Vec<f64> {
    let signals: Vec<&[f64]> = names.iter().map(|name| window.signal(name)).collect();
    let at = |point: usize| {
        let signals = signals.iter();
        signals.map(move |signal| signal.get(point).copied().unwrap_or(0.0))
    };
    (0..window.len()).flat_map(at).collect()
}

fn measured(record: &Record, range: std::ops::Range<usize>) -> Vec<Outputs> {
    let signals = MATCHED.map(|quantity| record.values(quantity.name()).unwrap_or_default());
    let at = |k: usize| signals.map(|values| values.get(k).copied().unwrap_or(f64::NAN));
    range.map(at).collect()
}

fn repaired(record: &Record, range: std::ops::Range<usize>) -> Vec<[bool; COUNT]> {
    let marks = MATCHED.map(|quantity| record.signals.get(quantity.name()).map(|s| &s.marks));
    let at =
        |k: usize| marks.map(|marks| marks.and_then(|m| m.get(k)).is_some_and(|m| m.is_fault()));
    range.map(at).collect()
}

/// Samples from the start to the first input, at most as long as the settings allow.
fn trim_samples(record: &Record, maneuver: &Maneuver, samples: usize, longest_s: f64) -> usize {
    let until_input = maneuver
        .recognised
        .first_input_s
        .map(|t| t - maneuver.start_s);
    let time_s = until_input.map_or(longest_s, |t| t.min(longest_s));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive time over a positive step"
    )]
    let count = (time_s.max(LEAST_TRIM_S) / record.step_s).round() as usize + 1;
    count.clamp(FEWEST_SAMPLES.min(samples), samples)
}

/// White noise of each output, from its third differences. Their median leaves out steps of the
/// accelerations.
fn noise(measured: &[Outputs]) -> Outputs {
    std::array::from_fn(|i| {
        let samples = measured.array_windows::<4>();
        let sizes = samples.map(|w| differences::third(&w.map(|z| z[i])).abs());
        let noise = differences::noise_of_third(median(sizes).unwrap_or(0.0));
        noise.max(LEAST_NOISE[i])
    })
}
