//! Minimisation of the filter's cost: scoring steps, damped where a full step does not lower the
//! cost. The noise's part of a full step is shortened where the last one went beyond the minimum.
//!
//! If a noise is zero, the cost has no minimum in its logarithm. A noise at its floor whose
//! gradient points below the floor is therefore fixed there. Corner and correlation of a fixed
//! rotary gust are fixed with the gust.

use std::cmp::Ordering;
use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector};

use super::joint_filter::{JointFilter, JointResponse};
use super::quadratic_model::QuadraticModel;
use crate::dynamics::InGusts;
use crate::numerics::damping::{next_damping, raised_damping};
use crate::settings::settings;

settings! {
    /// End of the iteration of filter error.
    #[derive(Copy)]
    pub struct Settings {
        /// Most iterations; a maneuver that needs more does not converge.
        pub max_iterations: usize = 60,
        /// Half square of a full step in bounds of the estimates, below which the iteration has
        /// converged. At 1e-3 estimates are within a twentieth of their bounds. Larger: fewer
        /// iterations.
        pub tolerance: f64 = 1e-3,
    }
}

/// First damping after a full step fails, and the one at which no step lowers the cost.
const FIRST_DAMPING: f64 = 1e-4;
const MOST_DAMPING: f64 = 1e8;
/// Largest change of a noise in a step, logarithms: growth by a factor of 4.5, fall by 50. A noise
/// that is absent thus falls to its floor in few steps.
const LARGEST_GROWTH: f64 = 1.5;
const LARGEST_FALL: f64 = 4.0;
/// Distance from its floor at which a noise counts as there: a step to the floor may end one rounding
/// above it.
const ROUNDING: f64 = 1e-12;
/// Predicted decrease of J by a full step below which the iteration may end although the noise
/// still changes. The noise drifts along valleys in which no estimate changes.
const NOISE_TOLERANCE: f64 = 0.1;

/// Least share of a step of the noise, and the share of the predicted gain from which on the noise
/// explains the decrease of a step.
const LEAST_SHARE: f64 = 0.4;
const MOSTLY_BY_NOISE: f64 = 0.5;

/// Number of successive steps that lower J by less than the tolerance, after which the iteration
/// ends. Such steps follow a valley across which the second gradient is not exact.
const SLOW_STEPS: usize = 3;

/// Result of the iteration.
#[derive(Clone, Debug)]
pub struct Scored {
    pub converged: bool,
    pub reason: String,
    pub iterations: usize,
    pub initial_cost: f64,
    pub parameters: Vec<f64>,
    /// Parameters that are not fixed at a floor.
    pub free: Vec<bool>,
    pub response: JointResponse,
}

/// Minimises the cost from a start; `None` if a filter diverges there. `floors` are the least
/// values of the parameters.
#[must_use]
pub fn minimise<const NX: usize, E: InGusts<NX>>(
    filter: &JointFilter<NX, E>,
    start: Vec<f64>,
    floors: &[f64],
    settings: &Settings,
) -> Option<Scored> {
    let response = filter.respond(&start).ok()?;
    let mut scored = Scored {
        converged: false,
        reason: format!("not converged after {} iterations", settings.max_iterations),
        iterations: 0,
        initial_cost: response.cost,
        free: vec![true; start.len()],
        parameters: start,
        response,
    };
    let (mut tuning, mut slow_steps) = (StepTuning::default(), 0);
    while scored.iterations < settings.max_iterations {
        let limits = step_limits(&scored.parameters, floors, filter.first_noise());
        let model = scored.model(filter, &limits);
        let Some(full) = model.step(0.0, &limits) else {
            "the information matrix is singular".clone_into(&mut scored.reason);
            break;
        };
        let gain = model.predicted_gain(&full);
        let own_gain = own_gain(&full, model.information(), filter.first_noise());
        let settled = gain < NOISE_TOLERANCE && own_gain < settings.tolerance;
        if settled || slow_steps >= SLOW_STEPS {
            scored.converged = true;
            "a further step would not lower the cost".clone_into(&mut scored.reason);
            break;
        }
        scored.iterations += 1;
        let before = scored.response.cost;
        if !scored.lower(filter, &model, (&full, &limits), &mut tuning) {
            "no step lowers the cost".clone_into(&mut scored.reason);
            break;
        }
        let slow = before - scored.response.cost < settings.tolerance;
        slow_steps = if slow { slow_steps + 1 } else { 0 };
    }
    Some(scored)
}

