//! One maneuver prepared for filter error: cost, its gradient and the information of all
//! parameters.
//!
//! Parameters in order: free derivatives, free biases and initial states, as in output error, then
//! the parameters of the noise ([`NoiseParameter::all`]). The parameters before the noise are the
//! filter's *own* parameters.

use std::marker::PhantomData;

use nalgebra::SVector;
use pulp::Arch;

use super::gain_computation::GainComputation;
use super::gains::{Pattern, PatternGain, patterns};
use super::input_process_noise::InputNoise;
use super::linearised::Linearised;
use super::measurement_updates::{LaneBlocks, MeasurementUpdates, gain_slopes};
use super::noise::{Noise, NoiseParameter, NoisePrior};
use super::pass::{FilterPass, PassOutputs};
use super::response::FilterResponse;
use super::row_sinks::RowSink;
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::vectors::simd::AlignedBuffer;
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
    /// Free parameters of the noise; none if the noise is known.
    noise_parameters: Vec<NoiseParameter>,
    known_noise: Option<Noise>,
    patterns: Vec<Pattern>,
    pattern_of: Vec<u8>,
    /// Priors of biases and noise, with the parameter of each.
    priors: Vec<(usize, NoisePrior)>,
    names: Vec<String>,
}

impl<const NX: usize, E: InGusts<NX>> Filter<NX, E> {
    /// Prepares a maneuver. `biases` has the standard uncertainty of each free bias in order;
    /// `None` where it is unknown.
    #[must_use]
    pub fn new(
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        measurements: Measurements,
        model: &Model,
        biases: &[Option<f64>],
    ) -> Self {
        let case = Case::for_passes(aircraft, signals, measurements, &without_own(model));
        Self::of_case(case, model, biases, None)
    }

    /// Prepares the same maneuver with another model. `signals` may have other surfaces. A known
    /// noise is not estimated.
    #[must_use]
    pub fn with_model(
        &self,
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        model: &Model,
        biases: &[Option<f64>],
        known_noise: Option<Noise>,
    ) -> Self {
        let case = self.case.with_model(aircraft, signals, &without_own(model));
        Self::of_case(case, model, biases, known_noise)
    }

