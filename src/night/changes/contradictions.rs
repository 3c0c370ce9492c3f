//! Flights and classes that the rest of the campaign contradicts, by the self-check.

use std::collections::BTreeSet;

use statrs::distribution::{Binomial, DiscreteCDF};

use crate::lineage::Contradiction;
use crate::night::published_night::NightTables;
use crate::tables::SelfCheckRow;

/// Expected share of estimates inside a 95 % interval.
const INSIDE: f64 = 0.95;

/// Probability that as few estimates are inside by chance, below which a part of the campaign
/// counts as contradicted. It is low because some hundred parts are checked, and their estimates
/// are correlated.
const LEAST_PROBABILITY: f64 = 1e-5;

/// Parts that are contradicted now, but were not in the earlier night.
pub fn contradictions(before: &NightTables, now: &NightTables) -> Vec<Contradiction> {
    let known = before.self_check.iter().filter(|row| is_contradicted(row));
    let known: BTreeSet<(&str, &str)> = known.map(item_and_coefficient).collect();
    let now = now.self_check.iter().filter(|row| is_contradicted(row));
    now.filter(|row| !known.contains(&item_and_coefficient(row)))
        .map(|row| Contradiction {
            item: row.item.clone(),
            coefficient: row.coefficient.clone(),
            estimates: row.estimates,
            inside_95_pct: row.inside_95_pct,
        })
        .collect()
}

fn item_and_coefficient(row: &SelfCheckRow) -> (&str, &str) {
    (&row.item, &row.coefficient)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a count from its share"
)]
fn is_contradicted(row: &SelfCheckRow) -> bool {
    let inside = (row.estimates as f64 * row.inside_95_pct / 100.0).round() as u64;
    Binomial::new(INSIDE, row.estimates as u64)
        .is_ok_and(|expected| expected.cdf(inside) < LEAST_PROBABILITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::LeftOutKind;

    fn row(estimates: usize, inside_95_pct: f64) -> SelfCheckRow {
        SelfCheckRow {
            left_out: LeftOutKind::Flight,
            item: "flight_001".into(),
            coefficient: "Cm".into(),
            estimates,
            inside_95_pct,
            log_density: 0.0,
        }
    }

    #[test]
    fn a_flight_is_contradicted_if_chance_does_not_explain_its_share() {
        // P(K ≤ 4 of 8) = 3.7e-4, P(K ≤ 3 of 8) = 1.5e-5, P(K ≤ 2 of 8) = 4e-7.
        assert!(!is_contradicted(&row(8, 50.0)) && !is_contradicted(&row(8, 37.5)));
        assert!(is_contradicted(&row(8, 25.0)));
        assert!(!is_contradicted(&row(100, 85.0)) && is_contradicted(&row(100, 80.0)));
        assert!(!is_contradicted(&row(0, 0.0)) && !is_contradicted(&row(2, 0.0)));
    }
}