impl Scored {
    /// Orders two results by their cost.
    #[must_use]
    pub fn by_cost(&self, other: &Scored) -> Ordering {
        self.response.cost.total_cmp(&other.response.cost)
    }

    /// Quadratic model about the parameters. Those at their floors are fixed.
    fn model<const NX: usize, E: InGusts<NX>>(
        &mut self,
        filter: &JointFilter<NX, E>,
        limits: &[RangeInclusive<f64>],
    ) -> QuadraticModel {
        let (gradient, information) = (
            filter.gradient(&self.response),
            filter.information(&self.response),
        );
        let mut model = QuadraticModel::new(gradient, information);
        let at_floor = |j: usize| *limits[j].start() >= 0.0 && model.gradient()[j] <= 0.0;
        self.free = (0..limits.len()).map(|j| !at_floor(j)).collect();
        filter.fix_noise(&mut self.free);
        for j in (0..self.free.len()).filter(|j| !self.free[*j]) {
            model.fix(j, 0.0);
        }
        model
    }

    /// Tries the full step and steps of growing damping, until one lowers the cost.
    fn lower<const NX: usize, E: InGusts<NX>>(
        &mut self,
        filter: &JointFilter<NX, E>,
        model: &QuadraticModel,
        (full, limits): (&DVector<f64>, &[RangeInclusive<f64>]),
        tuning: &mut StepTuning,
    ) -> bool {
        let first_noise = filter.first_noise();
        // A damped step may fail: its cost alone is cheap.
        let mut may_fail = tuning.damping > 0.0;
        while tuning.damping < MOST_DAMPING {
            let step = if tuning.damping > 0.0 {
                model.step(tuning.damping, limits)
            } else {
                model.with_share(full, tuning.noise_share, first_noise)
            };
            if let Some(step) = step {
                let both = self.parameters.iter().zip(step.iter());
                let next: Vec<f64> = both.map(|(value, step)| value + step).collect();
                let lowers = |response: &JointResponse| response.cost < self.response.cost;
                let may_lower = !may_fail || filter.innovations(&next).is_ok_and(|r| lowers(&r));
                if may_lower
                    && let Ok(response) = filter.respond(&next)
                    && lowers(&response)
                {
                    let decrease = self.response.cost - response.cost;
                    tuning.follow(decrease, model, (full, &step), first_noise);
                    (self.parameters, self.response) = (next, response);
                    return true;
                }
            }
            may_fail = true;
            tuning.damping = raised_damping(tuning.damping, FIRST_DAMPING);
        }
        false
    }
}

/// Damping and length of the next step, which follow from the steps before.
struct StepTuning {
    damping: f64,
    /// Share of the noise's full step.
    noise_share: f64,
}

impl Default for StepTuning {
    fn default() -> Self {
        StepTuning {
            damping: 0.0,
            noise_share: 1.0,
        }
    }
}

impl StepTuning {
    /// Follows a step that lowered the cost.
    fn follow(
        &mut self,
        decrease: f64,
        model: &QuadraticModel,
        (full, step): (&DVector<f64>, &DVector<f64>),
        first_noise: usize,
    ) {
        let gain = model.predicted_gain(full);
        let without_noise = model.with_share(full, 0.0, first_noise);
        let by_others = without_noise.map_or(0.0, |step| model.predicted_gain(&step));
        let by_noise = gain - by_others;
        self.noise_share = if self.damping == 0.0 && by_noise > MOSTLY_BY_NOISE * gain {
            next_share(self.noise_share, (decrease - by_others) / by_noise)
        } else {
            1.0
        };
        let kept = decrease / model.predicted_gain(step);
        self.damping = next_damping(self.damping, kept, FIRST_DAMPING);
    }
}

/// Share of the noise's next step that ends at the minimum along it.
///
/// The information is the expected curvature of the cost; along the noise the curvature of a maneuver
/// may be twice as large, and full steps zigzag. Let the full step of the noise predict the gain G,
/// and let r be the curvature over the expected one. The share u then gains G (2u − r u²), of which
/// `kept` is the ratio to G. The share 1/r ends at the minimum.
fn next_share(share: f64, kept: f64) -> f64 {
    let curvature = (2.0 * share - kept) / (share * share);
    curvature.max(1.0).recip().max(LEAST_SHARE)
}

/// Half the squared length of the step of the filter's own parameters, in units of their bounds at
/// known noise.
fn own_gain(step: &DVector<f64>, information: &DMatrix<f64>, parameters: usize) -> f64 {
    let step = step.rows(0, parameters);
    0.5 * (information.view((0, 0), (parameters, parameters)) * step).dot(&step)
}

