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
//! therefore serve all errors of the signal: its bias, its scale and its delay. The slopes change as
//! slowly as the aircraft moves: they are computed at *nodes* and interpolated between them.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::array::from_fn;
use std::collections::BTreeMap;
use std::marker::PhantomData;

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
use crate::numerics::series::sample_count::whole_steps;
use crate::numerics::vectors::lanes::Lanes;
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR};
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
        let stride = whole_steps(SLOPE_STEP_S, self.case.step_s).max(1);
        let nodes = NodeEquations::new(&self.case, recorded, &values, stride);
        let changes = nodes.signal_changes(recorded, errors);
        let at_nodes = pass.steps.iter().step_by(stride);
        let states: Vec<_> = at_nodes.map(|step| step.corrected).collect();
        let slopes = nodes.slopes_along(recorded, &changes, &states);
        let mut white = AlignedMatrix::zeros(OUTPUTS * self.samples(), errors.len());
        for first in (0..errors.len()).step_by(ABREAST) {
            let group = first..errors.len().min(first + ABREAST);
            Arch::new().dispatch(ErrorPropagation::<NX, E> {
                steps: &pass.steps,
                gains: &gains,
                patterns: self.patterns(),
                decay: self.noise(parameters).decay(self.case.step_s),
                half_step_s: 0.5 * self.case.step_s,
                inputs: inputs_in_error(&slopes, &changes[group.clone()], self.samples()),
                outputs: OutputErrors::of::<NX, E>(&errors[group]),
                measured: &self.case.measurements.values,
                white: &mut white,
                first,
                equations: PhantomData,
            });
        }
        let lanes = white.transposed_product(&pass.rows);
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

/// Longest distance between nodes, s.
const SLOPE_STEP_S: f64 = 0.1;

/// Number of errors that are propagated side by side, in the lanes of a vector.
const ABREAST: usize = VECTOR;

/// One signal that some of the errors of a group change.
struct SignalInError<'a, const NX: usize> {
    name: &'a str,
    /// Slopes of rates and outputs along the signal at the samples.
    slopes: &'a [RatesAndOutputs<NX>],
    /// Changes of the signal: sample by sample, error by error.
    changes: AlignedBuffer,
}

/// Signals that the errors of a group change.
fn inputs_in_error<'a, const NX: usize>(
    slopes: &'a BTreeMap<String, Vec<RatesAndOutputs<NX>>>,
    errors: &'a [Vec<SignalChange>],
    samples: usize,
) -> Vec<SignalInError<'a, NX>> {
    let mut inputs: Vec<SignalInError<NX>> = vec![];
    for (error, changes) in errors.iter().enumerate() {
        for change in changes {
            let Some(slopes) = slopes.get(&change.signal) else {
                continue;
            };
            let known = inputs.iter().position(|own| own.name == change.signal);
            let place = known.unwrap_or(inputs.len());
            if known.is_none() {
                inputs.push(SignalInError {
                    name: &change.signal,
                    slopes,
                    changes: AlignedBuffer::zeros(ABREAST * samples),
                });
            }
            let rows = inputs[place].changes.slice_mut().chunks_exact_mut(ABREAST);
            for (row, value) in rows.zip(&change.samples) {
                row[error] = *value;
            }
        }
    }
    inputs
}

/// Errors of the measured outputs: output by output, error by error.
struct OutputErrors {
    scales: AlignedBuffer,
    biases: AlignedBuffer,
}

impl OutputErrors {
    fn of<const NX: usize, E: Equations<NX>>(errors: &[SignalError]) -> OutputErrors {
        let outputs = E::AXIS.outputs();
        let zeros = || AlignedBuffer::zeros(ABREAST * OUTPUTS);
        let (mut scales, mut biases) = (zeros(), zeros());
        for (error, own) in errors.iter().enumerate() {
            if let Some(o) = outputs.iter().position(|o| o.signal() == own.signal) {
                scales.slice_mut()[o * ABREAST + error] = own.scale;
                biases.slice_mut()[o * ABREAST + error] = own.bias;
            }
        }
        OutputErrors { scales, biases }
    }
}

/// Rates and outputs at an instant, or their slopes along a signal.
struct RatesAndOutputs<const NX: usize> {
    rates: [f64; NX],
    outputs: [f64; OUTPUTS],
}

impl<const NX: usize> RatesAndOutputs<NX> {
    /// Replaces values after a step of a signal by the slopes along the signal.
    fn become_slope_from(&mut self, before: &RatesAndOutputs<NX>, step: f64) {
        let rates = self.rates.iter_mut().zip(&before.rates);
        let outputs = self.outputs.iter_mut().zip(&before.outputs);
        rates
            .chain(outputs)
            .for_each(|(value, before)| *value = (*value - before) / step);
    }

