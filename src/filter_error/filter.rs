//! One maneuver prepared for filter error: cost, its gradient and the information of all
//! parameters.
//!
//! Parameters in order: free derivatives, free biases and initial states, as in output error, then
//! the parameters of the noise ([`NoiseParameter::all`]). The parameters before the noise are the
//! filter's *own* parameters.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{DMatrix, DVector, SVector};
use pulp::{Arch, Simd, WithSimd};

use super::gains::{
    self, Outputs, ParameterSlope, Pattern, PatternGain, steady_variance_slopes, steady_variances,
};
use super::input_noise::InputNoise;
use super::linearised::{Discrete, Linearised};
use super::noise::{Noise, NoiseParameter, NoisePrior, RotaryCost};
use super::pass::{
    Corrections, FilterPass, LaneBlocks, LaneGain, PassOutputs, RecordedRows, RowSink,
};
use super::riccati::{NoisySystem, States, SteadyFilter};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::matrix::AlignedMatrix;
use crate::numerics::simd::AlignedBuffer;
use crate::numerics::small::product;
use crate::output_error::case::blocks::samples_per_block;
use crate::output_error::case::layout::LaneLayout;
use crate::output_error::kernel::normal_equations::NormalSums;
use crate::output_error::{Case, Diverged, InitialState, Measurements, Model, NoisyInputs};
use crate::units::RAD;

/// Maneuver prepared for filter error.
#[derive(Debug)]
pub struct Filter<const NX: usize, E: InGusts<NX>> {
    /// Case in gusts; its biases and initial states are the filter's own.
    pub(super) case: Case<NX, E>,
    layout: LaneLayout,
    linearised: Linearised<NX>,
    input_noise: InputNoise<NX>,
    biased_outputs: Vec<usize>,
    initial_states: usize,
    noise_parameters: Vec<NoiseParameter>,
    patterns: Vec<Pattern>,
    pattern_of: Vec<u8>,
    /// Priors of biases and noise, with the parameter of each.
    priors: Vec<(usize, NoisePrior)>,
    names: Vec<String>,
}

/// Result of one pass of the filter over the maneuver.
#[derive(Clone, Debug)]
pub struct FilterResponse {
    /// Outputs predicted from the earlier samples.
    pub predicted: Vec<[f64; OUTPUTS]>,
    /// Measured minus predicted outputs; zero where a sample does not count.
    pub innovations: Vec<[f64; OUTPUTS]>,
    /// Innovations made white with unit variance.
    pub whitened: Vec<[f64; OUTPUTS]>,
    /// Cost J, priors included.
    pub cost: f64,
    pub(super) sums: NormalSums,
    /// Part of the gradient of −J and of the information that does not come from the innovations'
    /// sensitivities.
    other_gradient: DVector<f64>,
    other_information: DMatrix<f64>,
}

impl FilterResponse {
    /// Gradient of −J.
    #[must_use]
    pub fn gradient(&self) -> DVector<f64> {
        self.sums.gradient(&[1.0; OUTPUTS]) + &self.other_gradient
    }

    /// Expected second gradient of J.
    #[must_use]
    pub fn information(&self) -> DMatrix<f64> {
        self.sums.information(&[1.0; OUTPUTS]) + &self.other_information
    }

    /// Part of the information that comes from the covariance of the innovations and the priors.
    #[must_use]
    pub(super) fn other_information(&self) -> &DMatrix<f64> {
        &self.other_information
    }
}

impl<const NX: usize, E: InGusts<NX>> Filter<NX, E> {
    /// Prepares a maneuver. `biases` has the standard uncertainty of each free bias in order;
    /// `None` where it is unknown.
    #[must_use]
    pub fn new(
        aircraft: &Aircraft,
        window: &Window,
        measurements: Measurements,
        model: &Model,
        biases: &[Option<f64>],
    ) -> Self {
        let case = Case::new(aircraft, window, measurements, &without_own(model));
        Self::of_case(case, model, biases)
    }

    /// Prepares the same maneuver with another model. `window` may have other surfaces.
    #[must_use]
    pub fn with_model(
        &self,
        aircraft: &Aircraft,
        window: &Window,
        model: &Model,
        biases: &[Option<f64>],
    ) -> Self {
        let case = self.case.with_model(aircraft, window, &without_own(model));
        Self::of_case(case, model, biases)
    }

