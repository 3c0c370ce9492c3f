//! "Consider" covariance: effect of the uncertainty of held values on the estimates.
//!
//! Let S_f and S_h be the sensitivities to free parameters and to held values, and W the weights.
//! Let H be the information on the free parameters, and P the covariance of the held values. The
//! covariance is G P Gᵀ with G = −H⁻¹ Σ S_fᵀ W S_h.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::dynamics::{Equations, OUTPUTS};
use crate::numerics::linear_algebra::symmetric::inverse;
use crate::output_error::case::Case;
use crate::output_error::likelihood::cost::sums;
use crate::output_error::likelihood::error_effect::{ErrorEffect, SharedError, covariance_of};
use crate::output_error::likelihood::outcome::Fit;

/// Maneuver whose held values are uncertain.
#[derive(Debug)]
pub struct Considered<'a, const NX: usize, E: Equations<NX>> {
    pub case: &'a Case<NX, E>,
    /// Same maneuver with the held derivatives free as well.
    pub wide: &'a Case<NX, E>,
    /// Value of every parameter of `wide`, by name.
    pub values: BTreeMap<&'a str, f64>,
    /// Index of each parameter of `case` among the parameters of the fit.
    pub places: Vec<usize>,
}

/// Adds the consider covariance of one maneuver to a fit's covariances.
///
/// `wide` is the maneuver with the held derivatives free as well. `values` has every derivative of
/// it, and `uncertainties` the standard uncertainty of each held one, by name.
pub fn consider<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    wide: &Case<NX, E>,
    values: &BTreeMap<&str, f64>,
    uncertainties: &BTreeMap<&str, f64>,
    fit: &mut Fit,
) {
    let places = (0..case.parameters()).collect();
    consider_together(
        &[Considered {
            case,
            wide,
            values: values.clone(),
            places,
        }],
        uncertainties,
        fit,
    );
}

/// Remark on a fit whose bounds lack the errors of held values.
const NOT_COUNTED: &str =
    "; errors of held values are not in its bounds: with these free it diverges or is singular";

/// Adds the consider covariance of maneuvers that share parameters. The error of a held value is
/// common to all maneuvers that hold it, so its effects add up before they are squared.
pub fn consider_together<const NX: usize, E: Equations<NX>, R>(
    members: &[Considered<NX, E>],
    uncertainties: &BTreeMap<&str, f64>,
    fit: &mut Fit<R>,
) {
    let (Some(covariance), Some(corrected)) = (&mut fit.covariance, &mut fit.covariance_corrected)
    else {
        return;
    };
    let n = covariance.nrows();
    let Some(shifts) = shifts(members, uncertainties, &fit.weights, n) else {
        fit.reason.push_str(NOT_COUNTED);
        return;
    };
    for (shift, (name, uncertainty)) in shifts.iter().zip(uncertainties) {
        let error = SharedError::Held((*name).to_owned());
        fit.shared_errors
            .push(ErrorEffect::new(error, *uncertainty, shift));
    }
    let held = covariance_of(&shifts, n);
    *covariance += &held;
    *corrected += &held;
    fit.covariance_held = Some(held);
}

/// Shifts of `n` estimates due to one standard deviation of each held value. `None` if the
/// integration with the held values free diverges or the information has no inverse.
fn shifts<const NX: usize, E: Equations<NX>>(
    members: &[Considered<NX, E>],
    uncertainties: &BTreeMap<&str, f64>,
    weights: &[f64; OUTPUTS],
    n: usize,
) -> Option<Vec<DVector<f64>>> {
    let mut blocks = InformationBlocks {
        free: DMatrix::zeros(n, n),
        held: vec![DVector::zeros(n); uncertainties.len()],
    };
    for member in members {
        blocks.add(member, &member.wide_information(weights)?, uncertainties);
    }
    let inverse = inverse(&blocks.free)?;
    let shifts = blocks.held.iter().zip(uncertainties.values());
    let shifts = shifts.map(|(cross, uncertainty)| &inverse * cross * *uncertainty);
    Some(shifts.collect())
}

impl<const NX: usize, E: Equations<NX>> Considered<'_, NX, E> {
    /// Information matrix with the held derivatives free as well; `None` if the integration
    /// diverges.
    fn wide_information(&self, weights: &[f64; OUTPUTS]) -> Option<DMatrix<f64>> {
        let names = self.wide.names.iter();
        let values: Vec<f64> = names
            .map(|name| self.values.get(name.as_str()).copied().unwrap_or(0.0))
            .collect();
        let mut response = self.wide.response();
        self.wide.respond(&values, &mut response).ok()?;
        Some(sums(&response, weights).information)
    }

    fn wide_place(&self, name: &str) -> Option<usize> {
        self.wide.names.iter().position(|n| n == name)
    }
}

/// Blocks of the information matrix: of the free parameters, and one column for each held value.
struct InformationBlocks {
    free: DMatrix<f64>,
    held: Vec<DVector<f64>>,
}

impl InformationBlocks {
    fn add<const NX: usize, E: Equations<NX>>(
        &mut self,
        member: &Considered<NX, E>,
        information: &DMatrix<f64>,
        uncertainties: &BTreeMap<&str, f64>,
    ) {
        let names = member.case.names.iter().zip(&member.places);
        let free: Vec<(usize, usize)> = names
            .filter_map(|(name, place)| Some((member.wide_place(name)?, *place)))
            .collect();
        for &(i, row) in &free {
            for &(j, column) in &free {
                self.free[(row, column)] += information[(i, j)];
            }
            for (cross, name) in self.held.iter_mut().zip(uncertainties.keys()) {
                cross[row] += member.wide_place(name).map_or(0.0, |h| information[(i, h)]);
            }
        }
    }
}