    /// Values at a share of the way to others.
    fn towards(&self, others: &RatesAndOutputs<NX>, share: f64) -> RatesAndOutputs<NX> {
        let between = |from: f64, to: f64| from + share * (to - from);
        RatesAndOutputs {
            rates: from_fn(|i| between(self.rates[i], others.rates[i])),
            outputs: from_fn(|o| between(self.outputs[o], others.outputs[o])),
        }
    }
}

/// Values at all samples, from those at every `stride`-th one.
fn at_samples<const NX: usize>(
    nodes: &[RatesAndOutputs<NX>],
    stride: usize,
    samples: usize,
) -> Vec<RatesAndOutputs<NX>> {
    let mut values = Vec::with_capacity(samples);
    for (node, from) in nodes.iter().enumerate() {
        let to = nodes.get(node + 1).unwrap_or(from);
        for after in 0..stride.min(samples - values.len()) {
            values.push(from.towards(to, after as f64 / stride as f64));
        }
    }
    values
}

/// Equations of a maneuver at its nodes, with all derivatives held at their values.
struct NodeEquations<'a, const NX: usize, E: Equations<NX>> {
    /// Samples from one node to the next.
    stride: usize,
    signals: ManeuverSignals,
    model: Model<'a>,
    /// Maneuver as recorded.
    exact: Case<NX, E>,
}

impl<'a, const NX: usize, E: Equations<NX>> NodeEquations<'a, NX, E> {
    /// Every `stride`-th sample is a node.
    fn new(
        case: &Case<NX, E>,
        recorded: &Recorded<'a>,
        values: &BTreeMap<&str, f64>,
        stride: usize,
    ) -> Self {
        let value = |name: &str| values.get(name).copied().unwrap_or(0.0);
        let free = recorded.model.free.iter().map(|d| (*d, value(&d.name)));
        let model = Model {
            held: free.chain(recorded.model.held.iter().copied()).collect(),
            initial_state: InitialState::Measured,
            ..Model::default()
        };
        let signals = recorded.signals.at_every(stride);
        let windows = [recorded.signals, &signals];
        let nothing = Measurements::default();
        NodeEquations {
            stride,
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

    /// Slopes of rates and outputs along each signal that changes, at all samples. `states` are those of
    /// the nodes. The step of a signal is its largest change.
    fn slopes_along(
        &self,
        recorded: &Recorded,
        changes: &[Vec<SignalChange>],
        states: &[SVector<f64, NX>],
    ) -> BTreeMap<String, Vec<RatesAndOutputs<NX>>> {
        let mut largest: BTreeMap<&String, f64> = BTreeMap::new();
        for change in changes.iter().flatten() {
            let size = largest.entry(&change.signal).or_default();
            *size = size.max(change.largest());
        }
        let exact = evaluate(&self.exact, states);
        let slopes = |(signal, size): (&String, f64)| {
            let mut values = evaluate(&self.case_with_bias(recorded, signal, size), states);
            for (values, exact) in values.iter_mut().zip(&exact) {
                values.become_slope_from(exact, size);
            }
            let samples = recorded.signals.samples;
            (signal.clone(), at_samples(&values, self.stride, samples))
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

/// Rates and outputs of a case at states.
fn evaluate<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    states: &[SVector<f64, NX>],
) -> Vec<RatesAndOutputs<NX>> {
    Arch::new().dispatch(Evaluation { case, states })
}

/// Rates and outputs along states, compiled for the processor at hand.
struct Evaluation<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    states: &'a [SVector<f64, NX>],
}

impl<const NX: usize, E: Equations<NX>> WithSimd for Evaluation<'_, NX, E> {
    type Output = Vec<RatesAndOutputs<NX>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<RatesAndOutputs<NX>> {
        let motion = &self.case.motion;
        let mut values = Vec::with_capacity(self.states.len());
        for (k, x) in self.states.iter().enumerate() {
            let c = self.case.held.at(k).coefficients(x);
            let inputs = &motion.rate_inputs[k];
            let outputs = E::outputs(inputs, &motion.sensor_inputs[k], x, &c).outputs;
            values.push(RatesAndOutputs {
                rates: E::rates(inputs, x, &c).rates.data.0[0],
                outputs: outputs.data.0[0],
            });
        }
        values
    }
}

/// Linear response of a filter to a group of errors side by side.
struct ErrorPropagation<'a, const NX: usize, E: InGusts<NX>> {
    steps: &'a [RecordedStep<NX>],
    gains: &'a [PatternGain<NX>],
    /// Patterns, and the pattern of each sample.
    patterns: (&'a [Pattern], &'a [u8]),
    decay: f64,
    half_step_s: f64,
    inputs: Vec<SignalInError<'a, NX>>,
    outputs: OutputErrors,
    /// Measured outputs at each sample.
    measured: &'a [[f64; OUTPUTS]],
    /// Changes of the whitened innovations: sample by sample, output by output a row; each error a
    /// column.
    white: &'a mut AlignedMatrix,
    /// Column of the first error.
    first: usize,
    equations: PhantomData<E>,
}

impl<const NX: usize, E: InGusts<NX>> ErrorPropagation<'_, NX, E> {
    /// Propagates the errors in the lanes of one vector, from a lane on.
    #[inline(always)]
    fn propagate<S: Simd>(&mut self, simd: S, lane: usize) {
        let (patterns, pattern_of) = self.patterns;
        let (zero, width) = (Lanes::zero(simd), self.white.width());
        let mut state = [zero; NX];
        for (k, step) in self.steps.iter().enumerate() {
            let pattern = usize::from(pattern_of[k]);
            let (used, gain) = (&patterns[pattern].used, &self.gains[pattern]);
            let (rates, outputs) = self.input_changes(simd, k, lane);
            if k > 0 {
                add_scaled(&mut state, self.half_step_s, &rates);
            }
            let predicted = times(&step.outputs, &state, zero);
            let mut innovations = [zero; OUTPUTS];
            for o in 0..OUTPUTS {
                if used[o] {
                    let row = o * ABREAST + lane;
                    let scale = Lanes::load(simd, self.outputs.scales.slice(), row);
                    let bias = Lanes::load(simd, self.outputs.biases.slice(), row);
                    let measured = scale * self.measured[k][o] + bias;
                    innovations[o] = measured - outputs[o] - predicted[o];
                }
            }
            let rows = &mut self.white.values_mut()[k * OUTPUTS * width..][..OUTPUTS * width];
            for o in 0..OUTPUTS {
                // L⁻¹ is a lower triangle.
                let mut white = zero;
                for p in 0..=o {
                    white = white.plus(gain.whitening[(o, p)], innovations[p]);
                }
                white.store(rows, o * width + self.first + lane);
            }
            add_scaled(&mut state, 1.0, &times(&gain.gain, &innovations, zero));
            for &(rate, relative) in E::AIR_RELATIVE_RATES {
                state[relative] = state[rate] + (state[relative] - state[rate]) * self.decay;
            }
            add_scaled(&mut state, self.half_step_s, &rates);
            state = times(&step.transition, &state, zero);
        }
    }

