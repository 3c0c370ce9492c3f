//! Minimisation of the filter's cost: scoring steps, damped where a full step does not lower the
//! cost.
//!
//! If a noise is zero, the cost has no minimum in its logarithm. A noise at its floor whose
//! gradient points below the floor is therefore fixed there. Corner and correlation of a fixed
//! rotary gust are fixed with the gust.

use std::cmp::Ordering;

use nalgebra::{DMatrix, DVector};

use super::joint_filter::{JointFilter, JointResponse};
use crate::dynamics::InGusts;
use crate::numerics::damping::{next_damping, raised_damping};
use crate::numerics::linear_algebra::symmetric::solve_damped;
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
        let (gradient, information) = scored.free_system(filter, floors);
        let Some(full) = solve_damped(&information, &gradient, 0.0) else {
            "the information matrix is singular".clone_into(&mut scored.reason);
            break;
        };
        let gain = 0.5 * gradient.dot(&full);
        let own_gain = own_gain(&full, &information, filter.first_noise());
        let settled = gain < NOISE_TOLERANCE && own_gain < settings.tolerance;
        if settled || slow_steps >= SLOW_STEPS {
            scored.converged = true;
            "a further step would not lower the cost".clone_into(&mut scored.reason);
            break;
        }
        scored.iterations += 1;
        let before = scored.response.cost;
        if !scored.lower(filter, floors, &gradient, &information, &mut damping) {
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

    /// Fixes the parameters at their floors. Returns gradient and information of the free
    /// parameters; rows of fixed parameters have a unit diagonal and are zero elsewhere.
    fn free_system<const NX: usize, E: InGusts<NX>>(
        &mut self,
        filter: &JointFilter<NX, E>,
        floors: &[f64],
    ) -> (DVector<f64>, DMatrix<f64>) {
        let mut gradient = filter.gradient(&self.response);
        let mut information = filter.information(&self.response);
        let at_floor = |j: usize| self.parameters[j] <= floors[j] && gradient[j] <= 0.0;
        self.free = (0..floors.len()).map(|j| !at_floor(j)).collect();
        filter.fix_noise(&mut self.free);
        for j in (0..self.free.len()).filter(|j| !self.free[*j]) {
            gradient[j] = 0.0;
            information.row_mut(j).fill(0.0);
            information.column_mut(j).fill(0.0);
            information[(j, j)] = 1.0;
        }
        (gradient, information)
    }

    /// Tries steps of growing damping until one lowers the cost.
    fn lower<const NX: usize, E: InGusts<NX>>(
        &mut self,
        filter: &JointFilter<NX, E>,
        floors: &[f64],
        gradient: &DVector<f64>,
        information: &DMatrix<f64>,
        damping: &mut f64,
    ) -> bool {
        // A damped step may fail: its cost alone is cheap.
        let mut may_fail = *damping > 0.0;
        while *damping < MOST_DAMPING {
            if let Some(step) = solve_damped(information, gradient, *damping) {
                let next =
                    stepped_parameters(&self.parameters, &step, floors, filter.first_noise());
                let lowers = |response: &JointResponse| response.cost < self.response.cost;
                let may_lower = !may_fail || filter.innovations(&next).is_ok_and(|r| lowers(&r));
                if may_lower
                    && let Ok(response) = filter.respond(&next)
                    && lowers(&response)
                {
                    let predicted = gradient.dot(&step) - 0.5 * (information * &step).dot(&step);
                    let kept = (self.response.cost - response.cost) / predicted;
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

/// Parameters after a step; noise changes by a factor at most, and stays above its floor.
fn stepped_parameters(
    values: &[f64],
    step: &DVector<f64>,
    floors: &[f64],
    first_noise: usize,
) -> Vec<f64> {
    let all = values.iter().zip(step.iter()).zip(floors).enumerate();
    all.map(|(j, ((value, step), floor))| {
        let step = if j < first_noise {
            *step
        } else {
            step.clamp(-LARGEST_FALL, LARGEST_GROWTH)
        };
        (value + step).max(*floor)
    })
    .collect()
}
