//! Quadratic model of the cost about some parameters, and its minimum within the limits of a step.

use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector};

use crate::numerics::linear_algebra::symmetric::solve_damped;

/// Quadratic model of the cost J.
#[derive(Clone, Debug)]
pub(super) struct QuadraticModel {
    /// Gradient of −J; of a fixed parameter its change.
    gradient: DVector<f64>,
    /// Second gradient of J. Rows and columns of fixed parameters are those of the unit matrix.
    information: DMatrix<f64>,
}

impl QuadraticModel {
    pub fn new(gradient: DVector<f64>, information: DMatrix<f64>) -> Self {
        QuadraticModel {
            gradient,
            information,
        }
    }

    pub fn gradient(&self) -> &DVector<f64> {
        &self.gradient
    }

    pub fn information(&self) -> &DMatrix<f64> {
        &self.information
    }

    /// Fixes the change of a parameter; the gradient of the others follows it.
    pub fn fix(&mut self, j: usize, change: f64) {
        self.gradient
            .axpy(-change, &self.information.column(j), 1.0);
        self.gradient[j] = change;
        self.information.row_mut(j).fill(0.0);
        self.information.column_mut(j).fill(0.0);
        self.information[(j, j)] = 1.0;
    }

    /// Step towards the minimum within the limits of each parameter, which contain zero. `None` if the
    /// information is singular.
    ///
    /// A parameter that reaches a limit is fixed there, and the others go on to their minimum. With a
    /// step that is only cut at the limits, they would follow a change that is not made.
    pub fn step(&self, damping: f64, limits: &[RangeInclusive<f64>]) -> Option<DVector<f64>> {
        let mut rest = self.clone();
        let mut step = DVector::zeros(limits.len());
        let mut fixed = vec![false; limits.len()];
        loop {
            let mut target = solve_damped(&rest.information, &rest.gradient, damping)?;
            for j in (0..fixed.len()).filter(|j| fixed[*j]) {
                target[j] = step[j];
            }
            let Some((j, limit, share)) = first_limit((&step, &target), limits, &fixed) else {
                return Some(target);
            };
            step += share * (target - &step);
            step[j] = limit;
            rest.fix(j, limit);
            fixed[j] = true;
        }
    }

    /// Step with a share of another step's changes from the parameter `first` on; those before it go to
    /// their minimum. `None` if their information is singular.
    pub fn with_share(
        &self,
        step: &DVector<f64>,
        share: f64,
        first: usize,
    ) -> Option<DVector<f64>> {
        if share >= 1.0 {
            return Some(step.clone());
        }
        let changes = share * step.rows_range(first..);
        let coupling = self.information.view_range(..first, first..);
        let gradient = self.gradient.rows_range(..first) - coupling * &changes;
        let information = self.information.view_range(..first, ..first).into_owned();
        let before = solve_damped(&information, &gradient, 0.0)?;
        let both = before.iter().chain(&changes).copied();
        Some(DVector::from_iterator(step.len(), both))
    }

    /// Decrease of J by a step.
    pub fn predicted_gain(&self, step: &DVector<f64>) -> f64 {
        self.gradient.dot(step) - 0.5 * (&self.information * step).dot(step)
    }
}

