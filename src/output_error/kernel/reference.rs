//! The pass in plain scalar code: the same results as the kernel, without vectors or shared
//! regressors.
//!
//! Read this first. The tests compare the kernel with it on both axes, and `cargo bench --bench
//! kernel` times the two side by side.

use std::marker::PhantomData;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use crate::aero::{Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{COEFFICIENTS, Equations, Longitudinal, Motion, OUTPUTS};
use crate::numerics::runge_kutta::{self, POINT};
use crate::output_error::case::{Case, InitialState, Measurements, Model};
use crate::units::DEG;

/// Plain pass over one maneuver.
#[derive(Debug)]
pub struct Reference<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    signals: &'a ManeuverSignals,
    measurements: &'a Measurements,
    /// Measured motion at samples and halves between them.
    motion: Vec<Motion>,
    /// Free derivatives sorted by coefficient: the first parameters.
    free: Vec<&'a Derivative>,
    held: &'a [(&'a Derivative, f64)],
    /// Output that each bias shifts: the next parameters.
    biased_outputs: &'a [usize],
    initial_state: InitialState,
    start: SVector<f64, NX>,
    equations: PhantomData<E>,
}

/// Outputs, and the sums of the cost (1.2), its gradient (1.4) and second gradient (1.5).
#[derive(Clone, Debug, PartialEq)]
pub struct PlainSums {
    pub outputs: Vec<[f64; OUTPUTS]>,
    /// Sum Σ w v² over outputs and samples, with weights w and residuals v.
    pub weighted_square: f64,
    /// Gradient Σ w s v, with sensitivities s.
    pub gradient: DVector<f64>,
    /// Information Σ w s sᵀ.
    pub information: DMatrix<f64>,
}

impl PlainSums {
    /// Sums over no samples.
    pub(crate) fn zeros(parameters: usize) -> PlainSums {
        PlainSums {
            outputs: vec![],
            weighted_square: 0.0,
            gradient: DVector::zeros(parameters),
            information: DMatrix::zeros(parameters, parameters),
        }
    }
}

/// State with its sensitivities, one for each parameter.
#[derive(Clone)]
pub(crate) struct Augmented<const NX: usize> {
    pub x: SVector<f64, NX>,
    pub s: Vec<SVector<f64, NX>>,
}

/// Coefficients at a point and state.
struct Coefficients<const NX: usize> {
    values: [f64; COEFFICIENTS],
    by_state: SMatrix<f64, COEFFICIENTS, NX>,
    /// Regressor of each free derivative.
    regressors: Vec<f64>,
}

impl<'a, const NX: usize, E: Equations<NX>> Reference<'a, NX, E> {
    /// Pass over the maneuver of a case; aircraft, signals and model must be the ones from which the
    /// case was made.
    #[must_use]
    pub fn new(
        aircraft: &'a Aircraft,
        signals: &'a ManeuverSignals,
        model: &'a Model<'a>,
        case: &'a Case<NX, E>,
    ) -> Self {
        Reference {
            aircraft,
            signals,
            measurements: &case.measurements,
            motion: signals.motion(aircraft).points().collect(),
            free: model.free_in_order(),
            held: &model.held,
            biased_outputs: &case.biased_outputs,
            initial_state: model.initial_state,
            start: case.start,
            equations: PhantomData,
        }
    }

    /// Integrates with these parameters and sums with these weights.
    #[must_use]
    pub fn run(&self, parameters: &[f64], weights: &[f64; OUTPUTS]) -> PlainSums {
        let mut sums = PlainSums::zeros(parameters.len());
        let mut state = self.initial(parameters);
        for sample in 0..self.measurements.values.len() {
            if sample > 0 {
                state = self.step(sample - 1, parameters, &state);
            }
            let (y, slopes) = self.outputs(sample, parameters, &state);
            for o in (0..OUTPUTS).filter(|o| self.measurements.used[sample][*o]) {
                let (w, s) = (weights[o], &slopes[o]);
                let v = self.measurements.values[sample][o] - y[o];
                sums.weighted_square += w * v * v;
                sums.gradient += s * (w * v);
                sums.information += s * s.transpose() * w;
            }
            sums.outputs.push(y);
        }
        sums
    }

    /// State at the first sample; each free initial state depends on itself.
    fn initial(&self, parameters: &[f64]) -> Augmented<NX> {
        let (mut x, mut s) = (self.start, vec![SVector::zeros(); parameters.len()]);
        if self.initial_state == InitialState::Estimated {
            let first = parameters.len() - NX;
            for i in 0..NX {
                x[i] = parameters[first + i];
                s[first + i][i] = 1.0;
            }
        }
        Augmented { x, s }
    }

    /// Runge-Kutta step from a sample to the next one.
    pub(crate) fn step(
        &self,
        sample: usize,
        parameters: &[f64],
        from: &Augmented<NX>,
    ) -> Augmented<NX> {
        let slope = |stage: usize, at: &Augmented<NX>| {
            self.rates(2 * sample + POINT[stage], parameters, at)
        };
        runge_kutta::step(from, self.signals.step_s, slope, Augmented::plus)
    }

