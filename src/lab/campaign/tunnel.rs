//! Simulated wind-tunnel database: the true derivatives with known errors.
//!
//! A tunnel measures a coefficient's value at zero deflection, which is the sum of constant and slope
//! times α ([`Combined`]), and derivatives. Each table has errors of its own. The constant follows
//! from sum and slope.

use nalgebra::DMatrix;

use super::cards::TunnelErrors;
use super::simulated_campaign::SimulatedCampaign;
use crate::aero::Combined;
use crate::aero::wind_tunnel::key;
use crate::numerics::linear_algebra::root::{EXACT, root};
use crate::numerics::statistics::matern::matern_3_2;
use crate::numerics::statistics::mean::root_mean_square;
use crate::numerics::statistics::random::RandomStream;
use crate::store::files::TunnelRow;

/// Rows of the database.
pub fn rows(campaign: &SimulatedCampaign) -> Vec<TunnelRow> {
    let errors = &campaign.cards.wind_tunnel;
    let aero_model = &campaign.config.aero_model;
    let measured = |truth: &[TunnelRow]| measured(truth, errors, campaign.cards.seed);
    let derivatives = aero_model.derivatives.iter();
    let mut rows: Vec<TunnelRow> = derivatives
        .flat_map(|derivative| measured(&true_rows(campaign, &derivative.name)))
        .collect();
    for combined in &aero_model.combined {
        let constants = true_rows(campaign, &combined.constant);
        let slopes = true_rows(campaign, &combined.slope);
        let sums = measured(&sums(&constants, &slopes, &combined.name));
        if sums.is_empty() {
            continue;
        }
        let constants = constants_of(&sums, &rows, combined);
        rows.retain(|row| row.derivative != combined.constant);
        rows.extend(constants);
        rows.extend(sums);
    }
    rows.retain(|row| !errors.leave_out.contains(&row.derivative));
    rows
}

fn true_rows(campaign: &SimulatedCampaign, derivative: &str) -> Vec<TunnelRow> {
    let own = campaign.truth.iter();
    own.filter(|row| key(&row.derivative) == key(derivative))
        .map(|row| TunnelRow {
            derivative: derivative.to_owned(),
            ..row.clone()
        })
        .collect()
}

/// True rows of a table with errors added: one common to the table, and a further one at each point.
fn measured(truth: &[TunnelRow], errors: &TunnelErrors, seed: u64) -> Vec<TunnelRow> {
    let Some(first) = truth.first() else {
        return vec![];
    };
    let size = root_mean_square(truth.iter().map(|row| row.value)) / 100.0;
    let mut random = RandomStream::new(seed, &format!("tunnel {}", first.derivative));
    let common = errors.error_pct * random.normal();
    let further = random.deviations(&fading(truth, errors.scatter_length_deg));
    let pairs = truth.iter().zip(&further);
    pairs
        .map(|(row, further)| TunnelRow {
            value: row.value + size * (common + errors.scatter_pct * further),
            uncertainty: Some(size * errors.error_pct.hypot(errors.scatter_pct)),
            source: Some("simulated tunnel: the truth with stated errors".to_owned()),
            ..row.clone()
        })
        .collect()
}

/// Root of the correlation between the further errors of some rows: Matérn's of order 3/2 over α.
fn fading(rows: &[TunnelRow], length_deg: f64) -> DMatrix<f64> {
    let correlation = |i: usize, j: usize| {
        let distance = (rows[i].alpha_deg - rows[j].alpha_deg).abs();
        if i == j {
            1.0
        } else if rows[i].mach == rows[j].mach && length_deg > 0.0 {
            matern_3_2(distance / length_deg)
        } else {
            0.0
        }
    };
    let correlations = DMatrix::from_fn(rows.len(), rows.len(), correlation);
    root(&correlations, EXACT)
}

/// Sums of constant and slope times α at the points where both have a row.
fn sums(constants: &[TunnelRow], slopes: &[TunnelRow], name: &str) -> Vec<TunnelRow> {
    let sum = |constant: &TunnelRow| {
        let slope = at_same_point(slopes, constant)?;
        Some(TunnelRow {
            derivative: name.to_owned(),
            value: constant.value + slope.value * constant.alpha_deg,
            ..constant.clone()
        })
    };
    constants.iter().filter_map(sum).collect()
}

