//! Choice of the parameters to hold at wind-tunnel values: those whose tunnel values are more
//! accurate than estimates from the maneuver.
//!
//! An estimated parameter j has the variance `V_j` from noise; a held one has the variance `u_j²`
//! of its tunnel value. Holding it changes the covariance of all others by `g (u_j² − V_j) gᵀ`.
//! Assume weights equal to the inverse noise variances. Holding then lowers the mean square error
//! of every other parameter if and only if `u_j² < V_j` (Toro-Vizcarrondo and Wallace 1968). So the
//! ratio `√V_j / u_j` decides: hold above one. `V_j` is the corrected variance `H_F⁻¹ M_F H_F⁻¹`
//! for the free set F. Information matrix H and gradient covariance M of all parameters give it for
//! every F without another fit.
//!
//! Errors of values that are already held do not count in `V_j`: a free parameter absorbs them and
//! spares the others. If these errors counted, each held value would cause the next parameter to be
//! held.
//!
//! The parameter of the largest ratio is held first, until no ratio is above one. Then each held
//! parameter whose ratio alone is below one is freed, at most once, so the iteration ends.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::linear_algebra::symmetric::{inverse, scale, scaled};
use crate::output_error::bounds::bounded::Bounded;
use crate::output_error::bounds::coloured::{self, ResidualNoise};
use crate::output_error::case::Case;
use crate::output_error::likelihood::cost::sums;

/// Information on all parameters that may be held or estimated, with the uncertainty of their
/// tunnel values.
#[derive(Clone, Debug, PartialEq)]
pub struct HoldingCandidates {
    information: DMatrix<f64>,
    /// Covariance Σ Sᵀ W R W S of the gradient.
    gradient_covariance: DMatrix<f64>,
    /// Standard uncertainty of the tunnel value; `None` for a parameter that may not be held.
    uncertainty: Vec<Option<f64>>,
    max_condition_number: f64,
}

/// Reason to hold a parameter while the others stay free or held as they are.
#[derive(Clone, Debug, PartialEq)]
pub enum HoldingReason {
    /// The regressor did not move, so the data do not depend on the parameter.
    NotExcited,
    /// If free, the parameter would take part in a direction that the data do not determine,
    /// together with these parameters.
    NotSeparable(Vec<usize>),
    /// If free, the parameter would have a bound above the uncertainty of its tunnel value.
    /// `partner` is the estimate with the largest correlation, and that correlation.
    Bound {
        bound: f64,
        uncertainty: f64,
        partner: Option<(usize, f64)>,
    },
}

/// Share of an undetermined direction's unit square above which a parameter takes part. Holding a
/// parameter with a smaller share would hardly determine the direction.
const DIRECTION_SHARE: f64 = 0.01;

/// Identifiability of a set of free parameters.
enum FreeSet {
    Determined {
        bounds: DVector<f64>,
        inverse: DMatrix<f64>,
    },
    /// Least determined direction, in the parameters' units; zero where a parameter takes no part.
    Undetermined(DVector<f64>),
}

impl HoldingCandidates {
    /// Gathers the information on a case with all parameters free at `values`; `None` if its
    /// integration diverges.
    ///
    /// The noise is best taken from the fit that holds least. With more held, residuals contain
    /// errors of the held values, and the data would appear worse than they are.
    #[must_use]
    pub fn gather<const NX: usize, E: Equations<NX>>(
        case: &Case<NX, E>,
        values: &[f64],
        noise: &ResidualNoise,
        weights: &[f64; OUTPUTS],
        uncertainty: Vec<Option<f64>>,
        max_condition_number: f64,
    ) -> Option<HoldingCandidates> {
        let mut response = case.response();
        case.respond(values, &mut response).ok()?;
        let information = sums(&response, weights).information;
        let gradient_covariance =
            coloured::gradient_covariance(&case.series(&response, weights), noise);
        Some(HoldingCandidates {
            information,
            gradient_covariance,
            uncertainty,
            max_condition_number,
        })
    }

    /// Holds parameters besides `held` until the data determine the rest, as far as this is
    /// possible.
    #[must_use]
    pub fn hold_undetermined(&self, mut held: Vec<bool>) -> Vec<bool> {
        while let Some(lost) = self.first_undetermined(&held) {
            held[lost] = true;
        }
        held
    }

    /// Chooses the parameters to hold, starting from `held`. `released` marks those that were freed
    /// before; none is freed twice.
    #[must_use]
    pub fn choose(&self, mut held: Vec<bool>, released: &mut [bool]) -> Vec<bool> {
        loop {
            while let Some(next) = self.next_to_hold(&held) {
                held[next] = true;
            }
            match self.next_to_free(&held, released) {
                Some(j) => {
                    held[j] = false;
                    released[j] = true;
                }
                None => return held,
            }
        }
    }

