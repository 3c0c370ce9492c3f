//! One window in the joint fit: its own parameters, its residuals, and its information on the
//! shared parameters.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::equations::STATES;
use super::input_noise::{FittedWindow, score_covariance, with_input_noise};
use super::parameters::{INPUTS, Kind, OUTPUTS, PARAMETERS, Parameters};
use super::reconstruction::{LOCAL, Local, WIND, reconstruct};
use super::settings::Compatibility;
use super::window::Window;
use super::window_sums::{OutputSums, Residuals, WindowSums, output_sums};
use crate::aircraft::Aircraft;
use crate::output_error::coloured;

/// Least standard deviation of an output's residuals, as a share of its ordinary bias: keeps the
/// weights of exact (simulated) data finite.
const LEAST_DEVIATION: f64 = 1e-3;

/// Output whose instrument reads each state: V, β, α, φ, θ, ψ, altitude.
const READ_BY: [usize; STATES] = [2, 1, 0, 4, 3, 5, 6];

/// Standard deviations about the assumed value of an initial state that no instrument reads, ft/s,
/// rad and ft: wide, so that the other outputs decide what they can.
const UNREAD_START: [f64; STATES] = [100.0, 100.0, 100.0, 1.0, 1.0, 1.0, 5_000.0];

/// Inputs of the fit that are common to all windows.
pub struct FitContext<'a> {
    pub aircraft: &'a Aircraft,
    pub settings: &'a Compatibility,
    /// Samples at either end of a window that are not compared: a delay does not reach beyond them.
    pub margin: usize,
}

impl FitContext<'_> {
    /// Samples of a window whose outputs are compared.
    pub fn compared(&self, window: &Window) -> Range<usize> {
        self.margin..window.samples.saturating_sub(self.margin)
    }
}

/// One window with its own parameters.
pub struct WindowFit<'a> {
    window: &'a Window,
    local: Local,
    /// R: long-run variances of the outputs' residuals.
    variances: [f64; OUTPUTS],
    output_sums: Vec<OutputSums>,
    sums: WindowSums,
    /// Information on the shared parameters with the local ones eliminated.
    pub information: DMatrix<f64>,
    /// Gradient on the shared parameters with the local ones eliminated.
    pub gradient: DVector<f64>,
    /// Both of them with the noise of the inputs counted; set by [`WindowFit::reweigh`].
    pub evidence: (DMatrix<f64>, DVector<f64>),
    input_noise: InputNoise,
    residuals: Residuals,
}

/// Covariance of the score from the inputs' noise, with the variances R for which it was computed.
#[derive(Clone)]
struct InputNoise {
    variances: [f64; OUTPUTS],
    covariance: DMatrix<f64>,
}

impl InputNoise {
    /// Largest ratio of a variance R to that of the covariance at which the covariance serves.
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

impl<'a> WindowFit<'a> {
    /// Begins at the measured state, with the outputs' ordinary biases as standard deviations.
    /// `None` where the integration diverges.
    pub fn begin(
        window: &'a Window,
        context: &FitContext,
        shared: &Parameters,
    ) -> Option<WindowFit<'a>> {
        let mut local = [0.0; LOCAL];
        for (parameter, state) in local.iter_mut().zip(window.start.iter()) {
            *parameter = *state;
        }
        let variances = std::array::from_fn(|output| {
            let bias = context.settings.ordinary.of(INPUTS + output, Kind::Bias);
            bias.powi(2)
        });
        WindowFit::at(
            window,
            context,
            local,
            variances,
            shared,
            InputNoise::unknown(),
        )
    }