/// Limits of a step: noise changes by a factor at most, and stays above its floor.
fn step_limits(values: &[f64], floors: &[f64], first_noise: usize) -> Vec<RangeInclusive<f64>> {
    let both = values.iter().zip(floors).enumerate();
    both.map(|(j, (value, floor))| {
        if j < first_noise {
            f64::NEG_INFINITY..=f64::INFINITY
        } else {
            let fall = value - floor;
            let most = if fall > ROUNDING {
                fall.min(LARGEST_FALL)
            } else {
                0.0
            };
            -most..=LARGEST_GROWTH
        }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Share of the gain that a share of a step keeps, with a curvature over the expected one.
    fn kept(share: f64, curvature: f64) -> f64 {
        2.0 * share - curvature * share * share
    }

    #[test]
    fn the_next_step_of_the_noise_ends_at_the_minimum_along_it() {
        for share in [0.5, 0.8, 1.0] {
            for curvature in [1.0, 1.3, 1.9, 2.4] {
                let next = next_share(share, kept(share, curvature));
                assert_relative_eq!(next, 1.0 / curvature, max_relative = 1e-12);
            }
        }
    }

    #[test]
    fn a_step_of_the_noise_ends_at_its_floor_and_grows_by_a_factor_at_most() {
        let (values, floors) = ([3.0, -1.0, -9.0, 0.5], [f64::NEG_INFINITY, -9.0, -9.0, 0.0]);
        let limits = step_limits(&values, &floors, 1);
        let free = f64::NEG_INFINITY..=f64::INFINITY;
        assert_eq!(limits, [free, -4.0..=1.5, 0.0..=1.5, -0.5..=1.5]);
        let of_zero = step_limits(&[f64::NEG_INFINITY], &[f64::NEG_INFINITY], 0);
        assert_eq!(of_zero, [0.0..=1.5]);
    }

    #[test]
    fn a_noise_that_a_step_has_taken_to_its_floor_is_there_in_spite_of_rounding() {
        let floor = -0.9;
        let mut rounded = 0;
        for value in (0..100).map(|k| 0.007 * f64::from(k)) {
            let fall = *step_limits(&[value], &[floor], 0)[0].start();
            rounded += usize::from(value + fall > floor);
            let after = step_limits(&[value + fall], &[floor], 0);
            assert_eq!(after, [0.0..=1.5], "{value}");
        }
        assert!(rounded > 0);
    }

    #[test]
    fn a_step_of_the_noise_is_not_lengthened_and_not_stopped() {
        assert_relative_eq!(next_share(1.0, kept(1.0, 0.5)), 1.0);
        assert_relative_eq!(next_share(0.5, kept(0.5, 9.0)), LEAST_SHARE);
    }

    #[test]
    fn a_quadratic_whose_noise_is_twice_as_curved_is_minimised_by_two_steps() {
        let model = |at: f64| {
            QuadraticModel::new(
                DVector::from_column_slice(&[0.0, -2.0 * at]),
                DMatrix::identity(2, 2),
            )
        };
        let (start, mut tuning) = (0.7, StepTuning::default());
        let full = DVector::from_column_slice(&[0.0, -2.0 * start]);
        let cost = |at: f64| at * at;
        let next = 0.3 * start;
        tuning.noise_share = 0.35;
        let step = model(start)
            .with_share(&full, tuning.noise_share, 1)
            .unwrap();
        assert_relative_eq!(start + step[1], next, max_relative = 1e-12);
        tuning.follow(cost(start) - cost(next), &model(start), (&full, &step), 1);
        let full = DVector::from_column_slice(&[0.0, -2.0 * next]);
        let step = model(next)
            .with_share(&full, tuning.noise_share, 1)
            .unwrap();
        assert_relative_eq!(next + step[1], 0.0, epsilon = 1e-12);
    }

    #[test]
    fn a_damped_step_and_a_step_of_other_parameters_leave_the_noise_its_full_step() {
        let model = QuadraticModel::new(
            DVector::from_column_slice(&[2.0, 1.0]),
            DMatrix::identity(2, 2),
        );
        let full = DVector::from_column_slice(&[2.0, 1.0]);
        for damping in [0.0, 1.0] {
            let mut tuning = StepTuning {
                damping,
                noise_share: 0.5,
            };
            tuning.follow(1.0, &model, (&full, &full), 1);
            assert_relative_eq!(tuning.noise_share, 1.0);
        }
    }
}