    fn of_case(case: Case<NX, E>, model: &Model, biases: &[Option<f64>]) -> Self {
        let biased_outputs = model.biased_outputs::<NX, E>();
        let initial_states = match model.initial_state {
            InitialState::Estimated => E::own_states(),
            InitialState::Measured => 0,
        };
        let noise_parameters = NoiseParameter::all(E::FELT_RATES.len());
        let others = biased_outputs.len() + initial_states + noise_parameters.len();
        let layout = LaneLayout::dense(&case.terms, E::REGRESSOR_STATES, others);
        let (patterns, pattern_of) = patterns(&case.measurements.used);
        let mut filter = Filter {
            linearised: Linearised::of(&case),
            input_noise: InputNoise::default(),
            case,
            layout,
            biased_outputs,
            initial_states,
            noise_parameters,
            patterns,
            pattern_of,
            priors: vec![],
            names: model.parameter_names(&E::STATES[..E::own_states()]),
        };
        filter.priors = filter.priors(biases);
        filter
    }

    /// Adds noise of the measured inputs; by default the inputs are exact.
    #[must_use]
    pub fn with_noisy_inputs(mut self, inputs: NoisyInputs) -> Self {
        self.case.noisy_inputs = inputs;
        self.input_noise = InputNoise::of(&self.case);
        self
    }

    /// Priors of the biases with known uncertainty, and of the noise.
    fn priors(&self, biases: &[Option<f64>]) -> Vec<(usize, NoisePrior)> {
        let first = self.case.derivatives();
        let of_biases = biases
            .iter()
            .enumerate()
            .filter_map(|(b, deviation)| Some((first + b, NoisePrior::Normal(0.0, (*deviation)?))));
        let of_noise = self.noise_parameters.iter().enumerate();
        let of_noise = of_noise
            .filter_map(|(n, parameter)| Some((self.first_noise() + n, parameter.prior()?)));
        of_biases.chain(of_noise).collect()
    }

    /// Names of the parameters that output error has too, in order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of parameters that output error has too: derivatives, biases, initial states.
    #[must_use]
    pub fn first_noise(&self) -> usize {
        self.case.derivatives() + self.biased_outputs.len() + self.initial_states
    }

