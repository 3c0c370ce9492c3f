//! Result of one pass of the filter: cost, gradient and information, of the innovations and of their covariance.

use nalgebra::{DMatrix, DVector};

use super::gains::{OutputMatrix, Pattern, PatternGain};
use super::noise::{NoiseParameter, RotaryCost};
use crate::dynamics::OUTPUTS;
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::output_error::kernel::normal_equations::NormalSums;

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

    /// Response before a pass, which appends its samples.
    pub(super) fn empty(samples: usize, parameters: usize) -> FilterResponse {
        FilterResponse {
            predicted: Vec::with_capacity(samples),
            innovations: Vec::with_capacity(samples),
            whitened: Vec::with_capacity(samples),
            cost: 0.0,
            sums: NormalSums::default(),
            other_gradient: DVector::zeros(parameters),
            other_information: DMatrix::zeros(parameters, parameters),
        }
    }

    /// Sets the cost to ½ Σ (v' S⁻¹ v + log|S|). Adds the parts of gradient and information that
    /// come from the slopes of S, if the gains have slopes. `pattern_of` has the pattern of each
    /// sample.
    pub(super) fn add_covariance<const NX: usize>(
        &mut self,
        gains: &[PatternGain<NX>],
        patterns: &[Pattern],
        pattern_of: &[u8],
    ) {
        let squares: f64 = self.whitened.iter().flatten().map(|u| u * u).sum();
        self.cost = 0.5 * squares;
        for (number, (pattern, gain)) in patterns.iter().zip(gains).enumerate() {
            let samples = pattern.samples as f64;
            self.cost += 0.5 * samples * gain.log_determinant;
            if gain.slopes.is_empty() {
                continue;
            }
            let products = innovation_products(number, &self.innovations, pattern_of);
            let excess = OutputMatrix::identity() * samples - gain.inverse * products;
            let traces = covariance_traces(gain, &excess);
            let mut rows = traces.rows();
            for (slope, row) in gain.slopes.iter().zip(&mut rows) {
                for (other, trace) in gain.slopes.iter().zip(row) {
                    let information = &mut self.other_information;
                    information[(slope.parameter, other.parameter)] += 0.5 * samples * trace;
                }
            }
            for (slope, trace) in gain.slopes.iter().zip(rows.flatten()) {
                self.other_gradient[slope.parameter] -= 0.5 * trace;
            }
        }
    }

    /// Adds the cost of a rotary gust. `place` returns the number of a parameter.
    pub(super) fn add_rotary_cost(
        &mut self,
        rotary: &RotaryCost,
        place: impl Fn(NoiseParameter) -> usize,
    ) {
        self.cost += rotary.cost;
        let along = rotary.along.map(|(kind, slope)| (place(kind), slope));
        for (i, a) in along {
            self.other_gradient[i] -= rotary.slope * a;
            for (j, b) in along {
                self.other_information[(i, j)] += rotary.curvature * a * b;
            }
        }
    }

    /// Adds a parameter's prior: cost, slope and curvature.
    pub(super) fn add_prior(&mut self, parameter: usize, [cost, slope, curvature]: [f64; 3]) {
        self.cost += cost;
        self.other_gradient[parameter] -= slope;
        self.other_information[(parameter, parameter)] += curvature;
    }
}

/// Sum Σ v v' of the innovations v over the samples of a pattern.
fn innovation_products(
    pattern: usize,
    innovations: &[[f64; OUTPUTS]],
    pattern_of: &[u8],
) -> OutputMatrix {
    let mut sum = OutputMatrix::zeros();
    for (v, pattern_of_sample) in innovations.iter().zip(pattern_of) {
        if usize::from(*pattern_of_sample) == pattern {
            let v = nalgebra::SVector::from(*v);
            sum += v * v.transpose();
        }
    }
    sum
}

/// Traces of the slopes S_i of the innovations' covariance S along the parameters i. The rows have
/// tr(S⁻¹ S_i S⁻¹ S_j); a last row has tr(E S⁻¹ S_j), with E the matrix `excess`.
fn covariance_traces<const NX: usize>(
    gain: &PatternGain<NX>,
    excess: &OutputMatrix,
) -> AlignedMatrix {
    const ENTRIES: usize = OUTPUTS * OUTPUTS;
    let count = gain.slopes.len();
    let mut relative: Vec<OutputMatrix> = Vec::with_capacity(count + 1);
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

#[cfg(test)]
mod tests {
    use super::super::gains::{Gain, GainSlope};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn traces_of_the_covariance_s_slopes_are_those_of_the_matrices() {
        let wave = |n: usize, i: usize, j: usize| (0.3 + (n + 2 * i + 3 * j) as f64).sin();
        let innovations = |n: usize| {
            let half = OutputMatrix::from_fn(|i, j| wave(n, i, j));
            half + half.transpose()
        };
        let slope = |n: usize| GainSlope {
            parameter: n,
            gain: Gain::<4>::zeros(),
            innovations: innovations(n),
        };
        let inverse = OutputMatrix::from_fn(|i, j| if i == j { 2.0 } else { 0.3 });
        let gain = PatternGain {
            inverse,
            slopes: (0..3).map(slope).collect(),
            ..PatternGain::none()
        };
        let excess = OutputMatrix::from_fn(|i, j| wave(7, j, i));
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