    /// Changes of rates and outputs at a sample.
    #[inline(always)]
    fn input_changes<S: Simd>(
        &self,
        simd: S,
        k: usize,
        lane: usize,
    ) -> ([Lanes<S>; NX], [Lanes<S>; OUTPUTS]) {
        let zero = Lanes::zero(simd);
        let (mut rates, mut outputs) = ([zero; NX], [zero; OUTPUTS]);
        for input in &self.inputs {
            let change = Lanes::load(simd, input.changes.slice(), k * ABREAST + lane);
            let slopes = &input.slopes[k];
            for i in 0..NX {
                rates[i] = rates[i].plus(slopes.rates[i], change);
            }
            for o in 0..OUTPUTS {
                outputs[o] = outputs[o].plus(slopes.outputs[o], change);
            }
        }
        (rates, outputs)
    }
}

impl<const NX: usize, E: InGusts<NX>> WithSimd for ErrorPropagation<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for lane in (0..ABREAST).step_by(S::F64_LANES) {
            self.propagate(simd, lane);
        }
    }
}

/// Product of a matrix and a vector of each error.
#[inline(always)]
fn times<S: Simd, const N: usize, const M: usize>(
    matrix: &SMatrix<f64, N, M>,
    vector: &[Lanes<S>; M],
    zero: Lanes<S>,
) -> [Lanes<S>; N] {
    let mut product = [zero; N];
    for j in 0..M {
        for i in 0..N {
            product[i] = product[i].plus(matrix[(i, j)], vector[j]);
        }
    }
    product
}

/// Adds a vector of each error times a factor.
#[inline(always)]
fn add_scaled<S: Simd, const N: usize>(
    sum: &mut [Lanes<S>; N],
    factor: f64,
    vector: &[Lanes<S>; N],
) {
    for i in 0..N {
        sum[i] = sum[i].plus(factor, vector[i]);
    }
}
