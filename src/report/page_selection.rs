//! Selection of the maneuvers that get a page of their own.
//!
//! In a campaign each maneuver gets a page; in a large archive only as many as a browser can show.
//! The tables have all maneuvers, and `harvest show` draws any of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::lineage::Changes;
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::tables::FitRow;

/// Selects at most `most` maneuvers. In order of precedence:
///
/// 1. the representative of each class ([`representatives`]),
/// 2. those that changed since the previous night, up to half of `most`,
/// 3. those whose fit failed,
/// 4. an even selection of the others, of which a further flight changes few.
#[must_use]
pub fn maneuvers_with_page(
    maneuvers: &[Maneuver],
    fits: &[FitRow],
    changes: &Changes,
    typical_alpha_deg: f64,
    most: usize,
) -> BTreeSet<String> {
    let converged = converged(fits);
    let changed: BTreeSet<&str> = changes
        .maneuvers
        .iter()
        .map(|m| m.maneuver_id.as_str())
        .chain(changes.estimates.iter().map(|moved| moved.of.as_str()))
        .collect();
    let all: Vec<&str> = maneuvers.iter().map(|m| m.maneuver_id.as_str()).collect();
    let mut selected: BTreeSet<&str> = representatives(maneuvers, fits, typical_alpha_deg);
    let mut fill = |is_candidate: &dyn Fn(&str) -> bool, most: usize| {
        let candidates = all.iter().copied().enumerate();
        let candidates = candidates.filter(|(_, id)| is_candidate(id));
        add_evenly(&mut selected, candidates, most);
    };
    fill(&|id| changed.contains(id), most / 2);
    fill(&|id| !converged.contains(id), most);
    fill(&|_| true, most);
    selected.into_iter().map(str::to_owned).collect()
}

/// Maneuvers whose fit converged.
fn converged(fits: &[FitRow]) -> BTreeSet<&str> {
    fits.iter()
        .filter(|f| f.outcome == Outcome::Converged)
        .map(|f| f.maneuver_id.as_str())
        .collect()
}

/// Representative of each class: its converged maneuver nearest to an angle of attack. Ties go to
/// the alphabetically first identifier.
#[must_use]
pub fn representatives<'a>(
    maneuvers: &'a [Maneuver],
    fits: &[FitRow],
    alpha_deg: f64,
) -> BTreeSet<&'a str> {
    let converged = converged(fits);
    let distance = |m: &Maneuver| (m.alpha_deg - alpha_deg).abs();
    let mut nearest: BTreeMap<&str, &Maneuver> = BTreeMap::new();
    for maneuver in maneuvers
        .iter()
        .filter(|m| converged.contains(m.maneuver_id.as_str()))
    {
        let best = nearest.entry(maneuver.class.as_str()).or_insert(maneuver);
        if distance(maneuver)
            .total_cmp(&distance(best))
            .then_with(|| maneuver.maneuver_id.cmp(&best.maneuver_id))
            .is_lt()
        {
            *best = maneuver;
        }
    }
    nearest
        .into_values()
        .map(|m| m.maneuver_id.as_str())
        .collect()
}