    fn of_case(
        case: Case<NX, E>,
        model: &Model,
        biases: &[Option<f64>],
        known_noise: Option<Noise>,
    ) -> Self {
        let biased_outputs = model.biased_outputs::<NX, E>();
        let initial_states = match model.initial_state {
            InitialState::Estimated => E::states_in_still_air(),
            InitialState::Measured => 0,
        };
        let noise_parameters = match known_noise {
            Some(_) => vec![],
            None => NoiseParameter::all(E::AIR_RELATIVE_RATES.len()),
        };
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
            known_noise,
            patterns,
            pattern_of,
            priors: vec![],
            names: model.parameter_names(&E::STATES[..E::states_in_still_air()]),
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

    /// Noise of these parameters.
    #[must_use]
    pub fn noise(&self, parameters: &[f64]) -> Noise {
        self.known_noise.unwrap_or_else(|| {
            let parameters = &parameters[self.first_noise()..];
            Noise::of_parameters(parameters, E::AIR_RELATIVE_RATES.len())
        })
    }

    /// Joins the filter's own parameters with the parameters of a noise.
    #[must_use]
    pub fn with_noise(&self, values: &[f64], noise: &Noise) -> Vec<f64> {
        [values, &noise.parameters(E::AIR_RELATIVE_RATES.len())].concat()
    }

    /// Runs the filter over the maneuver: innovations, their sensitivities to all parameters, and the
    /// sums of cost, gradient and information.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or the filter has no finite gain.
    pub fn respond(&self, parameters: &[f64]) -> Result<FilterResponse, Diverged> {
        let gains = self.gains_with_slopes(parameters)?;
        let mut response = FilterResponse::empty(self.samples(), self.parameters());
        let mut sums = NormalSums::new(
            &self.layout,
            self.case.derivatives(),
            &[],
            self.samples(),
            samples_per_block(self.case.step_s),
        )
        .with_blocks();
        self.run(parameters, &gains, &mut response, Some(&mut sums))?;
        response.sums = sums;
        self.add_covariance_part(parameters, &gains, &mut response);
        Ok(response)
    }

    /// Computes the innovations and their cost alone, whitened with the gains of these parameters.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds or the filter has no finite gain.
    pub fn innovations(&self, parameters: &[f64]) -> Result<FilterResponse, Diverged> {
        let gains = self.gains_without_slopes(parameters)?;
        let mut response = FilterResponse::empty(self.samples(), self.parameters());
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
        let mut updates = self.measurement_updates(parameters, &gains);
        updates.decay = 0.0;
        let mut response = FilterResponse::empty(self.samples(), self.parameters());
        let no_sums = None::<&mut NormalSums>;
        self.run_on(&self.case, parameters, &updates, &mut response, no_sums)?;
        Ok(response.predicted)
    }

    pub(super) fn run<K: RowSink<NX>>(
        &self,
        parameters: &[f64],
        gains: &[PatternGain<NX>],
        response: &mut FilterResponse,
        sink: Option<&mut K>,
    ) -> Result<(), Diverged> {
        let updates = self.measurement_updates(parameters, gains);
        self.run_on(&self.case, parameters, &updates, response, sink)
    }

    /// Runs a pass on a case of the same maneuver, whose instruments may be in error.
    pub(super) fn run_on<K: RowSink<NX>>(
        &self,
        case: &Case<NX, E>,
        parameters: &[f64],
        updates: &MeasurementUpdates<NX>,
        response: &mut FilterResponse,
        sink: Option<&mut K>,
    ) -> Result<(), Diverged> {
        Arch::new().dispatch(FilterPass {
            case,
            layout: &self.layout,
            terms: case.valued_terms(parameters).collect(),
            start: self.start(parameters),
            start_sensitivities: self.start_sensitivities(),
            updates,
            outputs: PassOutputs {
                predicted: &mut response.predicted,
                innovations: &mut response.innovations,
                whitened: &mut response.whitened,
            },
            sink,
        })
    }

    pub(super) fn measurement_updates<'a>(
        &'a self,
        parameters: &[f64],
        gains: &'a [PatternGain<NX>],
    ) -> MeasurementUpdates<'a, NX> {
        let noise = self.noise(parameters);
        MeasurementUpdates {
            gains,
            gain_slopes: gain_slopes(gains, &self.layout),
            patterns: &self.patterns,
            pattern_of: &self.pattern_of,
            biases: self.biases(parameters),
            bias_rows: self.bias_rows(),
            decay: noise.decay(self.case.step_s),
            decay_row: self.decay_row(&noise),
        }
    }

    pub(super) fn biases(&self, parameters: &[f64]) -> [f64; OUTPUTS] {
        let mut biases = [0.0; OUTPUTS];
        let values = &parameters[self.case.derivatives()..];
        for (&o, bias) in self.biased_outputs.iter().zip(values) {
            biases[o] += bias;
        }
        biases
    }

    /// Output that each free bias shifts.
    #[cfg(test)]
    pub(super) fn biased_outputs(&self) -> &[usize] {
        &self.biased_outputs
    }

    /// Number of lanes.
    pub(super) fn lanes(&self) -> usize {
        self.layout.width()
    }

    /// Patterns of outputs that count, and the pattern of each sample.
    pub(super) fn patterns(&self) -> (&[Pattern], &[u8]) {
        (&self.patterns, &self.pattern_of)
    }

    /// Lane of a parameter.
    pub(super) fn lane(&self, parameter: usize) -> usize {
        self.layout.parameter_lanes[parameter]
    }

    fn bias_rows(&self) -> LaneBlocks {
        let mut rows = LaneBlocks::zeros(OUTPUTS, self.layout.width());
        for (b, &o) in self.biased_outputs.iter().enumerate() {
            rows.set(o, self.lane(self.case.derivatives() + b), 1.0);
        }
        rows
    }

    fn decay_row(&self, noise: &Noise) -> LaneBlocks {
        let mut row = LaneBlocks::zeros(1, self.layout.width());
        for (n, parameter) in self.noise_parameters.iter().enumerate() {
            let lane = self.lane(self.first_noise() + n);
            row.set(0, lane, noise.decay_slope(*parameter, self.case.step_s));
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
        for &(rate, relative) in E::AIR_RELATIVE_RATES {
            x[relative] = x[rate];
        }
        x
    }

    fn start_sensitivities(&self) -> AlignedBuffer {
        let width = self.layout.width();
        let mut rows = AlignedBuffer::zeros(NX * width);
        let first = self.first_noise() - self.initial_states;
        for i in 0..self.initial_states {
            let lane = self.lane(first + i);
            let relative = E::AIR_RELATIVE_RATES.iter().find(|(rate, _)| *rate == i);
            rows.slice_mut()[i * width + lane] = 1.0;
            if let Some((_, relative)) = relative {
                rows.slice_mut()[relative * width + lane] = 1.0;
            }
        }
        rows
    }

    /// Gains of all patterns with their slopes.
    pub(super) fn gains_with_slopes(
        &self,
        parameters: &[f64],
    ) -> Result<Vec<PatternGain<NX>>, Diverged> {
        self.compute_gains(parameters, true)
    }

    /// Gains of all patterns without slopes.
    fn gains_without_slopes(&self, parameters: &[f64]) -> Result<Vec<PatternGain<NX>>, Diverged> {
        self.compute_gains(parameters, false)
    }

    fn compute_gains(
        &self,
        parameters: &[f64],
        with_slopes: bool,
    ) -> Result<Vec<PatternGain<NX>>, Diverged> {
        let numbered = (self.first_noise()..).zip(self.noise_parameters.iter().copied());
        let gains = Arch::new().dispatch(GainComputation::<NX, E> {
            linearised: &self.linearised,
            input_noise: &self.input_noise,
            patterns: &self.patterns,
            step_s: self.case.step_s,
            derivatives: &parameters[..self.case.derivatives()],
            noise: self.noise(parameters),
            noise_parameters: numbered.collect(),
            with_slopes,
            equations: PhantomData,
        });
        gains.ok_or(Diverged { sample: 0 })
    }

    /// Adds the parts of cost, gradient and information that come from log|S|, the slopes of S, and
    /// the priors. A known noise has no priors.
    fn add_covariance_part(
        &self,
        parameters: &[f64],
        gains: &[PatternGain<NX>],
        response: &mut FilterResponse,
    ) {
        response.add_covariance(gains, &self.patterns, &self.pattern_of);
        if self.known_noise.is_none() {
            self.add_rotary_costs(parameters, response);
        }
        for (j, prior) in &self.priors {
            response.add_prior(*j, prior.cost(parameters[*j]));
        }
    }

    /// Adds the costs of rotary gusts that are smaller than the random walk of the angle implies.
    fn add_rotary_costs(&self, parameters: &[f64], response: &mut FilterResponse) {
        let place = |kind: NoiseParameter| {
            let place = self.noise_parameters.iter().position(|p| *p == kind);
            self.first_noise() + place.unwrap_or(0)
        };
        for gust in 0..E::AIR_RELATIVE_RATES.len() {
            let cost = self.noise(parameters).rotary_cost(gust, self.case.step_s);
            if let Some(cost) = cost {
                response.add_rotary_cost(&cost, place);
            }
        }
    }
}

/// Model of the filter's case, without biases and initial states, which the filter itself
/// estimates.
pub(super) fn without_own<'a>(model: &Model<'a>) -> Model<'a> {
    Model {
        biases: vec![],
        initial_state: InitialState::Measured,
        ..model.clone()
    }
}