    /// Rates of the states (2.1-2.3, 3.1-3.4) and of their sensitivities s to each derivative. Let
    /// A be the slopes of the rates along the states, B_k the slopes along the derivative's
    /// coefficient k, and r the derivative's regressor. Then ṡ = A s + B_k r.
    fn rates(&self, point: usize, parameters: &[f64], at: &Augmented<NX>) -> Augmented<NX> {
        let c = self.coefficients(point, parameters, &at.x);
        let inputs = E::rate_inputs(self.aircraft, &self.motion[point]);
        let rates = E::rates(&inputs, &at.x, &c.values);
        let a = rates.by_state + rates.by_coefficient * c.by_state;
        let mut s: Vec<SVector<f64, NX>> = at.s.iter().map(|s| a * s).collect();
        for ((s, d), r) in s.iter_mut().zip(&self.free).zip(&c.regressors) {
            *s += rates.by_coefficient.column(d.coefficient.index()) * *r;
        }
        Augmented { x: rates.rates, s }
    }

    /// Outputs at a sample (2.7-2.9, 3.7, 3.8) and their slopes along the parameters, C s + D_k r.
    /// C are the slopes of the outputs along the states, and D_k those along the coefficient k.
    pub(crate) fn outputs(
        &self,
        sample: usize,
        parameters: &[f64],
        at: &Augmented<NX>,
    ) -> ([f64; OUTPUTS], [DVector<f64>; OUTPUTS]) {
        let motion = &self.motion[2 * sample];
        let c = self.coefficients(2 * sample, parameters, &at.x);
        let inputs = E::rate_inputs(self.aircraft, motion);
        let sensors = E::sensor_inputs(self.aircraft, motion);
        let read = E::outputs(&inputs, &sensors, &at.x, &c.values);
        let by_state = read.by_state + read.by_coefficient * c.by_state;
        let mut y: [f64; OUTPUTS] = read.outputs.into();
        let mut slopes: [DVector<f64>; OUTPUTS] = std::array::from_fn(|o| {
            DVector::from_iterator(at.s.len(), at.s.iter().map(|s| (by_state.row(o) * s)[0]))
        });
        for (j, (d, r)) in self.free.iter().zip(&c.regressors).enumerate() {
            for (o, slopes) in slopes.iter_mut().enumerate() {
                slopes[j] += read.by_coefficient[(o, d.coefficient.index())] * r;
            }
        }
        for (b, &o) in self.biased_outputs.iter().enumerate() {
            let j = self.free.len() + b;
            y[o] += parameters[j];
            slopes[o][j] = 1.0;
        }
        (y, slopes)
    }

    /// Build-up (2.10-2.13, 3.9-3.13): the coefficients c = Σ ξ_j r_j, with derivatives ξ_j and
    /// regressors r_j.
    fn coefficients(
        &self,
        point: usize,
        parameters: &[f64],
        x: &SVector<f64, NX>,
    ) -> Coefficients<NX> {
        let mut c = Coefficients {
            values: [0.0; COEFFICIENTS],
            by_state: SMatrix::zeros(),
            regressors: Vec::with_capacity(self.free.len()),
        };
        for (d, value) in self.free.iter().zip(parameters) {
            let r = self.add_derivative(d, *value, point, x, &mut c);
            c.regressors.push(r);
        }
        for (d, value) in self.held {
            self.add_derivative(d, *value, point, x, &mut c);
        }
        c
    }

    /// Adds one derivative to the coefficients and returns its regressor.
    fn add_derivative(
        &self,
        derivative: &Derivative,
        value: f64,
        point: usize,
        x: &SVector<f64, NX>,
        c: &mut Coefficients<NX>,
    ) -> f64 {
        let (k, motion) = (derivative.coefficient.index(), &self.motion[point]);
        let state = |part: &Regressor| E::state_regressor(self.aircraft, motion.velocity, part);
        let factor = derivative
            .regressor
            .factor(&|part| state(part).map(|(_, factor)| factor), &|part| {
                self.measured(part, derivative, point)
            });
        let regressor = match derivative.regressor.find(E::state_of).zip(factor) {
            Some((i, factor)) => {
                c.by_state[(k, i)] += value * factor;
                factor * x[i]
            }
            None => derivative
                .regressor
                .value(&|part| self.measured(part, derivative, point)),
        };
        c.values[k] += value * regressor;
        regressor
    }

