//! How well the data determine the parameters: Cramér-Rao bounds (1.6, 1.7) in a form that holds
//! for any weights.
//!
//! With H = Σ Sᵀ W S and residual covariance R̂ the covariance of the estimates is H⁻¹ [Σ Sᵀ W R̂ W
//! S] H⁻¹; it is H⁻¹, the usual bound, when W = R̂⁻¹. The weights of Tables 2 and 4 are legitimate
//! weights that are not. Correlated residuals are counted by their autocovariance ([`coloured`]),
//! and the bound is never below the one for white ones. Where that autocovariance is known from
//! little, the corrected bound is longer by what Student's t says, so that ±1.96 of it are an
//! interval of 95 %.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::case::Case;
use super::coloured;
use super::cost::sums;
use super::likelihood::Likelihood;
use super::outcome::Fit;
use super::padded::Padded;
use crate::dynamics::{Equations, OUTPUTS};

/// 1/√H_jj, one where the data say nothing of a parameter.
#[must_use]
pub fn scale(information: &DMatrix<f64>) -> DVector<f64> {
    information
        .diagonal()
        .map(|h| if h > 0.0 { 1.0 / h.sqrt() } else { 1.0 })
}

/// H with rows and columns scaled.
#[must_use]
pub fn scaled(information: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(information.nrows(), information.ncols(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    })
}

/// Whether the data determine every parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Identified {
    Determined {
        inverse: DMatrix<f64>,
        condition_number: f64,
    },
    /// The parameters that take part in the least determined direction.
    Undetermined {
        condition_number: Option<f64>,
        parameters: Vec<usize>,
    },
}

/// A parameter takes part in a direction when its share of the unit vector's square is at least
/// this: the few that a reader is to be told of.
const TAKES_PART: f64 = 0.1;

/// Inverts the information matrix, or names what it does not determine.
#[must_use]
pub fn identified(information: &DMatrix<f64>, max_condition_number: f64) -> Identified {
    let silent: Vec<usize> = (0..information.nrows())
        .filter(|&i| information[(i, i)] <= 0.0)
        .collect();
    if !silent.is_empty() || !information.iter().all(|h| h.is_finite()) {
        return Identified::Undetermined {
            condition_number: None,
            parameters: silent,
        };
    }
    let scaled = scaled(information, &scale(information));
    let eigenvalues = scaled.symmetric_eigenvalues();
    let (smallest, most) = (eigenvalues.min(), eigenvalues.max());
    if let Some(inverse) = inverse(information).filter(|_| smallest > most / max_condition_number) {
        return Identified::Determined {
            inverse,
            condition_number: most / smallest,
        };
    }
    let eigen = SymmetricEigen::new(scaled);
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let parameters = (0..direction.len())
        .filter(|&j| direction[j] * direction[j] >= TAKES_PART)
        .collect();
    Identified::Undetermined {
        condition_number: (smallest > 0.0).then(|| most / smallest),
        parameters,
    }
}

/// The inverse alone, whatever the condition; none where no direction less would do.
#[must_use]
pub fn inverse(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = scale(information);
    Some(scaled(
        &Padded::symmetric(&scaled(information, &scale))
            .inverse()?
            .matrix(),
        &scale,
    ))
}

/// Variances of the residuals from Σ v² and the samples of each output, with the parameters counted
/// as spread evenly over the outputs.
#[must_use]
pub fn variances(outputs: [(f64, usize); OUTPUTS], parameters: usize) -> [f64; OUTPUTS] {
    let total: usize = outputs.iter().map(|(_, used)| used).sum();
    let freedom = 1.0 - (parameters as f64 / total.max(1) as f64).min(0.9);
    outputs.map(|(square, used)| square / (used.max(1) as f64 * freedom))
}

/// The two covariances of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    pub covariance: DMatrix<f64>,
    pub corrected: DMatrix<f64>,
}

/// Bounds of a fit, given the inverse of its information matrix.
#[must_use]
pub fn bounds<D: Likelihood>(inverse: &DMatrix<f64>, data: &D, fit: &Fit<D::Response>) -> Bounds {
    let inverse = Padded::symmetric(inverse);
    let scattered = |gradient: DMatrix<f64>| inverse.about(&Padded::symmetric(&gradient)).matrix();
    let covariance = scattered(data.white_covariance(&fit.response, &fit.weights));
    let (series, inputs) = data.noisy(&fit.values, &fit.response, &fit.weights);
    let residuals = coloured::covariance(&inverse, &series).of_student();
    let corrected = never_below(residuals, &covariance) + scattered(inputs);
    Bounds {
        covariance,
        corrected,
    }
}

/// The noise of the outputs that a fit leaves; none where the data do not determine its parameters.
#[must_use]
pub fn noise<D: Likelihood>(
    data: &D,
    fit: &Fit<D::Response>,
    max_condition_number: f64,
) -> Option<coloured::Noise> {
    let sums = data.sums(&fit.response, &fit.weights);
    match identified(&sums.information, max_condition_number) {
        Identified::Determined { inverse, .. } => Some(coloured::noise(
            &inverse,
            &data.series(&fit.response, &fit.weights),
        )),
        Identified::Undetermined { .. } => None,
    }
}

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

/// Adds to a fit's corrected covariance what errors common to all its data do to the estimates: of
/// each, the change of the gradient with one standard deviation of it ([`super::calibration`]).
pub fn miscalibrated<D: Likelihood>(
    data: &D,
    gradient_shifts: &[DVector<f64>],
    fit: &mut Fit<D::Response>,
) {
    let Some(corrected) = &mut fit.covariance_corrected else {
        return;
    };
    let Some(inverse) = inverse(&data.sums(&fit.response, &fit.weights).information) else {
        return;
    };
    let mut common = DMatrix::zeros(inverse.nrows(), inverse.ncols());
    for gradient_shift in gradient_shifts {
        let shift = &inverse * gradient_shift;
        common += &shift * shift.transpose();
    }
    *corrected += &common;
    fit.covariance_calibration = Some(common);
}

/// Raises variances that came out below the white ones to them, keeping the correlations.
fn never_below(mut corrected: DMatrix<f64>, white: &DMatrix<f64>) -> DMatrix<f64> {
    for j in 0..corrected.nrows() {
        let (have, need) = (corrected[(j, j)], white[(j, j)]);
        if have < need {
            if have > 0.0 {
                let factor = (need / have).sqrt();
                corrected.row_mut(j).scale_mut(factor);
                corrected.column_mut(j).scale_mut(factor);
            } else {
                corrected.row_mut(j).copy_from(&white.row(j));
                corrected.column_mut(j).copy_from(&white.column(j));
            }
            corrected[(j, j)] = need;
        }
    }
    corrected
}