    /// Reason to hold a held parameter; `None` if, freed alone, its bound would be below the
    /// tunnel's uncertainty.
    #[must_use]
    pub fn reason(&self, held: &[bool], parameter: usize) -> Option<HoldingReason> {
        if self.information[(parameter, parameter)] <= 0.0 {
            return Some(HoldingReason::NotExcited);
        }
        let (free, at) = freed_set(held, parameter)?;
        match self.free_set(&free) {
            FreeSet::Undetermined(direction) if direction[at] != 0.0 => {
                let others = free.iter().zip(direction.iter());
                let others = others.filter(|(j, part)| **j != parameter && **part != 0.0);
                let others = others.map(|(&j, _)| j).collect();
                Some(HoldingReason::NotSeparable(others))
            }
            FreeSet::Undetermined(_) => None,
            FreeSet::Determined { bounds, inverse } => {
                let uncertainty = self.uncertainty[parameter]?;
                let bound = bounds[at];
                (bound > uncertainty).then(|| HoldingReason::Bound {
                    bound,
                    uncertainty,
                    partner: largest_correlation(&inverse, at).map(|(i, c)| (free[i], c)),
                })
            }
        }
    }

    /// Free parameter that is not excited; else, in an undetermined direction, the one with the
    /// most accurate tunnel value along it.
    fn first_undetermined(&self, held: &[bool]) -> Option<usize> {
        let free = indices(held, false);
        let unexcited = free
            .iter()
            .copied()
            .find(|&j| self.uncertainty[j].is_some() && self.information[(j, j)] <= 0.0);
        unexcited.or_else(|| match self.free_set(&free) {
            FreeSet::Undetermined(direction) => self.largest_ratio(&free, &direction.abs(), 0.0),
            FreeSet::Determined { .. } => None,
        })
    }

    /// Free parameter to hold next: an undetermined one, or the one with the largest ratio above
    /// one.
    fn next_to_hold(&self, held: &[bool]) -> Option<usize> {
        let free = indices(held, false);
        self.first_undetermined(held)
            .or_else(|| match self.free_set(&free) {
                FreeSet::Determined { bounds, .. } => self.largest_ratio(&free, &bounds, 1.0),
                FreeSet::Undetermined(_) => None,
            })
    }

    /// Holdable parameter whose size is largest relative to its tunnel uncertainty; `None` if no
    /// ratio exceeds a limit.
    fn largest_ratio(&self, free: &[usize], sizes: &DVector<f64>, limit: f64) -> Option<usize> {
        let ratios = free
            .iter()
            .zip(sizes.iter())
            .filter_map(|(&j, size)| Some((j, size / self.uncertainty[j]?)));
        ratios
            .filter(|(_, ratio)| *ratio > limit)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(j, _)| j)
    }

    /// Held parameter with the smallest ratio below one, unless freed before.
    fn next_to_free(&self, held: &[bool], released: &[bool]) -> Option<usize> {
        let candidates = indices(held, true)
            .into_iter()
            .filter(|&j| !released[j] && self.information[(j, j)] > 0.0);
        let ratios = candidates.filter_map(|j| Some((j, self.ratio_if_freed(held, j)?)));
        ratios
            .filter(|(_, ratio)| *ratio < 1.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(j, _)| j)
    }

    /// Bound of a held parameter, freed alone, relative to the tunnel's uncertainty.
    fn ratio_if_freed(&self, held: &[bool], parameter: usize) -> Option<f64> {
        let (free, at) = freed_set(held, parameter)?;
        match self.free_set(&free) {
            FreeSet::Determined { bounds, .. } => Some(bounds[at] / self.uncertainty[parameter]?),
            FreeSet::Undetermined(_) => None,
        }
    }

    fn free_set(&self, free: &[usize]) -> FreeSet {
        let own = submatrix(&self.information, free);
        if own.is_empty() {
            return FreeSet::Determined {
                bounds: DVector::zeros(0),
                inverse: own,
            };
        }
        let unit = scale(&own);
        let eigen = SymmetricEigen::new(scaled(&own, &unit));
        let least = eigen.eigenvalues.imin();
        let floor = eigen.eigenvalues.max() / self.max_condition_number;
        if let Some(inverse) = inverse(&own).filter(|_| eigen.eigenvalues[least] > floor) {
            let covariance = &inverse * submatrix(&self.gradient_covariance, free) * &inverse;
            return FreeSet::Determined {
                bounds: covariance.diagonal().map(f64::sqrt),
                inverse,
            };
        }
        let direction = eigen.eigenvectors.column(least);
        FreeSet::Undetermined(direction.zip_map(&unit, |v, unit| {
            if v * v >= DIRECTION_SHARE {
                v * unit
            } else {
                0.0
            }
        }))
    }
}

/// Rows and columns of a symmetric matrix.
fn submatrix(matrix: &DMatrix<f64>, places: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(places.len(), places.len(), |i, j| {
        matrix[(places[i], places[j])]
    })
}