    fn at(
        window: &'a Window,
        context: &FitContext,
        local: Local,
        variances: [f64; OUTPUTS],
        shared: &Parameters,
        input_noise: InputNoise,
    ) -> Option<WindowFit<'a>> {
        let reconstructed = reconstruct(window, context.aircraft, &local, shared)?;
        let (output_sums, residuals) =
            output_sums(window, &reconstructed, shared, &context.compared(window));
        let mut fit = WindowFit {
            window,
            local,
            variances,
            output_sums,
            sums: WindowSums::zero(),
            information: DMatrix::zeros(0, 0),
            gradient: DVector::zeros(0),
            evidence: (DMatrix::zeros(0, 0), DVector::zeros(0)),
            input_noise,
            residuals,
        };
        fit.weigh(context);
        Some(fit)
    }

    /// Twice the cost of the window.
    pub fn cost(&self) -> f64 {
        self.sums.cost
    }

    /// The window at other shared parameters, its own following their step. `step` is the full
    /// step of the shared parameters and `share` the part of it that is taken.
    pub fn moved(
        &self,
        context: &FitContext,
        shared: &Parameters,
        step: &DVector<f64>,
        share: f64,
    ) -> Option<WindowFit<'a>> {
        let local_step = self.sums.local_step(step)?;
        let local = std::array::from_fn(|i| self.local[i] + share * local_step[i]);
        let input_noise = self.input_noise.clone();
        WindowFit::at(
            self.window,
            context,
            local,
            self.variances,
            shared,
            input_noise,
        )
    }

    /// Adds up the outputs' sums, each with its weight 1/R, and the priors of the wind's change and of
    /// initial states without instrument.
    fn weigh(&mut self, context: &FitContext) {
        let mut sums = WindowSums::zero();
        for (output, own) in self.output_sums.iter().enumerate() {
            sums.add(output, 1.0 / self.variances[output], own);
        }
        let wind = context.settings.wind_change_ft_s2;
        for j in LOCAL - WIND..LOCAL {
            sums.local_information[(j, j)] += 1.0 / (wind * wind);
            sums.local_gradient[j] -= self.local[j] / (wind * wind);
            sums.cost += (self.local[j] / wind).powi(2);
        }
        for j in (0..STATES).filter(|j| !self.reads(READ_BY[*j], context)) {
            let (from_start, size) = (self.local[j] - self.window.start[j], UNREAD_START[j]);
            sums.local_information[(j, j)] += 1.0 / (size * size);
            sums.local_gradient[j] -= from_start / (size * size);
            sums.cost += (from_start / size).powi(2);
        }
        (self.information, self.gradient) = sums.reduced();
        self.sums = sums;
    }

    /// Covariance of the gradient on the shared parameters from the inputs' noise.
    pub fn input_noise_covariance(
        &self,
        context: &FitContext,
        shared: &Parameters,
    ) -> Option<DMatrix<f64>> {
        let fitted = FittedWindow {
            window: self.window,
            aircraft: context.aircraft,
            compared: context.compared(self.window),
            local: &self.local,
            shared,
        };
        let weights = self.variances.map(|variance| 1.0 / variance);
        score_covariance(&fitted, weights, &self.sums, &self.information)
    }

    /// `true` where an output is compared.
    fn reads(&self, output: usize, context: &FitContext) -> bool {
        let compared = self.window.outputs[output].get(context.compared(self.window));
        compared.is_some_and(|values| values.iter().any(|v| v.is_finite()))
    }

    /// Estimates R anew from the residuals: coloured noise counts as white noise as strong as its
    /// slowest part.
    pub fn reweigh(&mut self, context: &FitContext, shared: &Parameters) {
        let range = context.compared(self.window);
        for output in 0..OUTPUTS {
            let residuals = self.residuals[output]
                .get(range.clone())
                .unwrap_or_default();
            let bias = context.settings.ordinary.of(INPUTS + output, Kind::Bias);
            let least = LEAST_DEVIATION * bias;
            let level = coloured::slow_noise_level(residuals, self.window.step_s);
            self.variances[output] = level.max(least * least);
        }
        self.weigh(context);
        self.count_input_noise(context, shared);
    }

    /// Computes the evidence. A window whose own parameters are not determined has none.
    fn count_input_noise(&mut self, context: &FitContext, shared: &Parameters) {
        if !self.input_noise.serves(&self.variances) {
            let covariance = self.input_noise_covariance(context, shared);
            self.input_noise = InputNoise {
                variances: self.variances,
                covariance: covariance.unwrap_or_else(|| DMatrix::zeros(PARAMETERS, PARAMETERS)),
            };
        }
        let sizes: Parameters = std::array::from_fn(|j| context.settings.ordinary.of_parameter(j));
        let noise = &self.input_noise.covariance;
        let evidence = with_input_noise(&self.information, &self.gradient, noise, &sizes);
        self.evidence = evidence.unwrap_or_else(|| {
            let none = DMatrix::zeros(PARAMETERS, PARAMETERS);
            (none, DVector::zeros(PARAMETERS))
        });
    }

    /// Sums of squares of an output's slow residuals and of its reconstructed motion.
    pub fn residuals_and_motion(&self, context: &FitContext, output: usize) -> (f64, f64) {
        let measured = &self.window.outputs[output];
        let counted = context
            .compared(self.window)
            .filter(|k| measured[*k].is_finite());
        let (residuals, motion): (Vec<f64>, Vec<f64>) = counted
            .map(|k| {
                let residual = self.residuals[output][k];
                (residual, measured[k] - residual)
            })
            .unzip();
        (slow_squares(&residuals), squares_about_mean(&motion))
    }
}

/// Standard deviations of chance by which the squares must exceed those of white noise.
const CHANCE: f64 = 3.0;

/// Sum of squares without that of white noise, which does not continue from sample to sample, and
/// without what chance adds to it: the sum of v(k) v(k + 1) has a variance of N s⁴.
fn slow_squares(values: &[f64]) -> f64 {
    let noise = values
        .windows(2)
        .map(|w| (w[1] - w[0]).powi(2))
        .sum::<f64>()
        / 2.0;
    let chance = CHANCE / (values.len().max(1) as f64).sqrt();
    (values.iter().map(|v| v * v).sum::<f64>() - noise * (1.0 + chance)).max(0.0)
}

/// Sum of squared deviations from the mean.
pub fn squares_about_mean(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
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
