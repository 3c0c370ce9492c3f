//! Flying qualities of simulated campaigns, from records to levels: do the intervals hold, and do the stated
//! probabilities come true?

use std::collections::BTreeMap;

use super::minutes::UP_TO_60;
use super::world::{FlownCard, World, evidence};
use crate::aero::WindTunnel;
use crate::maneuver::{Maneuver, Means};
use crate::model::{Model, model};
use crate::numerics::statistics::forecasts::reliability;
use crate::qualities::{JudgedAircraft, Qualities, qualities};
use crate::tables::{Airframe, FlyingQuality, Level, LevelRow, QualityRow};

/// Campaigns of 46 maneuvers each: 1,012 maneuvers.
const CAMPAIGNS: u64 = 22;

impl World {
    /// Flying qualities by a model, in the conditions of the flown maneuvers.
    fn qualities_by(&self, model: &Model, tunnel: &WindTunnel, flown: &[FlownCard]) -> Qualities {
        let basis = JudgedAircraft {
            model,
            aircraft: &self.config.aircraft,
            aero_model: &self.config.aero_model,
            tunnel,
            specification: self.config.qualities.as_ref().unwrap(),
        };
        let with_means = flown.iter().map(|(m, e)| (m, e.means.as_ref().unwrap()));
        let flown: Vec<(&Maneuver, &Means)> = with_means.collect();
        qualities(&basis, &flown)
    }

    /// Flying qualities of the posterior after the list, and of the true aircraft.
    fn after_list(&self) -> [Qualities; 2] {
        let (flown, _) = self.fly_list();
        let posterior = self.model(&evidence(&flown));
        // Without maneuvers the posterior has the mean of its tunnel.
        let truth = &self.shipped.config.tunnel;
        let of_truth = model(&[], &self.config.aero_model, truth, &self.config.model);
        [
            self.qualities_by(&posterior, &self.config.tunnel, &flown),
            self.qualities_by(&of_truth, truth, &flown),
        ]
    }
}

/// Pairs of an estimated row and the true one of the same place.
fn pairs<'a, R, K: Ord>(
    estimated: &'a [R],
    truth: &'a [R],
    place: impl Fn(&'a R) -> K,
) -> Vec<(&'a R, &'a R)> {
    let truth: BTreeMap<K, &R> = truth.iter().map(|row| (place(row), row)).collect();
    let own = estimated.iter();
    own.filter_map(|row| Some((row, *truth.get(&place(row))?)))
        .collect()
}

/// Hundredths of a degree of an angle of attack.
fn angle(alpha_deg: f64) -> String {
    format!("{alpha_deg:.2}")
}

fn quality_place(row: &QualityRow) -> (Airframe, String, FlyingQuality) {
    (row.airframe, angle(row.alpha_deg), row.quantity)
}

fn level_place(row: &LevelRow) -> (Airframe, String, &str) {
    (row.airframe, angle(row.alpha_deg), &row.paragraph)
}

/// Does the interval hold the true value? An end without a number is open; `None` without an interval or
/// a true value.
fn holds(row: &QualityRow, truth: &QualityRow) -> Option<bool> {
    let truth = truth.value?;
    row.value?;
    row.lower_95.or(row.upper_95)?;
    let lower = row.lower_95.unwrap_or(f64::NEG_INFINITY);
    let upper = row.upper_95.unwrap_or(f64::INFINITY);
    Some((lower..=upper).contains(&truth))
}

/// Stated probabilities of the levels, and which one is true.
fn forecasts(row: &LevelRow, truth: &LevelRow) -> [(f64, bool); 4] {
    [
        (row.level_1_pct, Level::One),
        (row.level_2_pct, Level::Two),
        (row.level_3_pct, Level::Three),
        (row.worse_pct, Level::Worse),
    ]
    .map(|(pct, level)| (0.01 * pct, truth.level == level))
}

/// Intervals that hold, and all.
type Held = (usize, usize);

fn share((held, all): Held) -> f64 {
    held as f64 / all as f64
}

/// Intervals of some quantities together.
fn sum<'a>(counts: impl Iterator<Item = &'a Held>) -> Held {
    counts.fold((0, 0), |sum, own| (sum.0 + own.0, sum.1 + own.1))
}

/// `make next-study`: the list flown, estimated, fused and judged, over 22 campaigns. Between the list's
/// angles the prior decides.
#[test]
#[ignore = "a study of minutes: 1,012 maneuvers"]
#[expect(clippy::print_stdout, reason = "the figures are the study's result")]
fn intervals_of_flying_qualities_hold_over_1012_maneuvers() {
    let mut flown: BTreeMap<FlyingQuality, Held> = BTreeMap::new();
    let mut between: BTreeMap<FlyingQuality, Held> = BTreeMap::new();
    let mut stated = Vec::new();
    for seed in 1..=CAMPAIGNS {
        let [estimated, truth] = World::with_shipped_candidates(seed).after_list();
        for (row, truth) in pairs(&estimated.qualities, &truth.qualities, quality_place) {
            let is_flown = UP_TO_60.contains(&row.alpha_deg);
            let counts = if is_flown { &mut flown } else { &mut between };
            if let Some(holds) = holds(row, truth) {
                let count = counts.entry(row.quantity).or_default();
                *count = (count.0 + usize::from(holds), count.1 + 1);
            }
        }
        for (row, truth) in pairs(&estimated.levels, &truth.levels, level_place) {
            stated.extend(forecasts(row, truth));
        }
    }
    for (quantity, count) in &flown {
        let own = share(*count);
        println!("{quantity}: {own:.3} of {} intervals hold", count.1);
    }
    let [of_flown, of_others] = [&flown, &between].map(|counts| share(sum(counts.values())));
    let score = reliability(&stated);
    println!(
        "all: {of_flown:.3}, between the angles {of_others:.3}; reliability of the levels {score:.4}"
    );
    assert!((0.93..=0.97).contains(&of_flown), "{of_flown}");
    assert!(score < 0.01, "{score}");
}
