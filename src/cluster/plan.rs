//! The plan of a campaign in shards: items with their costs and shards, and their lineage.

use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::lineage::{Lineage, Stage};
use crate::recorder::FlightCorrections;
use crate::surfaces::DelayCorrection;

/// Version of the file; another version is refused.
const FORM: u32 = 3;

/// Kind of items that a plan deals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DealtKind {
    /// Flights: ingest, segment, evidence on the surfaces.
    Flights,
    /// Maneuvers of flights that are ingested and segmented: estimate.
    Maneuvers,
}

impl DealtKind {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            DealtKind::Flights => "flights",
            DealtKind::Maneuvers => "maneuvers",
        }
    }

    /// Last stage that the shards compute.
    #[must_use]
    pub fn last_stage(self) -> Stage {
        match self {
            DealtKind::Flights => Stage::Segment,
            DealtKind::Maneuvers => Stage::Estimate,
        }
    }
}

/// A flight or maneuver in a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Id of the flight or maneuver.
    pub id: String,
    /// Flight of the archive.
    pub flight_id: String,
    /// Expected cost; only ratios count.
    pub cost: f64,
    /// Number of the shard, from 1.
    pub shard: usize,
}

/// A flight or maneuver to be dealt.
#[derive(Clone, Debug, PartialEq)]
pub struct ShardWork {
    /// Id of the flight or maneuver.
    pub id: String,
    /// Flight of the archive.
    pub flight_id: String,
    /// Expected cost; only ratios count.
    pub cost: f64,
}

/// A campaign's work, dealt to shards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardPlan {
    form: u32,
    pub of: DealtKind,
    pub shards: usize,
    pub items: Vec<Item>,
    /// Corrections of the surfaces' delays from all flights; a plan of flights has none.
    pub delays: Vec<DelayCorrection>,
    /// Corrections of flights whose instruments all flights together decide; a plan of flights has none.
    pub corrections: Vec<FlightCorrections>,
    /// Lineage as far as the last stage of the shards.
    pub lineage: Lineage,
}

impl ShardPlan {
    /// Deals work, in its order, to shards of about equal cost.
    ///
    /// A shard gets neighbouring items, because the maneuvers of a flight share its record. Its
    /// cost differs from the mean by at most the cost of the most expensive item.
    #[must_use]
    pub fn deal(
        of: DealtKind,
        shards: usize,
        work: Vec<ShardWork>,
        delays: Vec<DelayCorrection>,
        lineage: &Lineage,
    ) -> ShardPlan {
        let shards = shards.max(1);
        let total: f64 = work.iter().map(|work| work.cost).sum();
        let mut before = 0.0;
        let item = |work: ShardWork| {
            let middle = (before + 0.5 * work.cost) / total.max(f64::MIN_POSITIVE);
            before += work.cost;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of the shards, from zero"
            )]
            let shard = (middle * shards as f64) as usize;
            Item {
                id: work.id,
                flight_id: work.flight_id,
                cost: work.cost,
                shard: shard.min(shards - 1) + 1,
            }
        };
        ShardPlan {
            form: FORM,
            of,
            shards,
            items: work.into_iter().map(item).collect(),
            delays,
            corrections: vec![],
            lineage: lineage.until(of.last_stage()),
        }
    }

    /// Reads a plan.
    ///
    /// # Errors
    /// The reason that the text is no valid plan: another program's, an item twice or in no shard.
    pub fn read(text: &str) -> Result<ShardPlan, String> {
        let plan: ShardPlan =
            serde_json::from_str(text).map_err(|e| format!("is no plan of this program: {e}"))?;
        if plan.form != FORM {
            return Err(format!(
                "is a plan of form {}, not {FORM}: plan again",
                plan.form
            ));
        }
        let mut seen = BTreeSet::new();
        if let Some(twice) = plan.items.iter().find(|item| !seen.insert(&item.id)) {
            return Err(format!(
                "{} `{}` is dealt twice: plan again",
                plan.of.name(),
                twice.id
            ));
        }
        if let Some(lost) = plan
            .items
            .iter()
            .find(|item| !(1..=plan.shards).contains(&item.shard))
        {
            return Err(format!(
                "`{}` is dealt to shard {} of {}: plan again",
                lost.id, lost.shard, plan.shards
            ));
        }
        Ok(plan)
    }

    /// Text of the plan's file.
    #[must_use]
    pub fn text(&self) -> String {
        // Strings, numbers and maps with strings as keys: nothing that JSON cannot hold.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Items of a shard.
    pub fn share(&self, shard: usize) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(move |item| item.shard == shard)
    }

    /// Shards that have one of these items.
    #[must_use]
    pub fn shards_of(&self, ids: &BTreeSet<String>) -> BTreeSet<usize> {
        self.items
            .iter()
            .filter(|item| ids.contains(&item.id))
            .map(|item| item.shard)
            .collect()
    }

    /// Cost of each shard.
    #[must_use]
    pub fn costs(&self) -> BTreeMap<usize, f64> {
        let mut costs: BTreeMap<usize, f64> = (1..=self.shards).map(|shard| (shard, 0.0)).collect();
        for item in &self.items {
            *costs.entry(item.shard).or_default() += item.cost;
        }
        costs
    }
}

