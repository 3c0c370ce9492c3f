//! Simulated wind-tunnel database: the true derivatives with known errors.

use super::cards::TunnelErrors;
use super::simulated_campaign::SimulatedCampaign;
use crate::aero::Combined;
use crate::aero::wind_tunnel::key;
use crate::numerics::statistics::random::RandomStream;
use crate::store::files::TunnelRow;

/// Rows of the database. Each derivative has an error common to its table and a further error at
/// each point. Combined sums follow from the erroneous values.
pub fn rows(campaign: &SimulatedCampaign) -> Vec<TunnelRow> {
    let errors = &campaign.cards.wind_tunnel;
    let aero_model = &campaign.config.aero_model;
    let mut rows = Vec::new();
    for derivative in &aero_model.derivatives {
        rows.extend(measured(campaign, errors, &derivative.name));
    }
    for combined in &aero_model.combined {
        rows.extend(combined_sums(&rows, combined));
    }
    rows.retain(|row| !errors.leave_out.contains(&row.derivative));
    rows
}

/// True rows of a derivative with errors added.
fn measured(
    campaign: &SimulatedCampaign,
    errors: &TunnelErrors,
    derivative: &str,
) -> Vec<TunnelRow> {
    let is_same = |row: &&TunnelRow| key(&row.derivative) == key(derivative);
    let size = campaign.config.tunnel.root_mean_square(derivative) / 100.0;
    let mut random = RandomStream::new(campaign.cards.seed, &format!("tunnel {derivative}"));
    let common = errors.error_pct * random.normal();
    let true_rows = campaign.truth.iter().filter(is_same);
    true_rows
        .map(|row| TunnelRow {
            derivative: derivative.to_owned(),
            value: row.value + size * (common + errors.scatter_pct * random.normal()),
            uncertainty: Some(size * errors.error_pct.hypot(errors.scatter_pct)),
            source: Some("simulated tunnel: the truth with stated errors".to_owned()),
            ..row.clone()
        })
        .collect()
}

/// Rows of a combined sum at the points where both of its terms have a row.
fn combined_sums(rows: &[TunnelRow], combined: &Combined) -> Vec<TunnelRow> {
    let slopes: Vec<&TunnelRow> = rows
        .iter()
        .filter(|r| r.derivative == combined.slope)
        .collect();
    let sum = |constant: &TunnelRow| {
        let slope = slopes.iter().find(|slope| {
            slope.alpha_deg.total_cmp(&constant.alpha_deg).is_eq() && slope.mach == constant.mach
        })?;
        let uncertainty = constant
            .uncertainty
            .zip(slope.uncertainty)
            .map(|(a, b)| a.hypot(b * constant.alpha_deg));
        Some(TunnelRow {
            derivative: combined.name.clone(),
            value: constant.value + slope.value * constant.alpha_deg,
            uncertainty,
            ..constant.clone()
        })
    };
    rows.iter()
        .filter(|r| r.derivative == combined.constant)
        .filter_map(sum)
        .collect()
}
