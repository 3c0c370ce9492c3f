//! "Consider" covariance: the part of a bound that the uncertainty of held values makes.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::dynamics::Equations;
use crate::numerics::symmetric::inverse;
use crate::output_error::case::Case;
use crate::output_error::likelihood::cost::sums;
use crate::output_error::likelihood::outcome::Fit;

/// A maneuver with the held derivatives free as well, and the values at which their effect is
/// wanted.
#[derive(Debug)]
pub struct Considered<'a, const NX: usize, E: Equations<NX>> {
    pub case: &'a Case<NX, E>,
    /// The same maneuver with the held derivatives free as well.
    pub wide: &'a Case<NX, E>,
    /// Every parameter of `wide`, by name.
    pub values: BTreeMap<&'a str, f64>,
    /// The place of each parameter of `case` among those of the fit.
    pub places: Vec<usize>,
}

/// Adds to a fit's covariances what the uncertainty of the held values does to the estimates: G P
/// Gᵀ with G = −H⁻¹ Σ S_fᵀ W S_h ("consider" covariance).
///
/// `wide` is the same maneuver with the held derivatives free as well; `values` has every
/// derivative of it and `uncertainties` the standard uncertainty of each held one, by name.
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

/// [`consider`] for maneuvers that share parameters: the error of a held value is common to all
/// that hold it, so its effects on them add up before they are squared.
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
    let mut own = DMatrix::zeros(n, n);
    let mut crosses = vec![DVector::zeros(n); uncertainties.len()];
    for member in members {
        let wide = member.wide;
        let value = |name: &String| member.values.get(name.as_str()).copied().unwrap_or(0.0);
        let start: Vec<f64> = wide.names.iter().map(value).collect();
        let mut response = wide.response();
        if wide.respond(&start, &mut response).is_err() {
            return;
        }
        let information = sums(&response, &fit.weights).information;
        let at = |name: &str| wide.names.iter().position(|n| n == name);
        let names = member.case.names.iter().zip(&member.places);
        let free: Vec<(usize, usize)> = names
            .filter_map(|(name, place)| Some((at(name)?, *place)))
            .collect();
        for &(i, row) in &free {
            for &(j, column) in &free {
                own[(row, column)] += information[(i, j)];
            }
            for (cross, name) in crosses.iter_mut().zip(uncertainties.keys()) {
                cross[row] += at(name).map_or(0.0, |h| information[(i, h)]);
            }
        }
    }
    let Some(inverse) = inverse(&own) else { return };
    let mut held = DMatrix::zeros(n, n);
    for (cross, uncertainty) in crosses.into_iter().zip(uncertainties.values()) {
        let shift = &inverse * cross * *uncertainty;
        held += &shift * shift.transpose();
    }
    *covariance += &held;
    *corrected += &held;
    fit.covariance_held = Some(held);
}
