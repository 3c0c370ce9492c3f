//! One window in the joint fit: its own parameters, its residuals, and its information on the
//! shared parameters.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::equations::STATES;
use super::parameter_noise::{score_covariance, with_input_noise};
use super::parameters::{INPUTS, Kind, OUTPUTS, PARAMETERS, Parameters, output};
use super::reconstruction::{
    LOCAL, LocalParameters, Row, Trajectory, WIND, reconstruct, sensitivities,
};
use super::settings::Compatibility;
use super::window::Window;
use super::window_sums::{Comparison, LinearisedWindow, ReducedInformation, weighted_gradient};
use crate::aircraft::Aircraft;
use crate::numerics::statistics::mean::mean;
use crate::output_error::coloured;

/// Least standard deviation of an output's residuals, as a share of its ordinary bias: keeps the
/// weights of exact (simulated) data finite.
const LEAST_DEVIATION: f64 = 1e-3;

/// Output whose instrument reads each state; α and β make w and v of the airspeed.
const READ_BY: [usize; STATES] = [
    output::AIRSPEED,
    output::BETA,
    output::ALPHA,
    output::PHI,
    output::THETA,
    output::PSI,
    output::ALTITUDE,
];

/// Standard deviations about the assumed value of an initial state that no instrument reads, ft/s,
/// rad and ft. They are wide, so that the other outputs determine what they can.
const UNREAD_START: [f64; STATES] = [100.0, 100.0, 100.0, 1.0, 1.0, 1.0, 5_000.0];

/// Inputs of the fit that are common to all windows.
pub struct FitContext<'a> {
    pub aircraft: &'a Aircraft,
    pub settings: &'a Compatibility,
    /// Samples excluded from the comparison at either end of a window, so that a delayed output
    /// needs no sample outside the window.
    pub margin: usize,
}

impl FitContext<'_> {
    /// Samples of a window whose outputs are compared.
    pub fn compared(&self, window: &Window) -> Range<usize> {
        self.margin..window.samples.saturating_sub(self.margin)
    }
}

/// One window with its own parameters. A small move keeps the linearisation and the information.
pub struct WindowFit<'a> {
    window: &'a Window,
    local: LocalParameters,
    /// R: long-run variances of the outputs' residuals.
    variances: [f64; OUTPUTS],
    trajectory: Trajectory,
    comparison: Comparison,
    linearised: Arc<LinearisedWindow>,
    information: Arc<ReducedInformation>,
    /// Gradients of the outputs on their parameters, which the weights do not change.
    gradients: [Row; OUTPUTS],
    /// Gradient on all parameters, the window's own before the shared ones.
    full_gradient: DVector<f64>,
    /// Gradient on the shared parameters with the local ones eliminated.
    pub gradient: DVector<f64>,
    /// Twice the cost.
    pub cost: f64,
    /// Information and gradient with the noise of the inputs counted; set by
    /// [`WindowFit::count_input_noise`].
    pub evidence: Arc<(DMatrix<f64>, DVector<f64>)>,
    input_noise: Arc<InputNoise>,
}

/// Covariance of the score from the inputs' noise, with the variances R for which it was computed.
struct InputNoise {
    variances: [f64; OUTPUTS],
    covariance: DMatrix<f64>,
}

impl InputNoise {
    /// Largest ratio of a variance R to the one for which the covariance was computed, at which the
    /// covariance is still used.
    const SERVES: f64 = 1.2;

    fn unknown() -> InputNoise {
        InputNoise {
            variances: [0.0; OUTPUTS],
            covariance: DMatrix::zeros(PARAMETERS, PARAMETERS),
        }
    }

    fn serves(&self, variances: &[f64; OUTPUTS]) -> bool {
        let mut both = self.variances.iter().zip(variances);
        both.all(|(own, now)| *own <= Self::SERVES * now && *now <= Self::SERVES * own)
    }
}

/// Prior of one of a window's own parameters.
struct LocalPrior {
    parameter: usize,
    /// Distance from the assumed value.
    distance: f64,
    size: f64,
}

