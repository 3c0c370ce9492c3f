//! Slopes of the derivatives over α inside a maneuver, and their effect on the estimates.
//!
//! A slope is a derivative's change over α, as a share of the tunnel's change. The slopes have a
//! normal prior about a common share λ.
//!
//! | symbol | quantity |
//! |---|---|
//! | f, s | the filter's own parameters, and the slopes |
//! | s₀ | slopes at which the fit held them |
//! | H_ff, H_fs, H_ss | blocks of the information at the fit |
//! | g_s | gradient of −J along s at the fit, plus V s₀ |
//! | λ, w | common share, and standard deviation of each slope about it over λ |
//! | m = λ 1, D = λ diag(w) | prior mean of the slopes, and their prior standard deviations |
//! | V = H_ss − H_sf H_ff⁻¹ H_fs | information on the slopes with f eliminated |
//! | G = H_ff⁻¹ H_fs | change of the estimates with the slopes, with reversed sign |
//!
//! For a given λ the slopes have the mean ŝ and the covariance P. The estimates of f change by −G
//! (ŝ − s₀), with the covariance G P G'. The data have the likelihood p:
//!
//! ```text
//! P = D (1 + D V D)⁻¹ D        ŝ = m + P (g_s − V m)
//! p(data | λ) ∝ |1 + D V D|^(−½) exp(g_s' m − ½ m' V m + ½ (g_s − V m)' P (g_s − V m))
//! ```
//!
//! The result is the mean over the shares λ, weighted by p. If the data show constant derivatives,
//! the slopes come out near zero and change nothing.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Shares λ: from 0, constant derivatives, to 1.5, changes half as large again as the tunnel's.
const TRIED_SHARES: [f64; 7] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5];

/// Effect of the slopes on the estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct SlopeEffect {
    /// Mean ŝ of the slopes.
    pub slopes: DVector<f64>,
    /// Change of the filter's own parameters.
    pub change: DVector<f64>,
    /// Covariance of that change.
    pub covariance: DMatrix<f64>,
}

impl SlopeEffect {
    /// Adds the square of the change to the covariance, and leaves the estimates unchanged.
    pub fn replace_change_by_variance(&mut self) {
        self.covariance += &self.change * self.change.transpose();
        self.change.fill(0.0);
    }
}

/// Prior of a slope, over the common share: mean and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopePrior {
    mean: f64,
    deviation: f64,
}

impl SlopePrior {
    /// Prior of a slope along the tunnel's change: the common share itself.
    pub const SHARE: SlopePrior = SlopePrior {
        mean: 1.0,
        deviation: 0.0,
    };
    /// Prior of a slope along one standard deviation from the tunnel's change.
    pub const DEVIATION: SlopePrior = SlopePrior {
        mean: 0.0,
        deviation: 1.0,
    };
}

/// Blocks of the information on own parameters and slopes, with the slopes' gradient.
#[derive(Clone, Debug)]
pub struct SlopeInformation {
    /// Inverse H_ff⁻¹.
    pub inverse: DMatrix<f64>,
    /// Block H_fs.
    pub cross: DMatrix<f64>,
    /// Block H_ss.
    pub slopes: DMatrix<f64>,
    /// Gradient of −J along the slopes.
    pub gradient: DVector<f64>,
    /// Value s₀ at which the fit held each slope.
    pub held_at: DVector<f64>,
    pub priors: Vec<SlopePrior>,
}