    /// Number of all parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.first_noise() + self.noise_parameters.len()
    }

    /// Number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.case.samples()
    }

    /// Noise parameters in order.
    #[must_use]
    pub fn noise_parameters(&self) -> &[NoiseParameter] {
        &self.noise_parameters
    }

    /// Returns true if a sample of an output counts.
    #[must_use]
    pub fn measures(&self, output: usize) -> bool {
        self.patterns.iter().any(|pattern| pattern.used[output])
    }

    /// Noise of these parameters.
    #[must_use]
    pub fn noise(&self, parameters: &[f64]) -> Noise {
        Noise::of_parameters(&parameters[self.first_noise()..], E::FELT_RATES.len())
    }

    /// Joins the filter's own parameters with the parameters of a noise.
    #[must_use]
    pub fn with_noise(&self, own: &[f64], noise: &Noise) -> Vec<f64> {
        [own, &noise.parameters(E::FELT_RATES.len())].concat()
    }

    /// Runs the filter over the maneuver: innovations, their sensitivities to all parameters, and the
    /// sums of cost, gradient and information.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or the filter has no finite gain.
    pub fn respond(&self, parameters: &[f64]) -> Result<FilterResponse, Diverged> {
        let gains = self.gains(parameters)?;
        let mut response = self.empty_response();
        let mut sums = NormalSums::new(
            &self.layout,
            self.case.derivatives(),
            &[],
            self.samples(),
            samples_per_block(self.case.step_s),
        );
        sums.clear(1);
        self.run(parameters, &gains, &mut response, Some(&mut sums))?;
        response.sums = sums;
        self.add_covariance_part(parameters, &gains, &mut response);
        Ok(response)
    }

    /// Computes the innovations alone, whitened with the gains of these parameters.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or the filter has no finite gain.
    pub fn innovations(&self, parameters: &[f64]) -> Result<FilterResponse, Diverged> {
        let gains = self.gains(parameters)?;
        let mut response = self.empty_response();
        self.run(parameters, &gains, &mut response, None::<&mut NormalSums>)?;
        self.add_covariance_part(parameters, &gains, &mut response);
        Ok(response)
    }

    /// Integrates the equations without gusts, but lets the angle of the air follow the vane. The
    /// gain is that of a random walk as large as the gusts ([`Noise::angle_gain`]). Returns the
    /// outputs.
    ///
    /// A prediction from one sample to the next follows any motion. These outputs follow the motion
    /// only as far as the derivatives explain it, in turbulence too.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds.
    pub fn outputs_along_air(&self, parameters: &[f64]) -> Result<Vec<[f64; OUTPUTS]>, Diverged> {
        let mut gain = PatternGain::none();
        gain.gain[(E::ANGLE, E::VANE)] = RAD * self.noise(parameters).angle_gain(E::VANE);
        let gains = vec![gain; self.patterns.len()];
        let mut corrections = self.corrections(parameters, &gains);
        corrections.decay = 0.0;
        let mut response = self.empty_response();
        let no_sums = None::<&mut NormalSums>;
        self.run_on(&self.case, parameters, &corrections, &mut response, no_sums)?;
        Ok(response.predicted)
    }

    fn empty_response(&self) -> FilterResponse {
        let (samples, parameters) = (self.samples(), self.parameters());
        FilterResponse {
            predicted: vec![[0.0; OUTPUTS]; samples],
            innovations: vec![[0.0; OUTPUTS]; samples],
            whitened: vec![[0.0; OUTPUTS]; samples],
            cost: 0.0,
            sums: NormalSums::default(),
            other_gradient: DVector::zeros(parameters),
            other_information: DMatrix::zeros(parameters, parameters),
        }
    }

    fn run<K: RowSink>(
        &self,
        parameters: &[f64],
        gains: &[PatternGain<NX>],
        response: &mut FilterResponse,
        sink: Option<&mut K>,
    ) -> Result<(), Diverged> {
        let corrections = self.corrections(parameters, gains);
        self.run_on(&self.case, parameters, &corrections, response, sink)
    }

    /// Runs a pass on a case of the same maneuver, whose instruments may be in error.
    fn run_on<K: RowSink>(
        &self,
        case: &Case<NX, E>,
        parameters: &[f64],
        corrections: &Corrections<NX>,
        response: &mut FilterResponse,
        sink: Option<&mut K>,
    ) -> Result<(), Diverged> {
        Arch::new().dispatch(FilterPass {
            case,
            layout: &self.layout,
            terms: case.valued_terms(parameters).collect(),
            start: self.start(parameters),
            start_sensitivities: self.start_sensitivities(),
            corrections,
            outputs: PassOutputs {
                predicted: &mut response.predicted,
                innovations: &mut response.innovations,
                whitened: &mut response.whitened,
            },
            sink,
        })
    }

    fn corrections(&self, parameters: &[f64], gains: &[PatternGain<NX>]) -> Corrections<'_, NX> {
        let noise = self.noise(parameters);
        let lane_gain = |gain: &PatternGain<NX>| LaneGain::new(gain, &self.layout);
        Corrections {
            gains: gains.iter().map(lane_gain).collect(),
            patterns: &self.patterns,
            pattern_of: &self.pattern_of,
            biases: self.biases(parameters),
            bias_rows: self.bias_rows(),
            decay: noise.decay(self.case.step_s),
            decay_row: self.decay_row(&noise),
        }
    }

    /// Changes of the gradient of the filter's own parameters when the maneuver is recorded as in
    /// each of these cases, at the same gain.
    ///
    /// # Errors
    /// [`Diverged`] when the state of a case leaves its bounds.
    pub fn gradient_shifts(
        &self,
        parameters: &[f64],
        cases: impl Iterator<Item = Case<NX, E>>,
    ) -> Result<Vec<DVector<f64>>, Diverged> {
        let gains = self.gains(parameters)?;
        let corrections = self.corrections(parameters, &gains);
        let mut rows = RecordedRows::new(self.samples(), self.layout.width());
        let (mut exact, mut misread) = (self.empty_response(), self.empty_response());
        self.run_on(
            &self.case,
            parameters,
            &corrections,
            &mut exact,
            Some(&mut rows),
        )?;
        let mut shifts = Vec::new();
        for case in cases {
            let no_rows = None::<&mut RecordedRows>;
            self.run_on(&case, parameters, &corrections, &mut misread, no_rows)?;
            for (u, exact) in misread.whitened.iter_mut().zip(&exact.whitened) {
                for o in 0..OUTPUTS {
                    u[o] -= exact[o];
                }
            }
            let lanes = rows.weighted_sum(&misread.whitened);
            let own = (0..self.first_noise()).map(|j| lanes[self.lane(j)]);
            shifts.push(DVector::from_iterator(self.first_noise(), own));
        }
        Ok(shifts)
    }

    /// Case of this maneuver as other instruments would have recorded it. `windows` are the window
    /// of this filter and the window that the other instruments recorded.
    #[must_use]
    pub fn as_recorded(
        &self,
        aircraft: &Aircraft,
        windows: [&Window; 2],
        measurements: Measurements,
        model: &Model,
    ) -> Case<NX, E> {
        let model = without_own(model);
        self.case
            .as_recorded(aircraft, windows, measurements, &model)
    }

    pub(super) fn biases(&self, parameters: &[f64]) -> [f64; OUTPUTS] {
        let mut biases = [0.0; OUTPUTS];
        let values = &parameters[self.case.derivatives()..];
        for (&o, bias) in self.biased_outputs.iter().zip(values) {
            biases[o] += bias;
        }
        biases
    }

    /// Lane of a parameter.
    fn lane(&self, parameter: usize) -> usize {
        self.layout.parameter_lanes[parameter]
    }

    fn bias_rows(&self) -> LaneBlocks {
        let mut rows = LaneBlocks::zeros(OUTPUTS, self.layout.width());
        for (b, &o) in self.biased_outputs.iter().enumerate() {
            rows.set(o, self.lane(self.case.derivatives() + b), 1.0);
        }
        rows
    }

    fn decay_row(&self, noise: &Noise) -> AlignedBuffer {
        let mut row = AlignedBuffer::zeros(self.layout.width());
        for (n, parameter) in self.noise_parameters.iter().enumerate() {
            let lane = self.lane(self.first_noise() + n);
            row.slice_mut()[lane] = noise.decay_slope(*parameter, self.case.step_s);
        }
        row
    }

    /// State at the first sample, without rotary gusts.
    fn start(&self, parameters: &[f64]) -> SVector<f64, NX> {
        if self.initial_states == 0 {
            return self.case.start;
        }
        let first = self.first_noise() - self.initial_states;
        let mut x = SVector::zeros();
        for i in 0..self.initial_states {
            x[i] = parameters[first + i];
        }
        for &(rate, felt) in E::FELT_RATES {
            x[felt] = x[rate];
        }
        x
    }

    fn start_sensitivities(&self) -> AlignedBuffer {
        let width = self.layout.width();
        let mut rows = AlignedBuffer::zeros(NX * width);
        let first = self.first_noise() - self.initial_states;
        for i in 0..self.initial_states {
            let lane = self.lane(first + i);
            let felt = E::FELT_RATES.iter().find(|(rate, _)| *rate == i);
            rows.slice_mut()[i * width + lane] = 1.0;
            if let Some((_, felt)) = felt {
                rows.slice_mut()[felt * width + lane] = 1.0;
            }
        }
        rows
    }

    /// Gains of all patterns with their slopes.
    fn gains(&self, parameters: &[f64]) -> Result<Vec<PatternGain<NX>>, Diverged> {
        let gains = Arch::new().dispatch(GainsAt {
            filter: self,
            parameters,
        });
        gains.ok_or(Diverged { sample: 0 })
    }

    #[inline(always)]
    fn compute_gains(&self, parameters: &[f64]) -> Option<Vec<PatternGain<NX>>> {
        let noise = self.noise(parameters);
        let step_s = self.case.step_s;
        let decay = decay_matrix::<NX, E>(noise.decay(step_s));
        let (discrete, by_derivative) = self.linearised.discrete(parameters);
        let derivatives = &parameters[..self.case.derivatives()];
        let (of_inputs, of_inputs_slopes) = self.input_noise.covariance(derivatives);
        let system = NoisySystem {
            a: product(&discrete.step, &decay),
            c: discrete.outputs,
            q: noise.covariance::<NX, E>(step_s) + of_inputs,
            r: steady_variances(&noise, &self.patterns),
        };
        let mut slopes = Vec::with_capacity(self.parameters());
        for (parameter, (slope, q)) in by_derivative.iter().zip(of_inputs_slopes).enumerate() {
            slopes.push(ParameterSlope {
                parameter,
                system: derivative_slope(slope, q, &decay),
            });
        }
        let first = self.first_noise();
        let kinds = self.noise_parameters.iter().enumerate();
        let numbered: Vec<(usize, NoiseParameter)> = kinds.map(|(n, p)| (first + n, *p)).collect();
        for (parameter, kind) in &numbered {
            slopes.push(ParameterSlope {
                parameter: *parameter,
                system: self.noise_slope(&noise, *kind, &discrete),
            });
        }
        let is_still = noise.is_still() && self.input_noise.is_zero();
        let filter = if is_still {
            SteadyFilter::still(system)
        } else {
            SteadyFilter::solve_system(system)?
        };
        gains::gains(&filter, &noise, &slopes, &numbered, &self.patterns)
    }

    /// Slope of the system along a parameter of the noise.
    #[inline(always)]
    fn noise_slope(
        &self,
        noise: &Noise,
        kind: NoiseParameter,
        discrete: &Discrete<NX>,
    ) -> NoisySystem<NX> {
        let step_s = self.case.step_s;
        let slope = noise.decay_slope(kind, step_s);
        NoisySystem {
            a: product(&discrete.step, &decay_matrix_slope::<NX, E>(slope)),
            c: nalgebra::SMatrix::zeros(),
            q: noise.covariance_slope::<NX, E>(kind, step_s),
            r: steady_variance_slopes(noise, &self.patterns, kind),
        }
    }

    /// Adds the parts of cost, gradient and information that come from log|S|, the slopes of S, and
    /// the priors.
    fn add_covariance_part(
        &self,
        parameters: &[f64],
        gains: &[PatternGain<NX>],
        response: &mut FilterResponse,
    ) {
        let squares: f64 = response.whitened.iter().flatten().map(|u| u * u).sum();
        response.cost = 0.5 * squares;
        for (number, (pattern, gain)) in self.patterns.iter().zip(gains).enumerate() {
            let samples = pattern.samples as f64;
            response.cost += 0.5 * samples * gain.log_determinant;
            let products = self.innovation_products(number, &response.innovations);
            let excess = Outputs::identity() * samples - gain.inverse * products;
            let traces = covariance_traces(gain, &excess);
            let mut rows = traces.rows();
            for (own, row) in gain.slopes.iter().zip(&mut rows) {
                for (other, trace) in gain.slopes.iter().zip(row) {
                    let information = &mut response.other_information;
                    information[(own.parameter, other.parameter)] += 0.5 * samples * trace;
                }
            }
            for (slope, trace) in gain.slopes.iter().zip(rows.flatten()) {
                response.other_gradient[slope.parameter] -= 0.5 * trace;
            }
        }
        for gust in 0..E::FELT_RATES.len() {
            let cost = self.noise(parameters).rotary_cost(gust, self.case.step_s);
            if let Some(cost) = cost {
                self.add_rotary_cost(&cost, response);
            }
        }
        for (j, prior) in &self.priors {
            let [cost, slope, curvature] = prior.cost(parameters[*j]);
            response.cost += cost;
            response.other_gradient[*j] -= slope;
            response.other_information[(*j, *j)] += curvature;
        }
    }

    fn add_rotary_cost(&self, rotary: &RotaryCost, response: &mut FilterResponse) {
        response.cost += rotary.cost;
        let place = |kind: NoiseParameter| {
            let place = self.noise_parameters.iter().position(|p| *p == kind);
            self.first_noise() + place.unwrap_or(0)
        };
        let along = rotary.along.map(|(kind, slope)| (place(kind), slope));
        for (i, a) in along {
            response.other_gradient[i] -= rotary.slope * a;
            for (j, b) in along {
                response.other_information[(i, j)] += rotary.curvature * a * b;
            }
        }
    }

    /// Sum Σ v v' of the innovations v over the samples of a pattern.
    fn innovation_products(&self, pattern: usize, innovations: &[[f64; OUTPUTS]]) -> Outputs {
        let mut sum = Outputs::zeros();
        for (v, own) in innovations.iter().zip(&self.pattern_of) {
            if usize::from(*own) == pattern {
                let v = nalgebra::SVector::from(*v);
                sum += v * v.transpose();
            }
        }
        sum
    }
}