/// First limit on the way from a step to another: its parameter, its value and the share of the way.
fn first_limit(
    (from, to): (&DVector<f64>, &DVector<f64>),
    limits: &[RangeInclusive<f64>],
    fixed: &[bool],
) -> Option<(usize, f64, f64)> {
    let limits = limits.iter().enumerate();
    let beyond = limits.filter(|(j, limits)| !fixed[*j] && !limits.contains(&to[*j]));
    let way = beyond.map(|(j, limits)| {
        let limit = to[j].clamp(*limits.start(), *limits.end());
        (j, limit, (limit - from[j]) / (to[j] - from[j]))
    });
    way.min_by(|a, b| a.2.total_cmp(&b.2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    /// Two parameters without limits and two with.
    fn model() -> QuadraticModel {
        let root = DMatrix::from_row_slice(
            4,
            4,
            &[
                2.0, 0.3, 1.1, -0.4, 0.2, 1.5, -0.7, 0.9, 0.5, -0.6, 1.0, 0.3, -0.1, 0.8, 0.4, 0.7,
            ],
        );
        let gradient = DVector::from_column_slice(&[1.0, -2.0, 3.0, 2.5]);
        QuadraticModel::new(gradient, root.tr_mul(&root))
    }

    const FREE: RangeInclusive<f64> = f64::NEG_INFINITY..=f64::INFINITY;

    #[test]
    fn a_step_without_limits_ends_at_the_minimum() {
        let model = model();
        let step = model.step(0.0, &[FREE; 4]).unwrap();
        assert_abs_diff_eq!(
            model.information() * &step,
            *model.gradient(),
            epsilon = 1e-9
        );
        let gain = 0.5 * model.gradient().dot(&step);
        assert_relative_eq!(model.predicted_gain(&step), gain, max_relative = 1e-12);
    }

    #[test]
    fn parameters_without_limits_end_at_the_minimum_for_those_at_their_limits() {
        let model = model();
        let full = model.step(0.0, &[FREE; 4]).unwrap();
        let limits = [FREE, FREE, -0.5..=1.5, -0.4..=1.0];
        let step = model.step(0.0, &limits).unwrap();
        assert!(!limits[2].contains(&full[2]) || !limits[3].contains(&full[3]));
        let slope = model.gradient() - model.information() * &step;
        for j in 0..4 {
            // At the upper limit a further step would still lower the cost.
            let (least, most) = (*limits[j].start(), *limits[j].end());
            match step[j] {
                s if s >= most => assert!(slope[j] > 0.0, "{slope}"),
                s if s <= least => assert!(slope[j] < 0.0, "{slope}"),
                _ => assert_abs_diff_eq!(slope[j], 0.0, epsilon = 1e-9),
            }
        }
        let pairs = full.iter().zip(&limits);
        let cut = pairs.map(|(full, limits)| full.clamp(*limits.start(), *limits.end()));
        let cut = DVector::from_iterator(4, cut);
        assert!(model.predicted_gain(&step) > model.predicted_gain(&cut));
    }

    #[test]
    fn limits_hold_for_damped_steps_too() {
        let limits = [FREE, FREE, -0.01..=0.02, 0.0..=0.0];
        for damping in [0.0, 1e-4, 1.0, 1e4] {
            let step = model().step(damping, &limits).unwrap();
            assert!(limits[2].contains(&step[2]) && step[3] == 0.0, "{step}");
        }
    }

    #[test]
    fn a_gradient_without_a_value_gives_no_endless_search() {
        let gradient = DVector::from_element(2, f64::NAN);
        let model = QuadraticModel::new(gradient, DMatrix::identity(2, 2));
        let step = model.step(0.0, &[-1.0..=1.0, FREE]);
        assert!(step.is_none_or(|step| step.iter().any(|s| s.is_nan())));
    }

    #[test]
    fn parameters_before_a_shortened_step_end_at_their_minimum() {
        let model = model();
        let full = model.step(0.0, &[FREE; 4]).unwrap();
        for share in [0.0, 0.4, 1.0] {
            let step = model.with_share(&full, share, 2).unwrap();
            let slope = model.gradient() - model.information() * &step;
            for j in 0..2 {
                assert_abs_diff_eq!(slope[j], 0.0, epsilon = 1e-9);
                assert_relative_eq!(step[j + 2], share * full[j + 2]);
            }
        }
    }

    #[test]
    fn a_fixed_parameter_changes_as_stated() {
        let mut fixed = model();
        fixed.fix(1, 0.25);
        let step = fixed.step(0.0, &[FREE; 4]).unwrap();
        assert_relative_eq!(step[1], 0.25);
        let slope = model().gradient() - model().information() * &step;
        for j in [0, 2, 3] {
            assert_abs_diff_eq!(slope[j], 0.0, epsilon = 1e-9);
        }
    }
}
