//! Which parameters to hold at values known from elsewhere: those of which the wind tunnel knows
//! more than the maneuver.
//!
//! Estimated, parameter j has the variance `V_j` from noise; held, the variance `u_j²` of the value
//! it is held at. Holding it changes the covariance of all others by `g (u_j² − V_j) gᵀ`: with
//! weights that are the inverse of the noise's variances it lowers the mean square error of every
//! one of them exactly where `u_j² < V_j`, and raises it everywhere else (Toro-Vizcarrondo and
//! Wallace 1968). So the ratio `√V_j / u_j` decides, above one for hold. `V_j` is the corrected
//! variance `H_F⁻¹ M_F H_F⁻¹` for the free set F; information matrix H and gradient covariance M of
//! all parameters give it for every F without another fit.
//!
//! What the errors of values already held do to parameter j is no reason to hold it too: free, it
//! takes those errors up and spares the others. Counted, they would make each held value hold the
//! next.
//!
//! The worst is held first, until none is above one; then each held one that alone would be below
//! one again is freed, at most once. So it ends.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::symmetric::{scale, scaled};
use crate::output_error::bounds::coloured;
use crate::output_error::bounds::coloured::Noise;
use crate::output_error::bounds::data::Bounded;
use crate::output_error::case::Case;
use crate::output_error::likelihood::cost::sums;

/// Parameters to be held or estimated: what the data say of all of them together, and how well some
/// of them are known from elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidates {
    information: DMatrix<f64>,
    /// Σ Sᵀ W R W S.
    scatter: DMatrix<f64>,
    /// Standard uncertainty of the value a parameter may be held at; none for one that may not be
    /// held.
    uncertainty: Vec<Option<f64>>,
    max_condition_number: f64,
}

/// Why a parameter is better held, all others being as they are.
#[derive(Clone, Debug, PartialEq)]
pub enum Because {
    /// The data do not feel it: its regressor did not move.
    NotFelt,
    /// Free, it would take part in a direction that the data do not determine, with these others.
    NotToldApart(Vec<usize>),
    /// Free, its bound would be larger than the uncertainty of the value it is held at. The
    /// estimate it would correlate with most, and how.
    Bound {
        bound: f64,
        uncertainty: f64,
        partner: Option<(usize, f64)>,
    },
}

/// A parameter takes part in an undetermined direction when its share of the unit vector's square
/// is at least this: a smaller part would hardly be determined by holding it.
const TAKES_PART: f64 = 0.01;

/// What a set of free parameters knows of itself.
enum Known {
    Determined {
        bounds: DVector<f64>,
        inverse: DMatrix<f64>,
    },
    /// The least determined direction, in the parameters' units; zero where one takes no part.
    Undetermined(DVector<f64>),
}

impl Candidates {
    /// What the data say of a case with all parameters free at `values`; none where its integration
    /// diverges.
    ///
    /// The noise is best that of the fit that holds least: with more held, residuals are errors of
    /// the held values too, and would make the data look worse than they are.
    #[must_use]
    pub fn gather<const NX: usize, E: Equations<NX>>(
        case: &Case<NX, E>,
        values: &[f64],
        noise: &Noise,
        weights: &[f64; OUTPUTS],
        uncertainty: Vec<Option<f64>>,
        max_condition_number: f64,
    ) -> Option<Candidates> {
        let mut response = case.response();
        case.respond(values, &mut response).ok()?;
        let information = sums(&response, weights).information;
        let scatter = coloured::gradient_covariance(&case.series(&response, weights), noise);
        Some(Candidates {
            information,
            scatter,
            uncertainty,
            max_condition_number,
        })
    }

    /// What must be held besides `held` for the data to determine the rest, as far as it may be
    /// held.
    #[must_use]
    pub fn determined(&self, mut held: Vec<bool>) -> Vec<bool> {
        while let Some(lost) = self.undetermined(&held) {
            held[lost] = true;
        }
        held
    }

    /// Which parameters to hold, from those `held` so far. `released` remembers which have been
    /// freed again: a second time none is.
    #[must_use]
    pub fn settle(&self, mut held: Vec<bool>, released: &mut [bool]) -> Vec<bool> {
        loop {
            while let Some(worst) = self.worst(&held) {
                held[worst] = true;
            }
            match self.wrongly_held(&held, released) {
                Some(j) => {
                    held[j] = false;
                    released[j] = true;
                }
                None => return held,
            }
        }
    }

