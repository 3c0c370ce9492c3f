//! Changes of the gradient by errors of the instruments, to first order in the errors.
//!
//! An instrument in error changes the recorded inputs and outputs. Let f be the change of the
//! rates, y of the computed outputs and z of the measured outputs, at one sample. f and y are taken
//! at the filter's corrected state, with unchanged parameters and gain. The change s of the
//! predicted state and the change v of the innovations then obey
//!
//! ```text
//! v(k) = z(k) − y(k) − C s(k)
//! s(k+1) = Φ [T (s(k) + K v(k)) + Δt/2 f(k)] + Δt/2 f(k+1)
//! ```
//!
//! with the filter's own steps Φ, slopes C of the outputs, gain K and decay T. A pass of each error
//! would integrate the whole maneuver again, from inputs at twice as many points.
//!
//! f and y at a sample depend on the signals at this sample alone. Their slopes along a signal
//! therefore serve all errors of the signal: its bias, its scale and its delay.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::collections::BTreeMap;

use nalgebra::{DVector, SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};

use super::filter::Filter;
use super::gains::{Pattern, PatternGain};
use super::pass::{RecordedPass, RecordedStep};
use super::response::FilterResponse;
use crate::aero::Derivative;
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::output_error::calibration_errors::{SignalChange, SignalError};
use crate::output_error::{Case, Diverged, InitialState, Measurements, Model};

/// Maneuver as its instruments recorded it.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    pub aircraft: &'a Aircraft,
    pub signals: &'a ManeuverSignals,
    pub model: &'a Model<'a>,
}

impl<const NX: usize, E: InGusts<NX>> Filter<NX, E> {
    /// Changes of the gradient of the filter's own parameters by errors of the instruments, at the
    /// same gain.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds at these parameters, or a change is not finite.
    pub fn gradient_shifts(
        &self,
        parameters: &[f64],
        recorded: &Recorded,
        errors: &[SignalError],
    ) -> Result<Vec<DVector<f64>>, Diverged> {
        let gains = self.gains_with_slopes(parameters)?;
        let mut pass = RecordedPass::new(self.samples(), self.lanes());
        let mut response = FilterResponse::empty(self.samples(), self.parameters());
        self.run(parameters, &gains, &mut response, Some(&mut pass))?;
        let names = self.names().iter().map(String::as_str);
        let values: BTreeMap<&str, f64> = names.zip(parameters.iter().copied()).collect();
        let samples = SampleEquations::new(&self.case, recorded, &values);
        let changes = samples.signal_changes(recorded, errors);
        let slopes = samples.slopes_along(recorded, &changes, &pass.steps);
        let mut white = AlignedMatrix::zeros(errors.len(), OUTPUTS * self.samples());
        for ((error, changes), white) in errors.iter().zip(&changes).zip(white.rows_mut()) {
            Arch::new().dispatch(ErrorPropagation::<NX, E, _> {
                steps: &pass.steps,
                gains: &gains,
                patterns: self.patterns(),
                decay: self.noise(parameters).decay(self.case.step_s),
                half_step_s: 0.5 * self.case.step_s,
                inputs: inputs_in_error(&slopes, changes),
                measured: output_errors::<NX, E>(&self.case.measurements, error),
                white,
                equations: std::marker::PhantomData,
            });
        }
        let lanes = white.product(&pass.rows);
        if lanes.values().iter().all(|change| change.is_finite()) {
            Ok(lanes
                .rows()
                .map(|lanes| self.values_in_lanes(lanes))
                .collect())
        } else {
            Err(Diverged { sample: 0 })
        }
    }

    /// Values of the filter's own parameters, from values in lanes.
    fn values_in_lanes(&self, lanes: &[f64]) -> DVector<f64> {
        let values = (0..self.first_noise()).map(|j| lanes[self.lane(j)]);
        DVector::from_iterator(self.first_noise(), values)
    }
}

/// Slopes of rates and outputs along the signals that change, with the changes.
fn inputs_in_error<'s, const NX: usize>(
    slopes: &'s BTreeMap<String, Vec<SampleValues<NX>>>,
    changes: &'s [SignalChange],
) -> Vec<(&'s [SampleValues<NX>], &'s [f64])> {
    let along = |change: &'s SignalChange| {
        let slopes = slopes.get(&change.signal)?;
        Some((&slopes[..], &change.samples[..]))
    };
    changes.iter().filter_map(along).collect()
}

