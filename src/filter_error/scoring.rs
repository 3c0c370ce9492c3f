//! Minimisation of the filter's cost: scoring steps, damped where a full step does not lower the
//! cost.
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
/// Predicted decrease of J by a full step below which the iteration may end although the noise
/// still changes. The noise drifts along valleys in which no estimate changes.
const NOISE_TOLERANCE: f64 = 0.1;

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
    let (mut damping, mut slow_steps) = (0.0, 0);
    while scored.iterations < settings.max_iterations {
        let model = scored.model(filter, floors);
        let limits = step_limits(&scored.parameters, floors, filter.first_noise());
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
        if !scored.lower(filter, &model, &limits, &mut damping) {
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
        floors: &[f64],
    ) -> QuadraticModel {
        let (gradient, information) = (
            filter.gradient(&self.response),
            filter.information(&self.response),
        );
        let mut model = QuadraticModel::new(gradient, information);
        let at_floor = |j: usize| self.parameters[j] <= floors[j] && model.gradient()[j] <= 0.0;
        self.free = (0..floors.len()).map(|j| !at_floor(j)).collect();
        filter.fix_noise(&mut self.free);
        for j in (0..self.free.len()).filter(|j| !self.free[*j]) {
            model.fix(j, 0.0);
        }
        model
    }

    /// Tries steps of growing damping until one lowers the cost.
    fn lower<const NX: usize, E: InGusts<NX>>(
        &mut self,
        filter: &JointFilter<NX, E>,
        model: &QuadraticModel,
        limits: &[RangeInclusive<f64>],
        damping: &mut f64,
    ) -> bool {
        // A step may fail after others did: its cost alone is cheap.
        let mut may_fail = *damping > 0.0;
        while *damping < MOST_DAMPING {
            if let Some(step) = model.step(*damping, limits) {
                let both = self.parameters.iter().zip(step.iter());
                let next: Vec<f64> = both.map(|(value, step)| value + step).collect();
                let lowers = |response: &JointResponse| response.cost < self.response.cost;
                let may_lower = !may_fail || filter.innovations(&next).is_ok_and(|r| lowers(&r));
                if may_lower
                    && let Ok(response) = filter.respond(&next)
                    && lowers(&response)
                {
                    let kept = (self.response.cost - response.cost) / model.predicted_gain(&step);
                    (self.parameters, self.response) = (next, response);
                    *damping = next_damping(*damping, kept, FIRST_DAMPING);
                    return true;
                }
            }
            may_fail = true;
            *damping = raised_damping(*damping, FIRST_DAMPING);
        }
        false
    }
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
            (floor - value).clamp(-LARGEST_FALL, 0.0)..=LARGEST_GROWTH
        }
    })
    .collect()
}