/// Slopes and their effect for one share λ.
struct ShareEstimate {
    log_likelihood: f64,
    slopes: DVector<f64>,
    change: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl SlopeInformation {
    /// Computes the slopes' effect; `None` if the information is not positive.
    #[must_use]
    pub fn effect(&self) -> Option<SlopeEffect> {
        let by_slopes = &self.inverse * &self.cross;
        let left = &self.slopes - self.cross.transpose() * &by_slopes;
        let gradient = &self.gradient + &left * &self.held_at;
        let estimates: Vec<ShareEstimate> = TRIED_SHARES
            .iter()
            .map(|share| self.estimate(*share, &gradient, &left, &by_slopes))
            .collect::<Option<_>>()?;
        Some(mean(&estimates, by_slopes.nrows()))
    }

    fn estimate(
        &self,
        share: f64,
        gradient: &DVector<f64>,
        left: &DMatrix<f64>,
        by_slopes: &DMatrix<f64>,
    ) -> Option<ShareEstimate> {
        let n = gradient.len();
        let of_priors = |part: fn(&SlopePrior) -> f64| {
            DVector::from_iterator(n, self.priors.iter().map(|prior| share * part(prior)))
        };
        let deviations = DMatrix::from_diagonal(&of_priors(|prior| prior.deviation));
        let expected = of_priors(|prior| prior.mean);
        let along = left * &expected;
        let scaled = &deviations * left * &deviations;
        let root = Cholesky::new(DMatrix::identity(n, n) + scaled)?;
        let beyond = &deviations * (gradient - &along);
        let unit = root.solve(&beyond);
        let log_determinant: f64 = 2.0 * root.l_dirty().diagonal().map(f64::ln).sum();
        let by_expected = expected.dot(gradient) - 0.5 * expected.dot(&along);
        let slopes = expected + &deviations * &unit;
        let scaled_effect = by_slopes * &deviations;
        Some(ShareEstimate {
            log_likelihood: by_expected + 0.5 * (beyond.dot(&unit) - log_determinant),
            change: by_slopes * (&self.held_at - &slopes),
            slopes,
            covariance: &scaled_effect * root.solve(&scaled_effect.transpose()),
        })
    }
}

/// Mean over the shares, weighted by their likelihoods. The covariance includes the scatter between
/// the shares.
fn mean(estimates: &[ShareEstimate], parameters: usize) -> SlopeEffect {
    let largest = estimates
        .iter()
        .map(|e| e.log_likelihood)
        .fold(f64::MIN, f64::max);
    let weights: Vec<f64> = estimates
        .iter()
        .map(|e| (e.log_likelihood - largest).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    let slopes = estimates.first().map_or(0, |e| e.slopes.len());
    let mut effect = SlopeEffect {
        slopes: DVector::zeros(slopes),
        change: DVector::zeros(parameters),
        covariance: DMatrix::zeros(parameters, parameters),
    };
    for (estimate, weight) in estimates.iter().zip(&weights) {
        effect.slopes += &estimate.slopes * (weight / total);
        effect.change += &estimate.change * (weight / total);
    }
    for (estimate, weight) in estimates.iter().zip(&weights) {
        let off = &estimate.change - &effect.change;
        effect.covariance += (&estimate.covariance + &off * off.transpose()) * (weight / total);
    }
    effect
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Prior of a slope that scatters by half of the common share about it.
    const LINE: SlopePrior = SlopePrior {
        mean: 1.0,
        deviation: 0.5,
    };

    /// One own parameter and one slope: y = f + s t x with x = ±1 at 100 and 50 samples of unit noise.
    fn line(gradient: f64, tunnel: f64) -> SlopeInformation {
        let scalar = |v: f64| DMatrix::from_element(1, 1, v);
        SlopeInformation {
            inverse: scalar(1.0 / 150.0),
            cross: scalar(50.0 * tunnel),
            slopes: scalar(150.0 * tunnel * tunnel),
            gradient: DVector::from_element(1, gradient * tunnel),
            held_at: DVector::zeros(1),
            priors: vec![LINE],
        }
    }

    #[test]
    fn a_fit_that_holds_the_slope_where_it_is_moves_no_further() {
        let mut held = line(0.0, 100.0);
        held.held_at[0] = 0.02;
        let effect = held.effect().unwrap();
        assert_relative_eq!(effect.slopes[0], 0.02, max_relative = 1e-3);
        assert!(effect.change[0].abs() < 1e-3);
    }

    #[test]
    fn a_slope_that_the_data_show_moves_the_estimate_as_least_squares_do() {
        // V = 150 − 50²/150 = 400/3. A slope of 2 leaves the gradient V s; its prior hardly counts.
        let effect = line(400.0 / 3.0 * 2.0, 100.0).effect().unwrap();
        assert_relative_eq!(effect.change[0], -2.0 / 3.0, max_relative = 1e-3);
        let variance = (1.0f64 / 3.0).powi(2) * 3.0 / 400.0;
        assert_relative_eq!(effect.covariance[(0, 0)], variance, max_relative = 0.02);
    }

    #[test]
    fn without_a_sign_of_slopes_the_estimate_stays_and_its_covariance_hardly_grows() {
        let effect = line(0.0, 100.0).effect().unwrap();
        assert!(effect.change[0].abs() < 1e-3 / 3.0);
        // The least squares of a free slope would add the variance (1/3)² 3/400.
        assert!(effect.covariance[(0, 0)] < 0.5 * (1.0f64 / 3.0).powi(2) * 3.0 / 400.0);
    }

    #[test]
    fn slopes_that_the_data_do_not_determine_are_those_of_the_prior() {
        // Without information on the slope each share is as likely.
        let mut flat = line(0.0, 1.0);
        flat.cross[(0, 0)] = 1e-6;
        flat.slopes[(0, 0)] = 1e-9;
        let count = TRIED_SHARES.len() as f64;
        let mean = TRIED_SHARES.iter().sum::<f64>() / count;
        let square = TRIED_SHARES.iter().map(|s| s * s).sum::<f64>() / count;
        let effect = flat.effect().unwrap();
        assert_relative_eq!(effect.slopes[0], mean, max_relative = 1e-6);
        let gain = 1e-6 / 150.0;
        assert_relative_eq!(effect.change[0], -gain * mean, max_relative = 1e-6);
        let variance = gain * gain * (square - mean * mean + LINE.deviation.powi(2) * square);
        assert_relative_eq!(effect.covariance[(0, 0)], variance, max_relative = 1e-6);
    }

    #[test]
    fn well_determined_slopes_determine_the_common_share_of_the_others() {
        // The first slope has a deviation of 0.005; the data have no information on the second.
        let effect = |first: f64| {
            let own = DVector::from_vec(vec![4e4, 1e-12]);
            let information = SlopeInformation {
                inverse: DMatrix::identity(1, 1),
                cross: DMatrix::zeros(1, 2),
                slopes: DMatrix::from_diagonal(&own),
                gradient: DVector::from_vec(vec![4e4 * first, 0.0]),
                held_at: DVector::zeros(2),
                priors: vec![LINE; 2],
            };
            information.effect().unwrap().slopes
        };
        let (changing, constant) = (effect(1.0), effect(0.0));
        assert_relative_eq!(changing[0], 1.0, max_relative = 1e-3);
        assert!(changing[1] > 0.6, "{changing}");
        assert!(constant[1] < 0.1, "{constant}");
    }
}