/// Computation of the gains for given parameters, compiled for the processor at hand.
struct GainsAt<'a, const NX: usize, E: InGusts<NX>> {
    filter: &'a Filter<NX, E>,
    parameters: &'a [f64],
}

impl<const NX: usize, E: InGusts<NX>> WithSimd for GainsAt<'_, NX, E> {
    type Output = Option<Vec<PatternGain<NX>>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.filter.compute_gains(self.parameters)
    }
}

/// Traces of the slopes S_i of the innovations' covariance S along the parameters i: tr(S⁻¹ S_i S⁻¹
/// S_j), row by row, and tr(E S⁻¹ S_j) in a last row, with E the matrix `excess`.
fn covariance_traces<const NX: usize>(gain: &PatternGain<NX>, excess: &Outputs) -> AlignedMatrix {
    const ENTRIES: usize = OUTPUTS * OUTPUTS;
    let count = gain.slopes.len();
    let mut relative: Vec<Outputs> = Vec::with_capacity(count + 1);
    relative.extend(gain.slopes.iter().map(|s| gain.inverse * s.innovations));
    let mut right = AlignedMatrix::zeros(ENTRIES, count);
    for (entry, row) in right.rows_mut().enumerate() {
        let (k, l) = (entry % OUTPUTS, entry / OUTPUTS);
        for (to, of) in row.iter_mut().zip(&relative) {
            *to = of[(l, k)];
        }
    }
    relative.push(*excess);
    let mut left = AlignedMatrix::zeros(count + 1, ENTRIES);
    for (row, of) in left.rows_mut().zip(&relative) {
        row[..ENTRIES].copy_from_slice(of.as_slice());
    }
    left.product(&right)
}