impl<'a> WindowFit<'a> {
    /// Begins at the measured state, with the outputs' ordinary biases as standard deviations.
    /// `None` if the integration diverges or does not determine the state.
    pub fn begin(
        window: &'a Window,
        context: &FitContext,
        shared: &Parameters,
    ) -> Option<WindowFit<'a>> {
        let mut local = [0.0; LOCAL];
        local[..STATES].copy_from_slice(window.start.as_slice());
        let variances = std::array::from_fn(|output| {
            let bias = context.settings.ordinary.of(INPUTS + output, Kind::Bias);
            bias.powi(2)
        });
        let trajectory = reconstruct(window, context.aircraft, &local, shared)?;
        let comparison = Comparison::of(window, &trajectory, shared, &context.compared(window));
        let slopes = sensitivities(window, context.aircraft, shared, &trajectory);
        let linearised = LinearisedWindow::of(slopes, &comparison);
        let priors = local_priors(window, &local, context);
        let information = reduced_information(&linearised, &variances, &priors)?;
        let gradients = comparison.gradients(&linearised.sensitivities);
        let mut fit = WindowFit {
            window,
            local,
            variances,
            trajectory,
            comparison,
            linearised: Arc::new(linearised),
            information: Arc::new(information),
            gradients,
            full_gradient: DVector::zeros(0),
            gradient: DVector::zeros(0),
            cost: 0.0,
            evidence: Arc::new((DMatrix::zeros(0, 0), DVector::zeros(0))),
            input_noise: Arc::new(InputNoise::unknown()),
        };
        fit.weigh_residuals(context);
        Some(fit)
    }

    /// Information on the shared parameters with the local ones eliminated.
    pub fn information(&self) -> &DMatrix<f64> {
        &self.information.shared
    }

    /// The window at other shared parameters, its own following their step. `step` is the full step
    /// of the shared parameters and `share` the part of it that is taken. `None` if the integration
    /// diverges.
    pub fn moved(
        &self,
        context: &FitContext,
        shared: &Parameters,
        step: &DVector<f64>,
        share: f64,
    ) -> Option<WindowFit<'a>> {
        let local_step = self.information.local_step(&self.full_gradient, step);
        let local = std::array::from_fn(|i| self.local[i] + share * local_step[i]);
        let trajectory = reconstruct(self.window, context.aircraft, &local, shared)?;
        let samples = context.compared(self.window);
        let comparison = Comparison::of(self.window, &trajectory, shared, &samples);
        let mut moved = WindowFit {
            window: self.window,
            local,
            variances: self.variances,
            gradients: comparison.gradients(&self.linearised.sensitivities),
            comparison,
            trajectory,
            linearised: Arc::clone(&self.linearised),
            information: Arc::clone(&self.information),
            full_gradient: DVector::zeros(0),
            gradient: DVector::zeros(0),
            cost: 0.0,
            evidence: Arc::clone(&self.evidence),
            input_noise: Arc::clone(&self.input_noise),
        };
        moved.weigh_residuals(context);
        Some(moved)
    }

    /// Linearises the equations anew, about the present parameters.
    pub fn linearise(&mut self, context: &FitContext, shared: &Parameters) {
        let slopes = sensitivities(self.window, context.aircraft, shared, &self.trajectory);
        self.gradients = self.comparison.gradients(&slopes);
        self.linearised = Arc::new(LinearisedWindow::of(slopes, &self.comparison));
        self.weigh(context);
    }

    /// Computes the information and the gradient for the weights 1/R. A window that no longer
    /// determines its own parameters keeps the information that it had.
    fn weigh(&mut self, context: &FitContext) {
        let priors = local_priors(self.window, &self.local, context);
        let information = reduced_information(&self.linearised, &self.variances, &priors);
        if let Some(information) = information {
            self.information = Arc::new(information);
        }
        self.weigh_residuals(context);
    }

    /// Computes the gradient and the cost.
    fn weigh_residuals(&mut self, context: &FitContext) {
        let weights = weights(&self.variances);
        let mut gradient = weighted_gradient(&self.gradients, &weights);
        let squares = self.comparison.squares.iter().zip(weights);
        self.cost = squares.map(|(square, weight)| weight * square).sum();
        for prior in local_priors(self.window, &self.local, context) {
            gradient[prior.parameter] -= prior.distance / (prior.size * prior.size);
            self.cost += (prior.distance / prior.size).powi(2);
        }
        self.gradient = self.information.gradient(&gradient);
        self.full_gradient = gradient;
    }

    /// Covariance of the gradient on the shared parameters from the inputs' noise.
    pub fn input_noise_covariance(&self) -> Option<DMatrix<f64>> {
        let weights = weights(&self.variances);
        score_covariance(self.window, &self.linearised, &weights, &self.information)
    }

    /// Estimates R anew from the residuals: coloured noise counts as white noise of the same power
    /// as its slowest part.
    pub fn reweigh(&mut self, context: &FitContext) {
        let range = context.compared(self.window);
        for output in 0..OUTPUTS {
            let residuals = &self.comparison.residuals[output];
            let residuals = residuals.get(range.clone()).unwrap_or_default();
            let bias = context.settings.ordinary.of(INPUTS + output, Kind::Bias);
            let least = LEAST_DEVIATION * bias;
            let level = coloured::slow_noise_level(residuals, self.window.step_s);
            self.variances[output] = level.max(least * least);
        }
        self.weigh(context);
    }

    /// Computes the evidence. A window whose own parameters are not determined has none.
    pub fn count_input_noise(&mut self, context: &FitContext) {
        if !self.input_noise.serves(&self.variances) {
            let covariance = self.input_noise_covariance();
            self.input_noise = Arc::new(InputNoise {
                variances: self.variances,
                covariance: covariance.unwrap_or_else(|| DMatrix::zeros(PARAMETERS, PARAMETERS)),
            });
        }
        let sizes: Parameters = std::array::from_fn(|j| context.settings.ordinary.of_parameter(j));
        let noise = &self.input_noise.covariance;
        let evidence = with_input_noise(self.information(), &self.gradient, noise, &sizes);
        self.evidence = Arc::new(evidence.unwrap_or_else(|| {
            let none = DMatrix::zeros(PARAMETERS, PARAMETERS);
            (none, DVector::zeros(PARAMETERS))
        }));
    }

    /// Negative logarithm of the likelihood of the residuals of all outputs, up to a constant.
    pub fn misfit(&self) -> f64 {
        let outputs = self.window.outputs.iter().zip(self.variances);
        let of_output = |(values, variance): (&Vec<f64>, f64)| {
            let samples = values.iter().filter(|value| value.is_finite()).count();
            0.5 * samples as f64 * variance.ln()
        };
        outputs.map(of_output).sum()
    }

    /// Sums of squares of an output's slow residuals, of its reconstructed motion and of the motion's rate.
    pub fn residuals_and_motion(&self, context: &FitContext, output: usize) -> Squares {
        let samples = context.compared(self.window);
        let [measured, residuals] = [&self.window.outputs, &self.comparison.residuals]
            .map(|all| all[output].get(samples.clone()).unwrap_or_default());
        let both = measured.iter().zip(residuals);
        let (residuals, motion): (Vec<f64>, Vec<f64>) = both
            .filter(|(measured, _)| measured.is_finite())
            .map(|(measured, residual)| (*residual, measured - residual))
            .unzip();
        let rate = |w: &[f64]| (w[1] - w[0]) / self.window.step_s;
        Squares {
            residuals: slow_squares(&residuals),
            motion: squares_about_mean(&motion),
            rate: motion.windows(2).map(|w| rate(w).powi(2)).sum(),
        }
    }
}