/// Changes of the measured outputs by an error.
fn output_errors<'a, const NX: usize, E: Equations<NX>>(
    measurements: &'a Measurements,
    error: &SignalError,
) -> impl Fn(usize) -> [f64; OUTPUTS] + use<'a, NX, E> {
    let outputs = E::AXIS.outputs();
    let in_error = outputs.iter().position(|o| o.signal() == error.signal);
    let (scale, bias) = (error.scale, error.bias);
    move |sample| {
        let mut change = [0.0; OUTPUTS];
        if let Some(o) = in_error {
            change[o] = scale * measurements.values[sample][o] + bias;
        }
        change
    }
}

/// Rates and outputs at a sample, or their slopes along a signal.
struct SampleValues<const NX: usize> {
    rates: [f64; NX],
    outputs: [f64; OUTPUTS],
}

impl<const NX: usize> SampleValues<NX> {
    /// Replaces values after a step of a signal by the slopes along the signal.
    fn become_slope_from(&mut self, before: &SampleValues<NX>, step: f64) {
        let rates = self.rates.iter_mut().zip(&before.rates);
        let outputs = self.outputs.iter_mut().zip(&before.outputs);
        rates
            .chain(outputs)
            .for_each(|(value, before)| *value = (*value - before) / step);
    }
}

/// Equations of a maneuver at its samples, with all derivatives held at their values.
struct SampleEquations<'a, const NX: usize, E: Equations<NX>> {
    signals: ManeuverSignals,
    model: Model<'a>,
    /// Maneuver as recorded.
    exact: Case<NX, E>,
}

impl<'a, const NX: usize, E: Equations<NX>> SampleEquations<'a, NX, E> {
    fn new(case: &Case<NX, E>, recorded: &Recorded<'a>, values: &BTreeMap<&str, f64>) -> Self {
        let value = |name: &str| values.get(name).copied().unwrap_or(0.0);
        let free = recorded.model.free.iter().map(|d| (*d, value(&d.name)));
        let model = Model {
            held: free.chain(recorded.model.held.iter().copied()).collect(),
            initial_state: InitialState::Measured,
            ..Model::default()
        };
        let signals = recorded.signals.at_samples();
        let windows = [recorded.signals, &signals];
        let nothing = Measurements::default();
        SampleEquations {
            exact: case.as_recorded(recorded.aircraft, windows, nothing, &model),
            signals,
            model,
        }
    }

    /// Changes of the signals that the equations read, by each error.
    fn signal_changes(
        &self,
        recorded: &Recorded,
        errors: &[SignalError],
    ) -> Vec<Vec<SignalChange>> {
        let changes = |error: &SignalError| {
            if !self.reads(error.signal) {
                return vec![];
            }
            let mut changes = error.changes_at_samples(recorded.signals);
            changes.retain(|change| change.largest() > 0.0);
            changes
        };
        errors.iter().map(changes).collect()
    }

    /// Slopes of rates and outputs at the corrected states along each signal that changes, from a
    /// constant change as large as the largest one.
    fn slopes_along(
        &self,
        recorded: &Recorded,
        changes: &[Vec<SignalChange>],
        steps: &[RecordedStep<NX>],
    ) -> BTreeMap<String, Vec<SampleValues<NX>>> {
        let mut largest: BTreeMap<&String, f64> = BTreeMap::new();
        for change in changes.iter().flatten() {
            let size = largest.entry(&change.signal).or_default();
            *size = size.max(change.largest());
        }
        let exact = evaluate(&self.exact, steps);
        let slopes = |(signal, size): (&String, f64)| {
            let mut values = evaluate(&self.case_with_bias(recorded, signal, size), steps);
            for (values, exact) in values.iter_mut().zip(&exact) {
                values.become_slope_from(exact, size);
            }
            (signal.clone(), values)
        };
        largest.into_iter().map(slopes).collect()
    }

    /// Maneuver as an instrument with a bias would have recorded it.
    fn case_with_bias(&self, recorded: &Recorded, signal: &str, bias: f64) -> Case<NX, E> {
        let signals = self.signals.with_error(signal, 0.0, bias);
        let windows = [&self.signals, &signals];
        let nothing = Measurements::default();
        self.exact
            .as_recorded(recorded.aircraft, windows, nothing, &self.model)
    }

    /// `true` if rates, outputs or regressors depend on a signal. The rate of the angle of attack as
    /// a regressor follows from the whole motion.
    fn reads(&self, signal: &str) -> bool {
        let has_signal = |(d, _): &(&Derivative, f64)| {
            d.regressor.has_alpha_rate() || d.regressor.signals().any(|own| own == signal)
        };
        !E::SIGNALS_NOT_READ.contains(&signal) || self.model.held.iter().any(has_signal)
    }
}