/// Model of the filter's case, without biases and initial states, which the filter itself
/// estimates.
fn without_own<'a>(model: &Model<'a>) -> Model<'a> {
    Model {
        biases: vec![],
        initial_state: InitialState::Measured,
        ..model.clone()
    }
}

/// Matrix T by which the rotary gusts of the state decay in a step.
fn decay_matrix<const NX: usize, E: InGusts<NX>>(decay: f64) -> States<NX> {
    let mut t = States::identity();
    for &(rate, felt) in E::FELT_RATES {
        t[(felt, felt)] = decay;
        t[(felt, rate)] = 1.0 - decay;
    }
    t
}

/// Slope of T along a parameter, from the slope of the decay.
fn decay_matrix_slope<const NX: usize, E: InGusts<NX>>(slope: f64) -> States<NX> {
    let mut t = States::zeros();
    for &(rate, felt) in E::FELT_RATES {
        t[(felt, felt)] = slope;
        t[(felt, rate)] = -slope;
    }
    t
}

/// Slope of the system along a derivative; `q` is the slope of the noise of the states.
#[inline(always)]
fn derivative_slope<const NX: usize>(
    slope: &Discrete<NX>,
    q: States<NX>,
    decay: &States<NX>,
) -> NoisySystem<NX> {
    NoisySystem {
        a: product(&slope.step, decay),
        c: slope.outputs,
        q,
        r: [0.0; OUTPUTS],
    }
}