/// Golden ratio's inverse, in units of 2⁻⁶⁴.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Adds candidates, with their numbers in the campaign, until `most` are selected.
///
/// If there are too many, those are selected whose number times the golden ratio has the smallest fractions.
/// Such numbers are spread evenly, and further maneuvers replace few of them.
fn add_evenly<'a>(
    selected: &mut BTreeSet<&'a str>,
    candidates: impl Iterator<Item = (usize, &'a str)>,
    most: usize,
) {
    let mut left: Vec<(u64, &str)> = candidates
        .filter(|(_, id)| !selected.contains(id))
        .map(|(number, id)| (GOLDEN.wrapping_mul(number as u64), id))
        .collect();
    left.sort_unstable();
    let room = most.saturating_sub(selected.len());
    selected.extend(left.into_iter().take(room).map(|(_, id)| id));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lineage::{ManeuverChange, ManeuverDifference};
    use crate::report::campaign_fixture;

    fn change(maneuver_id: &str) -> ManeuverChange {
        ManeuverChange {
            maneuver_id: maneuver_id.to_owned(),
            class: String::new(),
            what: ManeuverDifference::Changed,
            words: String::new(),
            because: String::new(),
        }
    }

    #[test]
    fn a_small_campaign_has_a_page_for_every_maneuver() {
        let campaign = campaign_fixture::campaign();
        let pages = maneuvers_with_page(
            &campaign.maneuvers,
            &campaign.fits,
            &Changes::default(),
            30.0,
            campaign.maneuvers.len(),
        );
        assert_eq!(pages.len(), campaign.maneuvers.len());
    }

    /// Numbers of the maneuvers that are selected from so many.
    fn selected(maneuvers: usize, most: usize) -> BTreeSet<usize> {
        let ids: Vec<String> = (0..maneuvers).map(|number| number.to_string()).collect();
        let mut selected = BTreeSet::new();
        add_evenly(
            &mut selected,
            ids.iter().map(String::as_str).enumerate(),
            most,
        );
        selected
            .into_iter()
            .filter_map(|id| id.parse().ok())
            .collect()
    }

    #[test]
    fn pages_are_spread_evenly_over_flights_and_over_the_cards_of_a_flight() {
        for (maneuvers, most) in [(530, 300), (530, 265), (2000, 100)] {
            let chosen = selected(maneuvers, most);
            assert_eq!(chosen.len(), most);
            for parts in 2..20 {
                let share = |is_of: &dyn Fn(usize) -> bool| {
                    let all = (0..maneuvers).filter(|number| is_of(*number)).count();
                    let of = chosen.iter().filter(|number| is_of(**number)).count();
                    of as f64 - (all * most) as f64 / maneuvers as f64
                };
                for k in 0..parts {
                    let consecutive = share(&|number| number * parts / maneuvers == k);
                    assert!(consecutive.abs() < 3.0, "{parts} flights: {consecutive}");
                    let card = share(&|number| number % parts == k);
                    assert!(card.abs() < 9.0, "one of {parts} cards: {card}");
                }
            }
        }
    }

    #[test]
    fn a_further_flight_changes_few_pages() {
        let (before, after) = (selected(521, 300), selected(530, 300));
        assert!(before.intersection(&after).count() >= 294);
        assert_eq!(selected(300, 300).len(), 300);
    }

    #[test]
    fn representatives_changed_and_failed_maneuvers_come_first_where_pages_are_few() {
        let campaign = campaign_fixture::campaign();
        let failed: Vec<&str> = campaign
            .fits
            .iter()
            .filter(|f| f.outcome != Outcome::Converged)
            .map(|f| f.maneuver_id.as_str())
            .collect();
        let classes: BTreeSet<&str> = campaign
            .maneuvers
            .iter()
            .map(|m| m.class.as_str())
            .collect();
        let plain = maneuvers_with_page(
            &campaign.maneuvers,
            &campaign.fits,
            &Changes::default(),
            30.0,
            classes.len(),
        );
        let is_at_30 = |m: &&Maneuver| (m.alpha_deg - 30.0).abs() < 1e-9;
        let at_30: BTreeSet<String> = campaign
            .maneuvers
            .iter()
            .filter(is_at_30)
            .map(|m| m.maneuver_id.clone())
            .collect();
        assert_eq!(plain, at_30);
        let other = campaign
            .maneuvers
            .iter()
            .map(|m| &m.maneuver_id)
            .rfind(|id| !plain.contains(*id))
            .unwrap();
        let changes = Changes {
            maneuvers: vec![change(other)],
            ..Changes::default()
        };
        let most = 2 * (classes.len() + 1);
        let pages = maneuvers_with_page(&campaign.maneuvers, &campaign.fits, &changes, 30.0, most);
        assert!(pages.len() == most && pages.contains(other) && pages.is_superset(&at_30));
        assert!(!failed.is_empty() && failed.iter().all(|id| pages.contains(*id)));
    }
}