/// Constants that follow from measured sums and slopes.
fn constants_of(sums: &[TunnelRow], rows: &[TunnelRow], combined: &Combined) -> Vec<TunnelRow> {
    let slopes = rows.iter().filter(|row| row.derivative == combined.slope);
    let slopes: Vec<TunnelRow> = slopes.cloned().collect();
    let constant = |sum: &TunnelRow| {
        let slope = at_same_point(&slopes, sum)?;
        let of_slope = slope.uncertainty.map(|u| u * sum.alpha_deg);
        Some(TunnelRow {
            derivative: combined.constant.clone(),
            value: sum.value - slope.value * sum.alpha_deg,
            uncertainty: sum.uncertainty.zip(of_slope).map(|(a, b)| a.hypot(b)),
            ..sum.clone()
        })
    };
    sums.iter().filter_map(constant).collect()
}

fn at_same_point<'r>(rows: &'r [TunnelRow], point: &TunnelRow) -> Option<&'r TunnelRow> {
    rows.iter()
        .find(|row| row.alpha_deg.total_cmp(&point.alpha_deg).is_eq() && row.mach == point.mach)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use approx::assert_relative_eq;

    use super::*;
    use crate::numerics::statistics::mean::mean;

    /// Errors over the size of the table, percent: those of one derivative for many seeds, point by
    /// point.
    fn errors(campaign: &SimulatedCampaign, name: &str) -> Vec<Vec<f64>> {
        let truth = true_rows(campaign, name);
        let size = root_mean_square(truth.iter().map(|row| row.value)) / 100.0;
        let of_seed = |seed: u64| {
            let rows = measured(&truth, &campaign.cards.wind_tunnel, seed);
            let pairs = rows.iter().zip(&truth);
            pairs
                .map(|(row, truth)| (row.value - truth.value) / size)
                .collect()
        };
        (0..2000).map(of_seed).collect()
    }

    fn covariance(errors: &[Vec<f64>], i: usize, j: usize) -> f64 {
        mean(errors.iter().map(|of_seed| of_seed[i] * of_seed[j]))
    }

    #[test]
    fn errors_have_the_stated_size_and_fade_over_their_length() {
        let mut campaign = SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap();
        campaign.cards.wind_tunnel = TunnelErrors {
            error_pct: 8.0,
            scatter_pct: 6.0,
            scatter_length_deg: 10.0,
            leave_out: vec![],
        };
        // The points are 5 deg apart: (1 + √3/2) exp(−√3/2) of the variance is common to neighbours.
        let faded = |d: f64| (1.0 + 3f64.sqrt() * d) * (-(3f64.sqrt()) * d).exp();
        let found = errors(&campaign, "Cm_q");
        assert_relative_eq!(covariance(&found, 3, 3), 100.0, max_relative = 0.1);
        let neighbours = 64.0 + 36.0 * faded(0.5);
        assert_relative_eq!(covariance(&found, 3, 4), neighbours, max_relative = 0.1);
        campaign.cards.wind_tunnel.scatter_length_deg = 0.0;
        let found = errors(&campaign, "Cm_q");
        assert_relative_eq!(covariance(&found, 3, 4), 64.0, max_relative = 0.12);
    }

    #[test]
    fn the_sum_has_an_error_of_its_own_and_the_constant_follows() {
        let campaign = SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap();
        let rows = rows(&campaign);
        let row = |name: &str, alpha_deg: f64| {
            let is_it =
                |r: &&TunnelRow| r.derivative == name && r.alpha_deg.total_cmp(&alpha_deg).is_eq();
            rows.iter().find(is_it).unwrap()
        };
        let [constant, slope, sum] = ["CN_0", "CN_alpha", "CN_ba"].map(|name| row(name, 60.0));
        assert_relative_eq!(
            constant.value + 60.0 * slope.value,
            sum.value,
            max_relative = 1e-12
        );
        // 8 % and 3 % of the root mean square of the true sums.
        let truth = |name: &str| true_rows(&campaign, name);
        let sums = sums(&truth("CN_0"), &truth("CN_alpha"), "CN_ba");
        let size = root_mean_square(sums.iter().map(|row| row.value));
        let own = size * 0.08f64.hypot(0.03);
        assert_relative_eq!(sum.uncertainty.unwrap(), own, max_relative = 1e-12);
        let of_slope = 60.0 * slope.uncertainty.unwrap();
        let whole = own.hypot(of_slope);
        assert_relative_eq!(constant.uncertainty.unwrap(), whole, max_relative = 1e-12);
    }
}
