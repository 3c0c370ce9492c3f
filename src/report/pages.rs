//! Which maneuvers have a page of their own: all of a campaign, but of a fleet's archive no more
//! than a reader can leaf through and a browser can hold. Everything is in the tables, and `harvest
//! show` draws any of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::lineage::Changes;
use crate::maneuver::Maneuver;
use crate::output_error::Outcome;
use crate::tables::FitRow;

/// At most `most` maneuvers: the one that stands for its class (the converged one nearest to
/// `typical_alpha_deg`), those that are not what they were the night before (up to half of the
/// pages), those whose fit failed, and of the others some at equal distances.
#[must_use]
pub fn chosen(
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
    let ids = || maneuvers.iter().map(|m| m.maneuver_id.as_str());
    let mut chosen: BTreeSet<&str> = typical(maneuvers, &converged, typical_alpha_deg);
    add(
        &mut chosen,
        &ids().filter(|id| changed.contains(id)).collect::<Vec<_>>(),
        most / 2,
    );
    add(
        &mut chosen,
        &ids()
            .filter(|id| !converged.contains(id))
            .collect::<Vec<_>>(),
        most,
    );
    add(&mut chosen, &ids().collect::<Vec<_>>(), most);
    chosen.into_iter().map(str::to_owned).collect()
}

/// The maneuvers whose fit converged.
pub(super) fn converged(fits: &[FitRow]) -> BTreeSet<&str> {
    fits.iter()
        .filter(|f| f.outcome == Outcome::Converged.name())
        .map(|f| f.maneuver_id.as_str())
        .collect()
}

/// The maneuver that stands for its class: of each the converged one nearest to an angle of attack.
pub(super) fn typical<'a>(
    maneuvers: &'a [Maneuver],
    converged: &BTreeSet<&str>,
    alpha_deg: f64,
) -> BTreeSet<&'a str> {
    let off = |m: &Maneuver| (m.alpha_deg - alpha_deg).abs();
    let mut nearest: BTreeMap<&str, &Maneuver> = BTreeMap::new();
    for maneuver in maneuvers
        .iter()
        .filter(|m| converged.contains(m.maneuver_id.as_str()))
    {
        let best = nearest.entry(maneuver.class.as_str()).or_insert(maneuver);
        if off(maneuver)
            .total_cmp(&off(best))
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

/// Adds those that are not there yet, or of too many some at equal distances, until there are
/// `most`.
fn add<'a>(chosen: &mut BTreeSet<&'a str>, from: &[&'a str], most: usize) {
    let left: Vec<&str> = from
        .iter()
        .copied()
        .filter(|id| !chosen.contains(id))
        .collect();
    let room = most.saturating_sub(chosen.len()).min(left.len());
    chosen.extend((0..room).filter_map(|k| left.get(k * left.len() / room.max(1))));
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;
    use crate::lineage::ManeuverChange;

    fn change(maneuver_id: &str) -> ManeuverChange {
        ManeuverChange {
            maneuver_id: maneuver_id.to_owned(),
            class: String::new(),
            what: "changed".to_owned(),
            words: String::new(),
            because: String::new(),
        }
    }

    #[test]
    fn a_campaign_that_has_room_has_a_page_for_every_maneuver() {
        let campaign = samples::campaign();
        let pages = chosen(
            &campaign.maneuvers,
            &campaign.fits,
            &Changes::default(),
            30.0,
            campaign.maneuvers.len(),
        );
        assert_eq!(pages.len(), campaign.maneuvers.len());
    }

    #[test]
    fn where_there_is_no_room_what_stands_for_a_class_what_changed_and_what_failed_come_first() {
        let campaign = samples::campaign();
        let failed: Vec<&str> = campaign
            .fits
            .iter()
            .filter(|f| f.outcome != "converged")
            .map(|f| f.maneuver_id.as_str())
            .collect();
        let classes: BTreeSet<&str> = campaign
            .maneuvers
            .iter()
            .map(|m| m.class.as_str())
            .collect();
        let plain = chosen(
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
        let pages = chosen(&campaign.maneuvers, &campaign.fits, &changes, 30.0, most);
        assert!(pages.len() == most && pages.contains(other) && pages.is_superset(&at_30));
        assert!(!failed.is_empty() && failed.iter().all(|id| pages.contains(*id)));
    }
}
