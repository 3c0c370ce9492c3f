//! Dependence of the minimum on the starting values. Each record is estimated by output error from
//! the true values, from twice and half the true values, and from ineffective surfaces. Filter
//! error does not start from tabulated values.

use rayon::prelude::*;

use super::recordings::{StudyManeuver, true_tables};
use crate::aero::{AeroModel, WindTunnel};
use crate::error::Problem;
use crate::estimate::{Estimated, Method, Start};
use crate::lab::simulator::{FlownManeuver, TrueDerivative};
use crate::numerics::statistics::random::derived_seed;
use crate::output_error::Outcome;
use crate::tables::{EstimateRow, StartRow, StartVariant, StartingValues};

/// Greatest difference between equal minima, as a share of each derivative's bound. The criterion of
/// `docs/coverage.md`.
const SAME_MINIMUM: f64 = 0.1;

/// Tunnel tables with these values.
fn start_tables(
    variant: StartVariant,
    truth: &[TrueDerivative],
    aero_model: &AeroModel,
) -> WindTunnel {
    let is_surface = |name: &str| {
        aero_model
            .derivatives
            .iter()
            .any(|d| d.name == name && d.regressor.surface().is_some())
    };
    let factor = |name: &str| match variant {
        StartVariant::Double => 2.0,
        StartVariant::Half => 0.5,
        StartVariant::NoSurfaces if is_surface(name) => 0.0,
        StartVariant::NoSurfaces => 1.0,
    };
    let changed: Vec<TrueDerivative> = truth
        .iter()
        .map(|t| TrueDerivative {
            value: factor(&t.derivative) * t.value,
            ..t.clone()
        })
        .collect();
    true_tables(&changed)
}

/// Minimum reached from other starting values, compared with the minimum from the true values.
#[derive(Clone, Copy, Debug)]
struct ReachedMinimum {
    /// `true` if the same minimum was reached, possibly from the equation-error start.
    same: bool,
    /// `true` if it was reached from the given values themselves.
    unaided: bool,
}

/// Estimates a maneuver from each kind of starting values: a row per kind.
///
/// # Errors
/// The maneuver cannot be flown.
pub fn starts(
    maneuver: &StudyManeuver,
    aero_model: &AeroModel,
    realisations: usize,
    seed: u64,
) -> Result<Vec<StartRow>, Problem> {
    let flown = maneuver.flown(seed)?;
    let mut maneuver = maneuver.clone();
    maneuver.settings.start = Start::WindTunnel;
    maneuver.settings.method = Method::OutputError;
    let row = |values: StartVariant| {
        let start = start_tables(values, &flown.truth, aero_model);
        let reached = reached(&maneuver, &flown, &start, realisations, seed);
        StartRow {
            class: maneuver.class.name.clone(),
            alpha_deg: flown.maneuver.alpha_deg,
            start: values,
            records: realisations,
            alone: reached.iter().filter(|r| r.unaided).count(),
            reached: reached.iter().filter(|r| r.same).count(),
        }
    };
    Ok([
        StartVariant::Double,
        StartVariant::Half,
        StartVariant::NoSurfaces,
    ]
    .map(row)
    .into())
}

fn reached(
    maneuver: &StudyManeuver,
    flown: &FlownManeuver,
    start: &WindTunnel,
    realisations: usize,
    seed: u64,
) -> Vec<ReachedMinimum> {
    let truth = true_tables(&flown.truth);
    (0..realisations)
        .into_par_iter()
        .map(|i| {
            let seed = derived_seed(seed, &format!("start {i}"));
            let reference = maneuver.estimate(flown, &truth, seed);
            let estimated = maneuver.estimate(flown, start, seed);
            let same = is_same_minimum(&reference, &estimated);
            ReachedMinimum {
                same,
                unaided: same && estimated.fit.start == Some(StartingValues::WindTunnel),
            }
        })
        .collect()
}

/// Compares two estimates of one record.
fn is_same_minimum(reference: &Estimated, estimated: &Estimated) -> bool {
    let converged = |e: &Estimated| e.fit.outcome == Outcome::Converged;
    let is_near = |(a, b): (&EstimateRow, &EstimateRow)| match (a.value, b.value, a.bound) {
        (Some(at), Some(found), Some(bound)) => (at - found).abs() <= SAME_MINIMUM * bound,
        // Held or inactive derivatives have no bound.
        (at, found, _) => at == found,
    };
    let mut rows = reference.estimates.iter().zip(&estimated.estimates);
    converged(reference) && converged(estimated) && rows.all(is_near)
}
