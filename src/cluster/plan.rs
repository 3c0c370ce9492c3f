//! The plan: every item of work with its cost and its shard, and what it was made from.

use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::lineage::{Lineage, Stage};

/// The form of the file; another is refused.
const FORM: u32 = 1;

/// What is dealt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Of {
    /// Flights: ingest and segment.
    Flights,
    /// Maneuvers of flights that are ingested and segmented: estimate.
    Maneuvers,
}

impl Of {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Of::Flights => "flights",
            Of::Maneuvers => "maneuvers",
        }
    }

    /// The last stage that its shards work on.
    #[must_use]
    pub fn stage(self) -> Stage {
        match self {
            Of::Flights => Stage::Segment,
            Of::Maneuvers => Stage::Estimate,
        }
    }
}

/// One flight or maneuver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Of the flight or maneuver.
    pub id: String,
    /// The flight of the archive that it comes from.
    pub flight_id: String,
    /// Expected cost; only ratios count.
    pub cost: f64,
    /// 1 to the number of shards.
    pub shard: usize,
}

/// What is to be computed, and by whom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    form: u32,
    pub of: Of,
    pub shards: usize,
    pub items: Vec<Item>,
    /// Input, configuration and code, as far as they decide the items.
    pub lineage: Lineage,
}

impl Plan {
    /// Deals items (id, flight, cost), in their order, to shards of about equal cost.
    ///
    /// A shard has neighbours: the maneuvers of a flight share its record. A shard's cost differs
    /// from the mean by no more than that of the dearest item.
    #[must_use]
    pub fn deal(
        of: Of,
        shards: usize,
        items: Vec<(String, String, f64)>,
        lineage: &Lineage,
    ) -> Plan {
        let shards = shards.max(1);
        let total: f64 = items.iter().map(|(_, _, cost)| cost).sum();
        let mut before = 0.0;
        let dealt = |(id, flight_id, cost): (String, String, f64)| {
            let middle = (before + 0.5 * cost) / total.max(f64::MIN_POSITIVE);
            before += cost;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of the shards, from zero"
            )]
            let shard = (middle * shards as f64) as usize;
            Item {
                id,
                flight_id,
                cost,
                shard: shard.min(shards - 1) + 1,
            }
        };
        Plan {
            form: FORM,
            of,
            shards,
            items: items.into_iter().map(dealt).collect(),
            lineage: lineage.until(of.stage()),
        }
    }

    /// Reads a plan.
    ///
    /// # Errors
    /// Why the text is none, or none that can be worked by: a plan of another program, an item
    /// twice or in no shard.
    pub fn read(text: &str) -> Result<Plan, String> {
        let plan: Plan =
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

    /// The plan as text.
    #[must_use]
    pub fn text(&self) -> String {
        // Strings, numbers and maps with strings as keys: nothing that JSON cannot hold.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The items of a shard.
    pub fn share(&self, shard: usize) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(move |item| item.shard == shard)
    }

    /// The shards that have one of these items.
    #[must_use]
    pub fn shards_of(&self, ids: &BTreeSet<String>) -> BTreeSet<usize> {
        self.items
            .iter()
            .filter(|item| ids.contains(&item.id))
            .map(|item| item.shard)
            .collect()
    }

    /// The cost of each shard.
    #[must_use]
    pub fn costs(&self) -> BTreeMap<usize, f64> {
        let mut costs: BTreeMap<usize, f64> = (1..=self.shards).map(|shard| (shard, 0.0)).collect();
        for item in &self.items {
            *costs.entry(item.shard).or_default() += item.cost;
        }
        costs
    }
}

/// Numbers as schedulers write the tasks of an array: `1,4-7`.
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

/// One shard of many, as typed: `3/24`.
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

    fn items(costs: &[f64]) -> Vec<(String, String, f64)> {
        costs
            .iter()
            .enumerate()
            .map(|(i, cost)| (format!("m{i:03}"), "f".to_owned(), *cost))
            .collect()
    }

    #[test]
    fn every_item_is_dealt_once_and_no_shard_is_dearer_than_the_mean_and_one_item() {
        for n in [1, 4, 24, 200] {
            let costs: Vec<f64> = (0..106).map(|i| 1.0 + f64::from(i * i % 17)).collect();
            let plan = Plan::deal(Of::Maneuvers, n, items(&costs), &Lineage::default());
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
        let plan = Plan::deal(Of::Flights, 3, items(&[0.0, 0.0]), &Lineage::default());
        assert_eq!(Plan::read(&plan.text()), Ok(plan));
    }

    #[test]
    fn a_plan_with_an_item_twice_or_in_no_shard_is_refused() {
        let plan = Plan::deal(Of::Maneuvers, 2, items(&[1.0, 1.0]), &Lineage::default());
        let refused = |change: &dyn Fn(&mut Plan)| {
            let mut other = plan.clone();
            change(&mut other);
            Plan::read(&other.text()).unwrap_err()
        };
        assert!(refused(&|p| p.items[1].id = "m000".into()).contains("`m000` is dealt twice"));
        assert!(refused(&|p| p.items[1].shard = 3).contains("shard 3 of 2"));
        assert!(refused(&|p| p.form = 2).contains("form 2"));
        assert!(Plan::read("{").unwrap_err().contains("no plan"));
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