/// Formats numbers as schedulers write the tasks of an array: `1,4-7`.
#[must_use]
pub fn array(shards: &BTreeSet<usize>) -> String {
    let shards: Vec<usize> = shards.iter().copied().collect();
    let runs = shards.chunk_by(|a, b| a + 1 == *b);
    let run = |run: &[usize]| match run {
        [first, .., last] => format!("{first}-{last}"),
        _ => run.iter().map(usize::to_string).collect(),
    };
    runs.map(run).collect::<Vec<String>>().join(",")
}

/// One shard of several, as typed: `3/24`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub number: usize,
    pub of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let parts = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Shard { number, of }),
            _ => Err("give the shard as i/N, i from 1 to N: 3/24".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work(costs: &[f64]) -> Vec<ShardWork> {
        costs
            .iter()
            .enumerate()
            .map(|(i, cost)| ShardWork {
                id: format!("m{i:03}"),
                flight_id: "f".to_owned(),
                cost: *cost,
            })
            .collect()
    }

    #[test]
    fn every_item_is_dealt_once_and_no_shard_is_dearer_than_the_mean_and_one_item() {
        for n in [1, 4, 24, 200] {
            let costs: Vec<f64> = (0..106).map(|i| 1.0 + f64::from(i * i % 17)).collect();
            let plan = ShardPlan::deal(
                DealtKind::Maneuvers,
                n,
                work(&costs),
                vec![],
                &Lineage::default(),
            );
            assert_eq!((1..=n).flat_map(|shard| plan.share(shard)).count(), 106);
            let (mean, dearest) = (costs.iter().sum::<f64>() / n as f64, 17.0);
            assert!(
                plan.costs()
                    .values()
                    .all(|cost| *cost <= mean + dearest + 1e-9),
                "{n}: {:?}",
                plan.costs()
            );
            assert!(plan.items.windows(2).all(|w| w[0].shard <= w[1].shard));
        }
    }

    #[test]
    fn items_that_cost_nothing_are_dealt_all_the_same() {
        let plan = ShardPlan::deal(
            DealtKind::Flights,
            3,
            work(&[0.0, 0.0]),
            vec![],
            &Lineage::default(),
        );
        assert_eq!(ShardPlan::read(&plan.text()), Ok(plan));
    }

    #[test]
    fn a_plan_with_an_item_twice_or_in_no_shard_is_refused() {
        let plan = ShardPlan::deal(
            DealtKind::Maneuvers,
            2,
            work(&[1.0, 1.0]),
            vec![],
            &Lineage::default(),
        );
        let refused = |change: &dyn Fn(&mut ShardPlan)| {
            let mut other = plan.clone();
            change(&mut other);
            ShardPlan::read(&other.text()).unwrap_err()
        };
        assert!(refused(&|p| p.items[1].id = "m000".into()).contains("`m000` is dealt twice"));
        assert!(refused(&|p| p.items[1].shard = 3).contains("shard 3 of 2"));
        assert!(refused(&|p| p.form = 1).contains("form 1"));
        assert!(ShardPlan::read("{").unwrap_err().contains("no plan"));
    }

    #[test]
    fn shards_are_written_as_arrays_are() {
        assert_eq!(array(&[].into()), "");
        assert_eq!(array(&[7].into()), "7");
        assert_eq!(array(&[1, 4, 5, 6, 9, 10].into()), "1,4-6,9-10");
    }

    #[test]
    fn a_shard_is_one_of_its_number() {
        assert_eq!("3/24".parse(), Ok(Shard { number: 3, of: 24 }));
        for wrong in ["0/4", "5/4", "3", "a/b", "1/0", "-1/4"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
