//! Noise of estimates because the angle of attack to which they belong is uncertain.
//!
//! An estimate is the mean of its derivative over the maneuver, weighted by the information of the
//! samples. The information on different derivatives lies at different angles of attack: a pulse of
//! the elevator tells `Cm_de` where the pulse was flown. The estimates are nevertheless taken to
//! belong to the mean α of the maneuver.
//!
//! Let δ be the standard deviation of the angle to which an estimate belongs. The total derivative
//! t + f, tunnel plus difference, changes by c = ½ (t + f)(α + δ) − ½ (t + f)(α − δ) over δ. The noise
//! of a term is E c², the square of the tunnel's change plus the prior variance of the change of f.
//! The terms have independent angles, since their information does.
//!
//! A sum of constant and slope holds at the mean α whatever the angle of its slope is: its change by
//! δ is that of the table less δ times the slope.

use nalgebra::DMatrix;

use super::scale_prior::Scale;
use super::term::{PosteriorTerm, of_independent};
use crate::aero::Condition;

/// Standard deviation of the angle of attack to which an estimate belongs, over the root mean square
/// of α about its mean in the maneuver. The mean of α, weighted by the square of a surface's or a
/// rate's motion, is away from the mean of α by 0.46 of that root mean square: root mean square over
/// 900 such motions in records of an independent simulator, 0.31 in lateral maneuvers.
pub const ANGLE_SHARE: f64 = 0.45;

/// Covariance of weighted sums of the terms at a condition from the uncertainty `deviation_deg` of
/// the angle of attack; one sum per row of `design`.
#[must_use]
pub fn angle_noise(
    terms: &[PosteriorTerm],
    scales: &[Scale],
    design: &DMatrix<f64>,
    condition: &Condition,
    deviation_deg: f64,
) -> DMatrix<f64> {
    let pairs = terms.iter().zip(scales);
    let variances = pairs.map(|(term, scale)| {
        let change = term.prior.change_over(scale, condition, deviation_deg);
        let of_slope = deviation_deg * tunnel_slope(term, terms, condition);
        (change.of_tunnel - of_slope).powi(2) + change.variance
    });
    of_independent(design, variances)
}

/// Tunnel's slope of a sum of constant and slope; zero for a derivative itself.
fn tunnel_slope(term: &PosteriorTerm, terms: &[PosteriorTerm], at: &Condition) -> f64 {
    let slope = term.slope.as_ref();
    let slope = slope.and_then(|name| terms.iter().find(|t| t.derivative == *name));
    slope.map_or(0.0, |slope| slope.prior.tunnel_value(at))
}
