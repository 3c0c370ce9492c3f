//! State of the joint fit of a flight's windows: shared parameters, their prior, and a Gauss-Newton
//! step of all parameters.
//!
//! The cost is J = Σ v²/(2R) + Σ θ²/(2P) over residuals v and shared parameters θ. The windows' own
//! parameters are eliminated window by window, so the work is proportional to the number of
//! windows. A delay common to all channels is no error: the mean of the delays, with the weights
//! 1/P, is held at zero.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::parameters::{ALL_KINDS, KINDS, Kind, PARAMETERS, Parameters};
use super::settings::Compatibility;
use super::window_fit::{FitContext, WindowFit};
use crate::numerics::linear_algebra::symmetric;

/// Largest number of halvings of a step that raises the cost; after them the step is dropped. A Gauss-Newton
/// step that raises the cost at 1/32 of its length is wrong in its direction, and not in its length.
const HALVINGS: usize = 5;

/// Rise of twice the cost that is ignored: that of a tenth of a standard deviation. A gradient of
/// interpolated sensitivities is not exact, so its last steps may raise the cost by this amount.
const LEAST_RISE: f64 = 0.01;

/// Largest move of a parameter, as a share of its bound, at which the fit is settled. Such a step is not
/// taken: the estimates are computed to first order about the parameters, and contain it.
pub const SETTLED: f64 = 0.1;

/// Largest move of a parameter, as a fraction of its bound, for which the sensitivities remain
/// usable. They change with the motion, and a move of two bounds hardly changes the motion.
const LINEAR: f64 = 2.0;

/// Standard deviation of the delays' weighted mean, s: a tenth of the error of the equations'
/// timing, so that the mean does not move.
const COMMON_DELAY_S: f64 = 1e-4;

/// Estimates of the shared parameters with their covariance, which contains the inputs' noise.
pub struct Posterior {
    pub values: Parameters,
    pub covariance: DMatrix<f64>,
}

/// Factor on an estimate, and its variance, without the prior. The estimate is `share` times the
/// truth, plus noise; the prior's part of its variance is (1 − share)² P.
pub fn without_prior(share: f64, variance: f64, prior: f64) -> (f64, f64) {
    let of_noise = variance - ((1.0 - share) * prior).powi(2);
    (share.recip(), of_noise.max(0.0) / (share * share))
}

/// Range of a scale error: a factor of 0.2 to 5, beyond which the relation checks have refused the
/// channel.
const SCALE_RANGE: (f64, f64) = (-0.8, 4.0);

/// Joint fit of a flight's windows.
pub struct JointState<'a> {
    pub context: FitContext<'a>,
    /// Parameters that are estimated: of recorded instruments, and observable.
    pub estimated: [bool; PARAMETERS],
    pub windows: Vec<WindowFit<'a>>,
    pub shared: Parameters,
    /// Standard deviations of the prior, √P.
    pub prior: Parameters,
}

/// `true` for a value at the limit of its search range.
pub fn is_at_limit(parameter: usize, value: f64, settings: &Compatibility) -> bool {
    match kind_of(parameter) {
        Kind::Delay => value.abs() >= settings.longest_delay_s,
        Kind::Scale => value <= SCALE_RANGE.0 || value >= SCALE_RANGE.1,
        Kind::Bias => false,
    }
}

pub fn kind_of(parameter: usize) -> Kind {
    ALL_KINDS[parameter % KINDS]
}

