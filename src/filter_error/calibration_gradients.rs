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
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

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
use crate::output_error::calibration_errors::SignalError;
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
        let exact = evaluate(&samples.exact, &pass.steps);
        let mut changes = AlignedMatrix::zeros(errors.len(), OUTPUTS * self.samples());
        for (error, changes) in errors.iter().zip(changes.rows_mut()) {
            let in_error = samples.case_with_error(recorded, error);
            let in_error = in_error.map(|case| evaluate(&case, &pass.steps));
            Arch::new().dispatch(ErrorPropagation::<NX, E, _> {
                steps: &pass.steps,
                gains: &gains,
                patterns: self.patterns(),
                decay: self.noise(parameters).decay(self.case.step_s),
                half_step_s: 0.5 * self.case.step_s,
                inputs: [&exact, in_error.as_ref().unwrap_or(&exact)],
                measured: output_errors::<NX, E>(&self.case.measurements, error),
                changes,
                equations: std::marker::PhantomData,
            });
        }
        let lanes = changes.product(&pass.rows);
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

/// Rates and outputs at a sample.
struct SampleValues<const NX: usize> {
    rates: [f64; NX],
    outputs: [f64; OUTPUTS],
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

    /// Maneuver as an instrument in error would have recorded it; `None` if the equations do not
    /// read the instrument.
    fn case_with_error(&self, recorded: &Recorded, error: &SignalError) -> Option<Case<NX, E>> {
        if !self.reads(error.signal) {
            return None;
        }
        let signals = if error.delay_s == 0.0 {
            error.apply_to(&self.signals)
        } else {
            // A delay needs the slope of the signal, and that the points between samples.
            let delayed = error.apply_to(recorded.signals);
            self.signals.with_samples_of(error.signal, &delayed)
        };
        let windows = [&self.signals, &signals];
        let nothing = Measurements::default();
        let case = self
            .exact
            .as_recorded(recorded.aircraft, windows, nothing, &self.model);
        Some(case)
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
    /// Rates and outputs as recorded, and with the error.
    inputs: [&'a [SampleValues<NX>]; 2],
    /// Change of the measured outputs at a sample.
    measured: M,
    /// Changes of the whitened innovations: sample by sample, output by output.
    changes: &'a mut [f64],
    equations: std::marker::PhantomData<E>,
}

impl<const NX: usize, E: InGusts<NX>, M: Fn(usize) -> [f64; OUTPUTS]>
    ErrorPropagation<'_, NX, E, M>
{
    /// Changes of rates and outputs at a sample.
    #[inline(always)]
    fn input_changes(&self, k: usize) -> ([f64; NX], [f64; OUTPUTS]) {
        let [exact, in_error] = self.inputs.map(|values| &values[k]);
        let (mut rates, mut outputs) = ([0.0; NX], [0.0; OUTPUTS]);
        for i in 0..NX {
            rates[i] = in_error.rates[i] - exact.rates[i];
        }
        for o in 0..OUTPUTS {
            outputs[o] = in_error.outputs[o] - exact.outputs[o];
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
            self.changes[k * OUTPUTS..][..OUTPUTS].copy_from_slice(&white);
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