/// Distinct patterns of valid outputs, and the index of each sample's pattern.
fn patterns(used: &[[bool; OUTPUTS]]) -> (Vec<Pattern>, Vec<u8>) {
    let (mut patterns, mut of_sample) = (Vec::<Pattern>::new(), Vec::with_capacity(used.len()));
    for used in used {
        let known = patterns.iter().position(|p| p.used == *used);
        let pattern = known.unwrap_or_else(|| {
            patterns.push(Pattern {
                used: *used,
                samples: 0,
            });
            patterns.len() - 1
        });
        patterns[pattern].samples += 1;
        // At most 2⁵ patterns.
        of_sample.push(u8::try_from(pattern).unwrap_or(u8::MAX));
    }
    (patterns, of_sample)
}

#[cfg(test)]
mod tests {
    use super::super::gains::{Gain, GainSlope};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn traces_of_the_covariance_s_slopes_are_those_of_the_matrices() {
        let wave = |n: usize, i: usize, j: usize| (0.3 + (n + 2 * i + 3 * j) as f64).sin();
        let innovations = |n: usize| {
            let half = Outputs::from_fn(|i, j| wave(n, i, j));
            half + half.transpose()
        };
        let slope = |n: usize| GainSlope {
            parameter: n,
            gain: Gain::<4>::zeros(),
            innovations: innovations(n),
        };
        let inverse = Outputs::from_fn(|i, j| if i == j { 2.0 } else { 0.3 });
        let gain = PatternGain {
            inverse,
            slopes: (0..3).map(slope).collect(),
            ..PatternGain::none()
        };
        let excess = Outputs::from_fn(|i, j| wave(7, j, i));
        let traces = covariance_traces(&gain, &excess).to_dense();
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let exact = (inverse * innovations(i) * inverse * innovations(j)).trace();
            assert_relative_eq!(traces[(i, j)], exact, max_relative = 1e-12);
        }
        for j in 0..3 {
            let exact = (excess * inverse * innovations(j)).trace();
            assert_relative_eq!(traces[(3, j)], exact, max_relative = 1e-12);
        }
    }
}