/// Rates and outputs of a case at the corrected states.
fn evaluate<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    steps: &[RecordedStep<NX>],
) -> Vec<SampleValues<NX>> {
    Arch::new().dispatch(Evaluation { case, steps })
}

/// Rates and outputs along a trajectory, compiled for the processor at hand.
struct Evaluation<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    steps: &'a [RecordedStep<NX>],
}

impl<const NX: usize, E: Equations<NX>> WithSimd for Evaluation<'_, NX, E> {
    type Output = Vec<SampleValues<NX>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<SampleValues<NX>> {
        let motion = &self.case.motion;
        let mut values = Vec::with_capacity(self.steps.len());
        for (k, step) in self.steps.iter().enumerate() {
            let x = &step.corrected;
            let c = self.case.held.at(k).coefficients(x);
            let inputs = &motion.rate_inputs[k];
            let outputs = E::outputs(inputs, &motion.sensor_inputs[k], x, &c).outputs;
            values.push(SampleValues {
                rates: E::rates(inputs, x, &c).rates.data.0[0],
                outputs: outputs.data.0[0],
            });
        }
        values
    }
}

/// Linear response of a filter to one error.
struct ErrorPropagation<'a, const NX: usize, E: InGusts<NX>, M: Fn(usize) -> [f64; OUTPUTS]> {
    steps: &'a [RecordedStep<NX>],
    gains: &'a [PatternGain<NX>],
    /// Patterns, and the pattern of each sample.
    patterns: (&'a [Pattern], &'a [u8]),
    decay: f64,
    half_step_s: f64,
    /// Slopes of rates and outputs along the signals in error, and the changes of the signals.
    inputs: Vec<(&'a [SampleValues<NX>], &'a [f64])>,
    /// Change of the measured outputs at a sample.
    measured: M,
    /// Changes of the whitened innovations: sample by sample, output by output.
    white: &'a mut [f64],
    equations: std::marker::PhantomData<E>,
}

impl<const NX: usize, E: InGusts<NX>, M: Fn(usize) -> [f64; OUTPUTS]>
    ErrorPropagation<'_, NX, E, M>
{
    /// Changes of rates and outputs at a sample.
    #[inline(always)]
    fn input_changes(&self, k: usize) -> ([f64; NX], [f64; OUTPUTS]) {
        let (mut rates, mut outputs) = ([0.0; NX], [0.0; OUTPUTS]);
        for (slopes, changes) in &self.inputs {
            add_scaled(&mut rates, changes[k], &slopes[k].rates);
            add_scaled(&mut outputs, changes[k], &slopes[k].outputs);
        }
        (rates, outputs)
    }
}

impl<const NX: usize, E: InGusts<NX>, M: Fn(usize) -> [f64; OUTPUTS]> WithSimd
    for ErrorPropagation<'_, NX, E, M>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (patterns, pattern_of) = self.patterns;
        let mut state = [0.0; NX];
        for (k, step) in self.steps.iter().enumerate() {
            let pattern = usize::from(pattern_of[k]);
            let (used, gain) = (&patterns[pattern].used, &self.gains[pattern]);
            let (rates, outputs) = self.input_changes(k);
            if k > 0 {
                add_scaled(&mut state, self.half_step_s, &rates);
            }
            let mut innovations = [0.0; OUTPUTS];
            let predicted = times(&step.outputs, &state);
            let measured = (self.measured)(k);
            for o in (0..OUTPUTS).filter(|o| used[*o]) {
                innovations[o] = measured[o] - outputs[o] - predicted[o];
            }
            let white = times(&gain.whitening, &innovations);
            self.white[k * OUTPUTS..][..OUTPUTS].copy_from_slice(&white);
            add_scaled(&mut state, 1.0, &times(&gain.gain, &innovations));
            let decayed = E::decayed(SVector::from(state), self.decay);
            state = decayed.data.0[0];
            add_scaled(&mut state, self.half_step_s, &rates);
            state = times(&step.transition, &state);
        }
    }
}

/// Product of a matrix and a vector.
#[inline(always)]
fn times<const N: usize, const M: usize>(
    matrix: &SMatrix<f64, N, M>,
    vector: &[f64; M],
) -> [f64; N] {
    let mut product = [0.0; N];
    for (column, entry) in matrix.data.0.iter().zip(vector) {
        for i in 0..N {
            product[i] = column[i].mul_add(*entry, product[i]);
        }
    }
    product
}

/// Adds a vector times a factor.
#[inline(always)]
fn add_scaled<const N: usize>(sum: &mut [f64; N], factor: f64, vector: &[f64; N]) {
    for i in 0..N {
        sum[i] = vector[i].mul_add(factor, sum[i]);
    }
}