/// Free parameters once a held one is freed, and its index among them.
fn freed_set(held: &[bool], parameter: usize) -> Option<(Vec<usize>, usize)> {
    let mut held = held.to_vec();
    held[parameter] = false;
    let free = indices(&held, false);
    let at = free.iter().position(|&j| j == parameter)?;
    Some((free, at))
}

/// Parameter that correlates most with the parameter `at`, and the correlation.
fn largest_correlation(covariance: &DMatrix<f64>, at: usize) -> Option<(usize, f64)> {
    let unit = scale(covariance);
    let others = (0..unit.len()).filter(|&i| i != at);
    others
        .map(|i| (i, covariance[(i, at)] * unit[i] * unit[at]))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

fn indices(flags: &[bool], wanted: bool) -> Vec<usize> {
    flags
        .iter()
        .enumerate()
        .filter(|(_, flag)| **flag == wanted)
        .map(|(j, _)| j)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Candidates under white noise of unit variance and weight: the gradient's covariance is the
    /// information.
    fn candidates(information: DMatrix<f64>, uncertainty: Vec<Option<f64>>) -> HoldingCandidates {
        HoldingCandidates {
            gradient_covariance: information.clone(),
            information,
            uncertainty,
            max_condition_number: 1e10,
        }
    }

    fn chosen(candidates: &HoldingCandidates) -> Vec<bool> {
        let n = candidates.uncertainty.len();
        candidates.choose(vec![false; n], &mut vec![false; n])
    }

    /// Two parameters that correlate by ρ = 0.9. The bound is 1/√(1-ρ²) = 2.29 with both free, and
    /// 1 alone.
    fn pair(first: Option<f64>, second: Option<f64>) -> HoldingCandidates {
        candidates(
            DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.9, 1.0]),
            vec![first, second],
        )
    }

    #[test]
    fn parameters_with_bounds_below_the_tunnel_s_are_estimated() {
        assert_eq!(chosen(&pair(Some(2.4), Some(2.4))), [false, false]);
    }

    #[test]
    fn of_two_correlated_parameters_the_one_with_the_better_tunnel_value_is_held() {
        // With the first held, the second's bound is 1: below the tunnel's 1.2.
        let e = pair(Some(0.5), Some(1.2));
        assert_eq!(chosen(&e), [true, false]);
        let Some(HoldingReason::Bound {
            bound,
            uncertainty,
            partner,
        }) = e.reason(&[true, false], 0)
        else {
            panic!()
        };
        assert_relative_eq!(bound, 1.0 / (1.0_f64 - 0.81).sqrt(), max_relative = 1e-10);
        assert_relative_eq!(uncertainty, 0.5);
        let (with, correlation) = partner.unwrap();
        assert_eq!(with, 1);
        assert_relative_eq!(correlation, -0.9, max_relative = 1e-10);
    }

    #[test]
    fn errors_of_held_values_do_not_cause_the_next_to_be_held() {
        // With the first held at ±1.0 the second is in error by √(1 + 0.9²) = 1.35, above the
        // tunnel's 1.2. Its error from noise is 1 only: it absorbs the error of the first.
        assert_eq!(chosen(&pair(Some(1.0), Some(1.2))), [true, false]);
        assert_eq!(chosen(&pair(Some(0.95), Some(0.9))), [true, true]);
    }

    #[test]
    fn parameters_without_a_tunnel_value_stay_free() {
        assert_eq!(chosen(&pair(None, None)), [false, false]);
        assert_eq!(chosen(&pair(None, Some(1e-3))), [false, true]);
    }

    #[test]
    fn one_of_two_proportional_parameters_is_held_as_not_separable() {
        let e = candidates(
            DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]),
            vec![Some(50.0), Some(20.0)],
        );
        // Along the undetermined direction (2, -1) the tunnel's ratios are 50/2 and 20/1: the
        // second is held.
        assert_eq!(chosen(&e), [false, true]);
        assert_eq!(
            e.reason(&[false, true], 1),
            Some(HoldingReason::NotSeparable(vec![0]))
        );
    }

    #[test]
    fn a_parameter_without_excitation_is_held() {
        let e = candidates(
            DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]),
            vec![Some(10.0), Some(10.0)],
        );
        assert_eq!(chosen(&e), [false, true]);
        assert_eq!(e.reason(&[false, true], 1), Some(HoldingReason::NotExcited));
    }

    #[test]
    fn a_wrongly_held_parameter_is_freed_once() {
        let e = pair(Some(0.5), Some(1.2));
        let mut released = vec![false; 2];
        assert_eq!(e.choose(vec![true, true], &mut released), [true, false]);
        assert_eq!(released, [false, true]);
        assert_eq!(e.choose(vec![true, true], &mut released), [true, true]);
    }
}