/// Sums of squares of one output over a window: residuals, motion about its mean, and rate of the
/// motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Squares {
    pub residuals: f64,
    pub motion: f64,
    /// The motion's change per second.
    pub rate: f64,
}

fn weights(variances: &[f64; OUTPUTS]) -> [f64; OUTPUTS] {
    variances.map(|variance| 1.0 / variance)
}

/// Priors of the wind's change and of initial states without instrument.
fn local_priors(window: &Window, local: &LocalParameters, context: &FitContext) -> Vec<LocalPrior> {
    let wind = (LOCAL - WIND..LOCAL).map(|parameter| LocalPrior {
        parameter,
        distance: local[parameter],
        size: context.settings.wind_change_ft_s2,
    });
    let is_read = |state: usize| {
        let compared = window.outputs[READ_BY[state]].get(context.compared(window));
        compared.is_some_and(|values| values.iter().any(|v| v.is_finite()))
    };
    let unread = (0..STATES).filter(|state| !is_read(*state));
    let start = unread.map(|state| LocalPrior {
        parameter: state,
        distance: local[state] - window.start[state],
        size: UNREAD_START[state],
    });
    wind.chain(start).collect()
}

fn reduced_information(
    linearised: &LinearisedWindow,
    variances: &[f64; OUTPUTS],
    priors: &[LocalPrior],
) -> Option<ReducedInformation> {
    let mut information = linearised.information(&weights(variances));
    for LocalPrior {
        parameter, size, ..
    } in priors
    {
        information[(*parameter, *parameter)] += 1.0 / (size * size);
    }
    ReducedInformation::of(&information)
}

/// Standard deviations of chance by which a sum of squares must exceed that of white noise.
const CHANCE_DEVIATIONS: f64 = 3.0;

/// Sum of squares of the part that continues from sample to sample, without white noise. White
/// noise of variance s² exceeds its expectation by chance: the sum of v(k) v(k + 1) has the
/// variance N s⁴.
fn slow_squares(values: &[f64]) -> f64 {
    let noise = values
        .windows(2)
        .map(|w| (w[1] - w[0]).powi(2))
        .sum::<f64>()
        / 2.0;
    let chance = CHANCE_DEVIATIONS / (values.len().max(1) as f64).sqrt();
    (values.iter().map(|v| v * v).sum::<f64>() - noise * (1.0 + chance)).max(0.0)
}

/// Sum of squared deviations from the mean.
pub fn squares_about_mean(values: &[f64]) -> f64 {
    let mean = mean(values.iter().copied());
    values.iter().map(|v| (v - mean).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_from_sample_to_sample_is_no_gust() {
        let noise: Vec<f64> = (0_u64..4000)
            .map(|k| (k * k * 7 % 101) as f64 / 50.0 - 1.0)
            .collect();
        let gust: Vec<f64> = (0..4000).map(|k| (f64::from(k) * 0.03).sin()).collect();
        assert!(
            slow_squares(&noise) < 0.1 * squares_about_mean(&noise),
            "{} of {}",
            slow_squares(&noise),
            squares_about_mean(&noise)
        );
        assert!((slow_squares(&gust) / squares_about_mean(&gust) - 1.0).abs() < 0.01);
    }
}
