//! Extrapolation of the wind tunnel: reads outside its tables, at maneuvers for values held or
//! compared, and at the trends' α.

use std::collections::BTreeMap;

use crate::aero::wind_tunnel::{ExtrapolatedReading, Extrapolation};
use crate::aero::{Condition, WindTunnel};
use crate::maneuver::Maneuver;
use crate::tables::{ComparisonRow, EstimateRow, ExtrapolationRow, Treatment};

/// Lists the reads outside the tables: one row per maneuver (or α of the comparison), variable and
/// range of tables, with the derivatives concerned.
#[must_use]
pub fn extrapolations(
    estimates: &[EstimateRow],
    maneuvers: &[Maneuver],
    comparison: &[ComparisonRow],
    tunnel: &WindTunnel,
) -> Vec<ExtrapolationRow> {
    let estimates = EstimateRow::by_maneuver(estimates);
    let mut rows = Vec::new();
    for maneuver in maneuvers {
        let id = maneuver.maneuver_id.as_str();
        let own = estimates.get(id).copied().unwrap_or_default();
        let names = own.iter().map(|estimate| estimate.derivative.as_str());
        rows.extend(extrapolations_at(
            id,
            &maneuver.condition(tunnel),
            names,
            tunnel,
        ));
    }
    let compared = comparison
        .iter()
        .filter_map(|c| Some((c, c.tunnel.wind_tunnel.and(c.mach)?)));
    for (c, mach) in compared {
        let condition = Condition {
            alpha_deg: c.alpha_deg,
            mach,
            third: None,
        };
        rows.extend(extrapolations_at(
            "",
            &condition,
            std::iter::once(c.derivative.as_str()),
            tunnel,
        ));
    }
    rows
}

fn extrapolations_at<'a>(
    maneuver_id: &str,
    condition: &Condition,
    derivatives: impl Iterator<Item = &'a str>,
    tunnel: &WindTunnel,
) -> Vec<ExtrapolationRow> {
    // Tables with equal ends share a row.
    let mut found: BTreeMap<(String, u64, u64), (ExtrapolatedReading, Vec<&str>)> = BTreeMap::new();
    for name in derivatives {
        for beyond in tunnel.extrapolations(name, condition) {
            let key = (
                beyond.variable.clone(),
                beyond.from.to_bits(),
                beyond.to.to_bits(),
            );
            found
                .entry(key)
                .or_insert_with(|| (beyond, Vec::new()))
                .1
                .push(name);
        }
    }
    let treatment = match tunnel.settings().extrapolation {
        Extrapolation::Clamp => Treatment::Clamped,
        Extrapolation::Refuse => Treatment::Refused,
    };
    let row = |(beyond, names): (ExtrapolatedReading, Vec<&str>)| ExtrapolationRow {
        maneuver_id: maneuver_id.to_owned(),
        alpha_deg: condition.alpha_deg,
        mach: condition.mach,
        variable: beyond.variable,
        read_at: beyond.read_at,
        tabulated_from: beyond.from,
        tabulated_to: beyond.to,
        treatment,
        derivatives: names.join(" "),
    };
    found.into_values().map(row).collect()
}
