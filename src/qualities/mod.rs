//! Flying qualities: modes of the posterior at each angle of attack, and the probability of each
//! level.
//!
//! - [`trim`]: steady flight as flown at an angle of attack;
//! - [`linear`]: the estimated equations, linearised about it; the matrix is linear in the
//!   derivatives;
//! - [`modes`]: roots of the matrix, with their slopes along each derivative;
//! - [`quantities`]: quantities of the modes that a specification judges;
//! - [`specification`]: limits, which are the analyst's data;
//! - [`analysis`]: standard deviations, and probabilities of the levels;
//! - [`judged_quantity`]: one quantity as a linear function of the derivatives, for plans of the
//!   next flight.

mod specification;
mod judged_aircraft;
mod trim;
mod linear;
mod longitudinal;
mod lateral;
mod modes;
mod quantities;
mod levels;
mod analysis;
mod judged_quantity;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::aero::Axis;
use crate::maneuver::{Maneuver, Means};
use crate::model::Model;
use crate::tables::{LevelRow, QualityRow, RootRow};
use analysis::{Analysis, SharedDraws};

pub use judged_aircraft::JudgedAircraft;
pub use judged_quantity::judged_quantity;
pub use linear::{Controls, LinearModel, SteadyFlight};
pub use specification::{LevelLimit, Range, Requirement, Specification};
pub use trim::FlownConditions;

/// States that the feedback of a specification may use.
pub const FEEDBACK_STATES: [&str; 7] = [
    "alpha_deg",
    "q_deg_s",
    "theta_deg",
    "beta_deg",
    "p_deg_s",
    "r_deg_s",
    "phi_deg",
];

/// Axis in whose equations a state of [`FEEDBACK_STATES`] is.
#[must_use]
pub fn feedback_axis(state: &str) -> Axis {
    match state {
        "alpha_deg" | "q_deg_s" | "theta_deg" => Axis::Longitudinal,
        _ => Axis::Lateral,
    }
}

/// Flying qualities of a campaign.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Qualities {
    pub qualities: Vec<QualityRow>,
    pub levels: Vec<LevelRow>,
    pub roots: Vec<RootRow>,
}

/// Computes the flying qualities at each angle of attack of the posterior within the flown range.
#[must_use]
pub fn qualities(basis: &JudgedAircraft, flown: &[(&Maneuver, &Means)]) -> Qualities {
    let conditions = FlownConditions::new(flown, basis.tunnel);
    let alphas = angles_deg(basis.model);
    let draws = SharedDraws::new(basis.model, basis.specification.draws);
    let analyses: Vec<Analysis> = basis
        .specification
        .airframes()
        .into_iter()
        .flat_map(|airframe| alphas.iter().map(move |alpha| (airframe, *alpha)))
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|(airframe, alpha)| {
            let trim = conditions.trim(alpha, basis.aircraft)?;
            Analysis::of(basis, &draws, airframe, &trim)
        })
        .collect();
    let mut found = Qualities::default();
    for analysis in analyses {
        found.qualities.extend(analysis.qualities);
        found.levels.extend(analysis.levels);
        found.roots.extend(analysis.roots);
    }
    found
}

/// Ascending angles of attack of a posterior.
#[must_use]
pub fn angles_deg(model: &Model) -> Vec<f64> {
    let rows = model.rows.posterior.iter();
    let mut alphas: Vec<f64> = rows.map(|row| row.alpha_deg).collect();
    alphas.sort_by(f64::total_cmp);
    alphas.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    alphas
}