impl JointState<'_> {
    /// Information of the data on the shared parameters.
    fn information(&self) -> DMatrix<f64> {
        let zero = DMatrix::zeros(PARAMETERS, PARAMETERS);
        self.windows
            .iter()
            .fold(zero, |sum, window| sum + window.information())
    }

    /// Takes a step, and a second one if the first left the linear range of the sensitivities. Then
    /// estimates R again. Further steps would converge with weights that change anyway. Returns the
    /// largest move of the first step over its bound.
    pub fn settle(&mut self) -> Option<f64> {
        let largest = self.step()?;
        if largest > LINEAR {
            self.step()?;
        }
        let context = &self.context;
        self.windows
            .par_iter_mut()
            .for_each(|window| window.reweigh(context));
        Some(largest)
    }

    /// Counts the inputs' noise in the evidence of the windows.
    pub fn count_input_noise(&mut self) {
        let context = &self.context;
        self.windows
            .par_iter_mut()
            .for_each(|window| window.count_input_noise(context));
    }

    /// Estimates of the shared parameters from the windows' evidence, to first order about the present
    /// ones. The fit minimises a cost without the inputs' noise, so its own values follow the random
    /// walk of short windows too closely.
    pub fn posterior(&self) -> Option<Posterior> {
        let covariance = self.inverse(&self.evidence_information())?;
        let step = &covariance * self.evidence_gradient();
        Some(Posterior {
            values: self.moved(&step, 1.0),
            covariance,
        })
    }

    /// Share of the information on a parameter that comes from the data, for the inverse of all.
    pub fn data_share(&self, inverse: &DMatrix<f64>, parameter: usize) -> f64 {
        1.0 - inverse[(parameter, parameter)] / self.prior[parameter].powi(2)
    }

    /// Information of the data on the shared parameters, with the inputs' noise.
    pub fn evidence_information(&self) -> DMatrix<f64> {
        let zero = DMatrix::zeros(PARAMETERS, PARAMETERS);
        let windows = self.windows.iter();
        windows.fold(zero, |sum, window| sum + &window.evidence.0)
    }

    /// Negative gradient on the shared parameters of data and prior, with the inputs' noise.
    pub fn evidence_gradient(&self) -> DVector<f64> {
        let windows = self.windows.iter();
        windows.fold(self.prior_gradient(), |sum, window| {
            sum + &window.evidence.1
        })
    }

    /// Takes one step of all parameters, unless they are settled. Returns the largest move of a shared
    /// one over its bound; zero if no fraction of the step lowers the cost.
    fn step(&mut self) -> Option<f64> {
        let inverse = self.inverse(&self.information())?;
        let step = &inverse * self.gradient();
        let largest = self.largest_move(&self.moved(&step, 1.0), &inverse);
        if largest < SETTLED {
            return Some(largest);
        }
        let cost = self.cost(&self.windows, &self.shared);
        let mut share = 1.0;
        for _ in 0..=HALVINGS {
            let trial = self.moved(&step, share);
            // Collected in the order of the windows, so that no sum depends on the threads.
            let moved: Option<Vec<WindowFit>> = self
                .windows
                .par_iter()
                .map(|window| window.moved(&self.context, &trial, &step, share))
                .collect();
            if let Some(moved) = moved
                && self.cost(&moved, &trial) <= cost + LEAST_RISE
            {
                let largest = self.largest_move(&trial, &inverse);
                self.windows = moved;
                self.shared = trial;
                if largest > LINEAR {
                    self.linearise();
                }
                return Some(largest);
            }
            share *= 0.5;
        }
        Some(0.0)
    }

    fn linearise(&mut self) {
        let (context, shared) = (&self.context, &self.shared);
        self.windows
            .par_iter_mut()
            .for_each(|window| window.linearise(context, shared));
    }

    /// Largest move of a shared parameter over its bound.
    fn largest_move(&self, trial: &Parameters, inverse: &DMatrix<f64>) -> f64 {
        (0..PARAMETERS)
            .filter(|j| self.estimated[*j])
            .map(|j| (trial[j] - self.shared[j]).abs() / inverse[(j, j)].sqrt())
            .fold(0.0, f64::max)
    }

    /// The shared parameters after a share of a step, kept in their ranges.
    fn moved(&self, step: &DVector<f64>, share: f64) -> Parameters {
        let longest = self.context.settings.longest_delay_s;
        std::array::from_fn(|j| {
            let value = self.shared[j] + share * step[j];
            match kind_of(j) {
                Kind::Delay => value.clamp(-longest, longest),
                Kind::Scale => value.clamp(SCALE_RANGE.0, SCALE_RANGE.1),
                Kind::Bias => value,
            }
        })
    }

    /// Negative gradient of the cost on the shared parameters, of data and prior.
    fn gradient(&self) -> DVector<f64> {
        let windows = self.windows.iter();
        windows.fold(self.prior_gradient(), |sum, window| sum + &window.gradient)
    }

    /// Negative gradient of the prior's cost.
    fn prior_gradient(&self) -> DVector<f64> {
        let common = self.common_delay_weights();
        let mean: f64 = common.iter().zip(&self.shared).map(|(c, v)| c * v).sum();
        let of_prior = |j: usize| {
            if self.estimated[j] {
                self.shared[j] / (self.prior[j] * self.prior[j])
            } else {
                0.0
            }
        };
        DVector::from_fn(PARAMETERS, |j, _| -of_prior(j) - common[j] * mean)
    }

    /// Twice the cost 2J of windows at shared parameters.
    fn cost(&self, windows: &[WindowFit], shared: &Parameters) -> f64 {
        let of_prior: f64 = shared
            .iter()
            .zip(&self.prior)
            .map(|(v, p)| (v / p).powi(2))
            .sum();
        let common = self.common_delay_weights();
        let mean: f64 = common.iter().zip(shared).map(|(c, v)| c * v).sum();
        windows.iter().map(|window| window.cost).sum::<f64>() + of_prior + mean * mean
    }

    /// Weights of the delays in their mean, over the mean's standard deviation.
    fn common_delay_weights(&self) -> Parameters {
        let weight = |j: usize| {
            if self.estimated[j] && kind_of(j) == Kind::Delay {
                1.0 / (self.prior[j] * self.prior[j])
            } else {
                0.0
            }
        };
        let sum: f64 = (0..PARAMETERS).map(weight).sum();
        std::array::from_fn(|j| weight(j) / sum / COMMON_DELAY_S)
    }

    /// (H + P⁻¹)⁻¹ over the estimated parameters for information H of the data; zero elsewhere.
    pub fn inverse(&self, information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let (common, prior) = (self.common_delay_weights(), &self.prior);
        let both = |i: usize, j: usize| self.estimated[i] && self.estimated[j];
        // In units of the prior, whose own information then is the unit matrix.
        let whitened = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| {
            let own = f64::from(u8::from(i == j));
            let of_data = information[(i, j)] + common[i] * common[j];
            if both(i, j) {
                of_data * prior[i] * prior[j] + own
            } else {
                own
            }
        });
        let inverse = symmetric::inverse(&whitened)?;
        Some(DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| {
            if both(i, j) {
                inverse[(i, j)] * prior[i] * prior[j]
            } else {
                0.0
            }
        }))
    }
}
