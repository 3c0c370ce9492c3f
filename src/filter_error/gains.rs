//! Gain of the filter and covariance of its innovations, for each pattern of outputs that count.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{Cholesky, SMatrix};

use super::noise::{Noise, NoiseParameter};
use super::riccati::{OutputSlopes, StateMatrix, SteadyFilter, SystemSlope};
use crate::dynamics::OUTPUTS;
use crate::numerics::linear_algebra::small::{product, product_transposed, sandwich};

/// Square matrix over the outputs, such as a covariance.
pub(super) type OutputMatrix = SMatrix<f64, OUTPUTS, OUTPUTS>;
/// Gain: states by outputs.
pub(super) type Gain<const NX: usize> = SMatrix<f64, NX, OUTPUTS>;

/// Outputs that count at some samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pattern {
    pub used: [bool; OUTPUTS],
    pub samples: usize,
}

/// Distinct patterns of valid outputs, and the index of each sample's pattern.
pub(super) fn patterns(used: &[[bool; OUTPUTS]]) -> (Vec<Pattern>, Vec<u8>) {
    let (mut patterns, mut of_sample) = (Vec::<Pattern>::new(), Vec::with_capacity(used.len()));
    for used in used {
        let position = patterns.iter().position(|p| p.used == *used);
        let pattern = position.unwrap_or_else(|| {
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

/// Filter of the samples of one pattern.
#[derive(Clone, Debug)]
pub(super) struct PatternGain<const NX: usize> {
    pub gain: Gain<NX>,
    /// Inverse S⁻¹ of the innovations' covariance; zero for outputs that do not count.
    pub inverse: OutputMatrix,
    /// Matrix L⁻¹ with S = L Lᵀ, by which the innovations become white; zero for outputs that do
    /// not count.
    pub whitening: OutputMatrix,
    pub log_determinant: f64,
    /// Slopes of gain and S along each parameter that has any.
    pub slopes: Vec<GainSlope<NX>>,
}

/// Slope of a gain along a parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct GainSlope<const NX: usize> {
    pub parameter: usize,
    pub gain: Gain<NX>,
    pub innovations: OutputMatrix,
}

/// Change of the system along a parameter, numbered as in the filter.
pub(super) struct ParameterSlope<const NX: usize> {
    pub parameter: usize,
    pub system: SystemSlope<NX>,
}

/// Variances of the outputs' noise for the steady filter. If an output counts in only a share of
/// the samples, its variance is divided by this share.
pub(super) fn steady_variances(noise: &Noise, patterns: &[Pattern]) -> [f64; OUTPUTS] {
    let all: usize = patterns.iter().map(|p| p.samples).sum();
    std::array::from_fn(|o| noise.outputs[o].powi(2) / share(o, patterns, all))
}

/// Slope of [`steady_variances`] along a parameter.
pub(super) fn steady_variance_slopes(
    noise: &Noise,
    patterns: &[Pattern],
    parameter: NoiseParameter,
) -> [f64; OUTPUTS] {
    let variances = steady_variances(noise, patterns);
    std::array::from_fn(|o| match parameter {
        NoiseParameter::Output(output) if output == o => 2.0 * variances[o],
        _ => 0.0,
    })
}

/// Share of the samples in which an output counts.
fn share(output: usize, patterns: &[Pattern], all: usize) -> f64 {
    let with_output = patterns.iter().filter(|p| p.used[output]);
    let samples: usize = with_output.map(|p| p.samples).sum();
    samples.max(1) as f64 / all.max(1) as f64
}

/// Gains of all patterns; `None` if the filter has no finite covariance.
#[inline(always)]
pub(super) fn gains_of_patterns<const NX: usize>(
    filter: &SteadyFilter<NX>,
    noise: &Noise,
    slopes: &[ParameterSlope<NX>],
    noise_parameters: &[(usize, NoiseParameter)],
    patterns: &[Pattern],
) -> Option<Vec<PatternGain<NX>>> {
    let c = &filter.system.c;
    let mut changes = Vec::with_capacity(slopes.len());
    for slope in slopes {
        changes.push((slope.parameter, slope.system.c, filter.slope(&slope.system)));
    }
    let mut gains = Vec::with_capacity(patterns.len());
    for pattern in patterns {
        let mut pattern_gain = PatternGain::for_pattern(&filter.prediction, c, noise, pattern)?;
        pattern_gain.slopes = pattern_gain.slopes_along(&filter.prediction, c, &changes, pattern);
        pattern_gain.add_output_noise(noise, noise_parameters, pattern);
        gains.push(pattern_gain);
    }
    Some(gains)
}

impl<const NX: usize> PatternGain<NX> {
    /// Gain of zero.
    pub fn none() -> Self {
        PatternGain {
            gain: Gain::zeros(),
            inverse: OutputMatrix::zeros(),
            whitening: OutputMatrix::zeros(),
            log_determinant: 0.0,
            slopes: vec![],
        }
    }

    #[inline(always)]
    fn for_pattern(
        prediction: &StateMatrix<NX>,
        c: &OutputSlopes<NX>,
        noise: &Noise,
        pattern: &Pattern,
    ) -> Option<Self> {
        let mut s = sandwich(c, prediction);
        for o in 0..OUTPUTS {
            s[(o, o)] += noise.outputs[o].powi(2);
        }
        // An output that does not count stands by itself with a unit variance, and is cleared.
        for o in (0..OUTPUTS).filter(|o| !pattern.used[*o]) {
            s.row_mut(o).fill(0.0);
            s.column_mut(o).fill(0.0);
            s[(o, o)] = 1.0;
        }
        let root = Cholesky::new(s)?;
        let (mut inverse, mut whitening) = (root.inverse(), root.l().try_inverse()?);
        for o in (0..OUTPUTS).filter(|o| !pattern.used[*o]) {
            inverse[(o, o)] = 0.0;
            whitening[(o, o)] = 0.0;
        }
        Some(PatternGain {
            gain: product(&product_transposed(prediction, c), &inverse),
            inverse,
            whitening,
            log_determinant: 2.0 * root.l().diagonal().map(f64::ln).sum(),
            slopes: vec![],
        })
    }

    /// Slope of the gain K along a parameter.
    ///
    /// P is the covariance of the prediction, C the sensitivity of the outputs to the states, S the
    /// covariance of the innovations. With d for a slope along the parameter, dK = (dP Cᵀ + P dCᵀ −
    /// K dS) S⁻¹.
    #[inline(always)]
    fn slopes_along(
        &self,
        prediction: &StateMatrix<NX>,
        c: &OutputSlopes<NX>,
        changes: &[(usize, OutputSlopes<NX>, StateMatrix<NX>)],
        pattern: &Pattern,
    ) -> Vec<GainSlope<NX>> {
        let state_output = product_transposed(prediction, c);
        let mut slopes = Vec::with_capacity(changes.len());
        for (parameter, c_slope, p_slope) in changes {
            let cross = product_transposed(p_slope, c) + product_transposed(prediction, c_slope);
            let mut innovations = product(c, &cross) + product(c_slope, &state_output);
            clear_unused(&mut innovations, pattern);
            let gain = product(&(cross - product(&self.gain, &innovations)), &self.inverse);
            slopes.push(GainSlope {
                parameter: *parameter,
                gain,
                innovations,
            });
        }
        slopes
    }

    /// Adds the direct effect of the outputs' own noise on S.
    fn add_output_noise(
        &mut self,
        noise: &Noise,
        parameters: &[(usize, NoiseParameter)],
        pattern: &Pattern,
    ) {
        for slope in &mut self.slopes {
            for (parameter, kind) in parameters {
                let NoiseParameter::Output(o) = *kind else {
                    continue;
                };
                if *parameter == slope.parameter && pattern.used[o] {
                    let change = 2.0 * noise.outputs[o].powi(2);
                    slope.innovations[(o, o)] += change;
                    let column = self.gain.column(o) * change;
                    slope.gain -= column * self.inverse.row(o);
                }
            }
        }
    }
}

fn clear_unused(matrix: &mut OutputMatrix, pattern: &Pattern) {
    for o in (0..OUTPUTS).filter(|o| !pattern.used[*o]) {
        matrix.row_mut(o).fill(0.0);
        matrix.column_mut(o).fill(0.0);
    }
}
