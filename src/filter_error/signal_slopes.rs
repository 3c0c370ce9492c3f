//! Slopes of a maneuver's rates and outputs along its recorded signals, with all derivatives held.
//!
//! Rates and outputs at a sample depend on the signals at this sample alone. Their slopes along a
//! signal therefore serve all errors of the signal: its bias, its scale and its delay. The slopes
//! change as slowly as the aircraft moves. They are computed at *nodes*, from differences, and
//! interpolated between them.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::array::from_fn;
use std::collections::BTreeMap;

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::row_sinks::RecordedStep;
use crate::aero::Derivative;
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::series::sample_count::whole_steps;
use crate::output_error::calibration_errors::{SignalChange, SignalError};
use crate::output_error::{Case, InitialState, Measurements, Model};

/// Longest distance between nodes, s.
const SLOPE_STEP_S: f64 = 0.1;

/// Maneuver as its instruments recorded it.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    pub aircraft: &'a Aircraft,
    pub signals: &'a ManeuverSignals,
    pub model: &'a Model<'a>,
}

/// Rates and outputs at an instant, or their slopes along a signal.
pub(super) struct RatesAndOutputs<const NX: usize> {
    pub rates: [f64; NX],
    pub outputs: [f64; OUTPUTS],
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
pub(super) struct NodeEquations<'a, const NX: usize, E: Equations<NX>> {
    /// Samples from one node to the next.
    stride: usize,
    signals: ManeuverSignals,
    model: Model<'a>,
    /// Maneuver as recorded.
    exact: Case<NX, E>,
}

impl<'a, const NX: usize, E: Equations<NX>> NodeEquations<'a, NX, E> {
    /// Equations with these values of the free derivatives.
    pub fn new(case: &Case<NX, E>, recorded: &Recorded<'a>, values: &BTreeMap<&str, f64>) -> Self {
        let stride = whole_steps(SLOPE_STEP_S, recorded.signals.step_s).max(1);
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
    pub fn signal_changes(
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

    /// Slopes of rates and outputs along each signal that changes, at all samples, at the corrected
    /// states of a filter. The step of a signal is its largest change.
    pub fn slopes_along(
        &self,
        recorded: &Recorded,
        changes: &[Vec<SignalChange>],
        steps: &[RecordedStep<NX>],
    ) -> BTreeMap<String, Vec<RatesAndOutputs<NX>>> {
        let mut largest: BTreeMap<&String, f64> = BTreeMap::new();
        for change in changes.iter().flatten() {
            let size = largest.entry(&change.signal).or_default();
            *size = size.max(change.largest());
        }
        let nodes = steps.iter().step_by(self.stride);
        let states: Vec<_> = nodes.map(|step| step.corrected).collect();
        let exact = evaluate(&self.exact, &states);
        let slopes = |(signal, size): (&String, f64)| {
            let mut values = evaluate(&self.case_with_bias(recorded, signal, size), &states);
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

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn between_nodes_values_lie_on_straight_lines_and_beyond_the_last_they_stay() {
        let node = |value: f64| RatesAndOutputs {
            rates: [value, -2.0 * value],
            outputs: [0.5 * value; OUTPUTS],
        };
        let values = at_samples(&[node(1.0), node(3.0), node(-1.0)], 4, 11);
        let expected = [1.0, 1.5, 2.0, 2.5, 3.0, 2.0, 1.0, 0.0, -1.0, -1.0, -1.0];
        assert_eq!(values.len(), expected.len());
        for (values, expected) in values.iter().zip(expected) {
            let own = [
                values.rates[0],
                values.rates[1],
                values.outputs[OUTPUTS - 1],
            ];
            for (value, factor) in own.into_iter().zip([1.0, -2.0, 0.5]) {
                assert_abs_diff_eq!(value, factor * expected, epsilon = 1e-12);
            }
        }
        let every = at_samples(&[node(1.0), node(3.0)], 1, 2);
        assert_abs_diff_eq!(every[1].rates[0], 3.0);
    }
}