    /// Why a held parameter is held; none where, freed alone, it would be determined better than by
    /// what it is held at.
    #[must_use]
    pub fn because(&self, held: &[bool], parameter: usize) -> Option<Because> {
        if self.information[(parameter, parameter)] <= 0.0 {
            return Some(Because::NotFelt);
        }
        let mut freed = held.to_vec();
        freed[parameter] = false;
        let free = indices(&freed, false);
        let at = free.iter().position(|&j| j == parameter)?;
        match self.known(&free) {
            Known::Undetermined(direction) if direction[at] != 0.0 => {
                let others = free
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| *i != at && direction[*i] != 0.0);
                Some(Because::NotToldApart(others.map(|(_, &j)| j).collect()))
            }
            Known::Undetermined(_) => None,
            Known::Determined { bounds, inverse } => {
                let uncertainty = self.uncertainty[parameter]?;
                let unit = scale(&inverse);
                let correlation = |i: usize| inverse[(i, at)] * unit[i] * unit[at];
                let partner = (0..free.len())
                    .filter(|&i| i != at)
                    .max_by(|&a, &b| correlation(a).abs().total_cmp(&correlation(b).abs()))
                    .map(|i| (free[i], correlation(i)));
                let bound = bounds[at];
                (bound > uncertainty).then_some(Because::Bound {
                    bound,
                    uncertainty,
                    partner,
                })
            }
        }
    }

    /// The free parameter that is not felt, or of an undetermined direction the one that the tunnel
    /// knows best along it.
    fn undetermined(&self, held: &[bool]) -> Option<usize> {
        let free = indices(held, false);
        let silent =
            |j: &usize| self.uncertainty[*j].is_some() && self.information[(*j, *j)] <= 0.0;
        match free.iter().copied().find(silent) {
            Some(j) => Some(j),
            None => match self.known(&free) {
                Known::Undetermined(direction) => self.largest_ratio(&free, &direction.abs(), 0.0),
                Known::Determined { .. } => None,
            },
        }
    }

    /// The free parameter that is best held: an undetermined one, or that of the largest ratio
    /// above one.
    fn worst(&self, held: &[bool]) -> Option<usize> {
        let free = indices(held, false);
        self.undetermined(held).or_else(|| match self.known(&free) {
            Known::Determined { bounds, .. } => self.largest_ratio(&free, &bounds, 1.0),
            Known::Undetermined(_) => None,
        })
    }

    /// Of the parameters that may be held that of the largest size over the tunnel's uncertainty,
    /// above a limit.
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

    /// The held parameter of the smallest ratio, below one, that has not been freed yet.
    fn wrongly_held(&self, held: &[bool], released: &[bool]) -> Option<usize> {
        let ratio = |j: usize| {
            let mut freed = held.to_vec();
            freed[j] = false;
            let free = indices(&freed, false);
            let at = free.iter().position(|&i| i == j)?;
            match self.known(&free) {
                Known::Determined { bounds, .. } => Some(bounds[at] / self.uncertainty[j]?),
                Known::Undetermined(_) => None,
            }
        };
        let candidates = indices(held, true)
            .into_iter()
            .filter(|&j| !released[j] && self.information[(j, j)] > 0.0);
        let ratios = candidates.filter_map(|j| Some((j, ratio(j)?)));
        ratios
            .filter(|(_, ratio)| *ratio < 1.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(j, _)| j)
    }

    fn known(&self, free: &[usize]) -> Known {
        let part = |m: &DMatrix<f64>| {
            DMatrix::from_fn(free.len(), free.len(), |i, j| m[(free[i], free[j])])
        };
        let own = part(&self.information);
        if own.is_empty() {
            return Known::Determined {
                bounds: DVector::zeros(0),
                inverse: own,
            };
        }
        let unit = scale(&own);
        let eigen = SymmetricEigen::new(scaled(&own, &unit));
        let least = eigen.eigenvalues.imin();
        if eigen.eigenvalues[least] <= eigen.eigenvalues.max() / self.max_condition_number {
            let vector = eigen.eigenvectors.column(least);
            let takes_part = |v: f64| if v * v >= TAKES_PART { v } else { 0.0 };
            return Known::Undetermined(DVector::from_fn(free.len(), |i, _| {
                takes_part(vector[i]) * unit[i]
            }));
        }
        let inverse = &eigen.eigenvectors
            * DMatrix::from_diagonal(&eigen.eigenvalues.map(|l| 1.0 / l))
            * eigen.eigenvectors.transpose();
        let inverse = scaled(&inverse, &unit);
        let covariance = &inverse * part(&self.scatter) * &inverse;
        Known::Determined {
            bounds: covariance.diagonal().map(f64::sqrt),
            inverse,
        }
    }
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

    /// White noise of unit variance and weight: the scatter is the information.
    fn evidence(information: DMatrix<f64>, uncertainty: Vec<Option<f64>>) -> Candidates {
        Candidates {
            scatter: information.clone(),
            information,
            uncertainty,
            max_condition_number: 1e10,
        }
    }

    fn settled(evidence: &Candidates) -> Vec<bool> {
        let n = evidence.uncertainty.len();
        evidence.settle(vec![false; n], &mut vec![false; n])
    }

    /// Two parameters that correlate by ρ = 0.9, of bound 1/√(1-ρ²) = 2.29 when both are free and 1
    /// when alone.
    fn pair(first: Option<f64>, second: Option<f64>) -> Candidates {
        evidence(
            DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.9, 1.0]),
            vec![first, second],
        )
    }

    #[test]
    fn what_the_maneuver_knows_better_than_the_tunnel_is_estimated() {
        assert_eq!(settled(&pair(Some(2.4), Some(2.4))), [false, false]);
    }

    #[test]
    fn of_two_that_correlate_the_one_that_the_tunnel_knows_best_is_held_and_the_other_is_then_free()
    {
        // The second's bound, with the first held, is 1: below the tunnel's 1.2.
        let e = pair(Some(0.5), Some(1.2));
        assert_eq!(settled(&e), [true, false]);
        let Some(Because::Bound {
            bound,
            uncertainty,
            partner,
        }) = e.because(&[true, false], 0)
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
    fn the_error_of_what_is_held_is_no_reason_to_hold_the_next() {
        // With the first held at ±1.0 the second is off by √(1 + 0.9²) = 1.35, more than the
        // tunnel's 1.2, but from noise by 1 only: it takes up the error of the first.
        assert_eq!(settled(&pair(Some(1.0), Some(1.2))), [true, false]);
        assert_eq!(settled(&pair(Some(0.95), Some(0.9))), [true, true]);
    }

    #[test]
    fn what_cannot_be_held_is_free_however_badly_it_is_determined() {
        assert_eq!(settled(&pair(None, None)), [false, false]);
        assert_eq!(settled(&pair(None, Some(1e-3))), [false, true]);
    }

    #[test]
    fn of_two_that_are_proportional_one_is_held_and_said_not_to_be_told_apart() {
        let e = evidence(
            DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]),
            vec![Some(50.0), Some(20.0)],
        );
        // Along the undetermined direction (2, -1) the tunnel's uncertainties are passed at 50/2
        // and 20/1: the second first.
        assert_eq!(settled(&e), [false, true]);
        assert_eq!(
            e.because(&[false, true], 1),
            Some(Because::NotToldApart(vec![0]))
        );
    }

    #[test]
    fn what_the_data_do_not_feel_is_held() {
        let e = evidence(
            DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]),
            vec![Some(10.0), Some(10.0)],
        );
        assert_eq!(settled(&e), [false, true]);
        assert_eq!(e.because(&[false, true], 1), Some(Because::NotFelt));
    }

    #[test]
    fn one_that_was_held_for_another_s_sake_is_freed_again_once() {
        let e = pair(Some(0.5), Some(1.2));
        let mut released = vec![false; 2];
        assert_eq!(e.settle(vec![true, true], &mut released), [true, false]);
        assert_eq!(released, [false, true]);
        assert_eq!(e.settle(vec![true, true], &mut released), [true, true]);
    }
}