    /// Part of a derivative's regressor, from the measured motion.
    fn measured(&self, part: &Regressor, derivative: &Derivative, point: usize) -> f64 {
        let (aircraft, m) = (self.aircraft, &self.motion[point]);
        match part {
            Regressor::Constant => 1.0,
            Regressor::Alpha => DEG * m.alpha,
            Regressor::Beta => DEG * m.beta,
            Regressor::RollRate => m.rates[0] * aircraft.span_ft / (2.0 * m.velocity),
            Regressor::PitchRate => m.rates[1] * aircraft.chord_ft / (2.0 * m.velocity),
            Regressor::YawRate => m.rates[2] * aircraft.span_ft / (2.0 * m.velocity),
            Regressor::AlphaRate => {
                Longitudinal::alpha_rate(aircraft, m) * aircraft.chord_ft / (2.0 * m.velocity)
            }
            Regressor::Surface(name) | Regressor::Vane(name) => {
                self.signals.signal(name)[point] * derivative.coefficient_factor(aircraft, m.qbar)
            }
            Regressor::Magnitude(_) | Regressor::Product(_) => {
                part.value(&|own| self.measured(own, derivative, point))
            }
        }
    }
}

impl<const NX: usize> Augmented<NX> {
    fn plus(&self, slope: &Self, h: f64) -> Self {
        let s = self.s.iter().zip(&slope.s);
        Augmented {
            x: self.x + slope.x * h,
            s: s.map(|(s, ds)| s + ds * h).collect(),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    use super::*;
    use crate::aero::Axis;
    use crate::dynamics::Lateral;
    use crate::dynamics::tests::aircraft;
    use crate::output_error::likelihood::cost::{Sums, sums};
    use crate::output_error::tests::{
        Noise, SAMPLES, TABLE, biases, measure, nothing_measured, signals, truth, with_products,
    };

    /// Compares kernel and reference away from the true parameters, with noise on the measurements
    /// and samples that do not count. One derivative is held; biases and initial states are free.
    fn assert_kernel_matches_reference<const NX: usize, E: Equations<NX>>(
        truth: &[(Derivative, f64)],
    ) {
        let biases = biases(E::AXIS);
        let ((held, value), free) = truth.split_last().unwrap();
        let model = Model {
            free: free.iter().map(|(d, _)| d).collect(),
            held: vec![(held, *value)],
            biases: biases.iter().collect(),
            initial_state: InitialState::Estimated,
        };
        let (aircraft, signals) = (aircraft(), signals());
        let mut case = Case::<NX, E>::new(&aircraft, &signals, nothing_measured(), &model);
        let value_of = |name: &str| free.iter().find(|(d, _)| d.name == name).unwrap().1;
        let mut parameters = case.starting_values(value_of);
        measure(&mut case, &parameters, &mut Noise(20_261_122), 0.0);
        for k in (0..SAMPLES).filter(|k| k % 7 == 3) {
            case.measurements.used[k][k % OUTPUTS] = false;
        }
        for (j, value) in parameters.iter_mut().enumerate() {
            *value *= 1.0 + 0.01 * (j % 5) as f64;
        }
        let mut response = case.response();
        case.respond(&parameters, &mut response).unwrap();
        let kernel = sums(&response, &TABLE);
        let reference = Reference::new(&aircraft, &signals, &model, &case);
        let plain = reference.run(&parameters, &TABLE);
        for (kernel, plain) in response.outputs.iter().zip(&plain.outputs) {
            assert_abs_diff_eq!(kernel[..], plain[..], epsilon = 1e-10);
        }
        assert_sums_match(&kernel, &plain);
    }

    /// Compares the sums in units of each parameter's own size, 1/√H_jj.
    pub(crate) fn assert_sums_match(kernel: &Sums, plain: &PlainSums) {
        const TOLERANCE: f64 = 1e-10;
        let square = plain.weighted_square;
        assert_relative_eq!(kernel.weighted_square, square, max_relative = TOLERANCE);
        let size = plain.information.diagonal().map(f64::sqrt);
        assert!(size.iter().all(|size| *size > 0.0));
        for i in 0..size.len() {
            let (unit, off) = (
                size[i] * square.sqrt(),
                kernel.gradient[i] - plain.gradient[i],
            );
            assert!(
                off.abs() < TOLERANCE * unit,
                "gradient {i}: {off:e} of {unit:e}"
            );
            for j in 0..size.len() {
                let off = kernel.information[(i, j)] - plain.information[(i, j)];
                let unit = size[i] * size[j];
                assert!(
                    off.abs() < TOLERANCE * unit,
                    "H {i} {j}: {off:e} of {unit:e}"
                );
            }
        }
    }

    #[test]
    fn the_kernel_matches_the_plain_pass_on_the_longitudinal_axis() {
        let axis = Axis::Longitudinal;
        assert_kernel_matches_reference::<3, Longitudinal>(&truth(axis));
        assert_kernel_matches_reference::<3, Longitudinal>(&with_products(axis));
    }

    #[test]
    fn the_kernel_matches_the_plain_pass_on_the_lateral_axis() {
        let axis = Axis::Lateral;
        assert_kernel_matches_reference::<4, Lateral>(&truth(axis));
        assert_kernel_matches_reference::<4, Lateral>(&with_products(axis));
    }
}
