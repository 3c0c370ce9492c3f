//! The promise of a plan: the bounds that it predicts are those after its cards were flown, estimated and
//! fused.

use super::world::{FlownCard, World, deviation, evidence};
use crate::flight_plan::candidate::CandidateCard;
use crate::flight_plan::choice::Budget;
use crate::numerics::statistics::order_statistics::{median, quantile};

impl World {
    /// Bounds after a planned flight over the predicted ones, where the flight changes a bound by a
    /// tenth or more.
    fn ratios(&self, mut flown: Vec<FlownCard>, budget: Budget) -> Vec<f64> {
        let plan = self.plan(&flown, budget);
        flown.extend(self.fly("z", &self.cards(&plan)));
        let after = self.model(&evidence(&flown));
        let changed = plan.goals.iter().filter(|g| g.after < 0.9 * g.before);
        changed
            .map(|goal| deviation(&after, goal) / goal.after)
            .collect()
    }
}

/// Bounds over promised ones after a first flight of some cards and a planned second one.
fn ratios(seed: u64, points: &[(&str, &[f64])], first: &[usize], minutes: f64) -> Vec<f64> {
    let world = World::new(seed, points);
    let all = world.candidates();
    let cards: Vec<CandidateCard> = first.iter().map(|&i| all[i].clone()).collect();
    let flown = world.fly("a", &cards);
    world.ratios(flown, world.budget(minutes))
}

fn within(ratios: &[f64], low: f64, high: f64) -> f64 {
    let inside = ratios.iter().filter(|r| (low..=high).contains(*r)).count();
    inside as f64 / ratios.len() as f64
}

/// `make next-study`: a first flight of eight cards, then a planned one of 15 minutes, over ten seeds.
#[test]
#[ignore = "a study of minutes"]
#[expect(clippy::print_stdout, reason = "the figures are the study's result")]
fn the_bounds_of_planned_flights_are_kept() {
    let longitudinal: &[f64] = &[10.0, 20.0, 30.0, 40.0];
    let points = [
        ("OLON", longitudinal),
        ("3211", longitudinal),
        ("PPSS", longitudinal),
        ("OLAT", longitudinal),
        ("SSIMD_LAT", longitudinal),
        ("PYRS", longitudinal),
    ];
    let all: Vec<f64> = (1..=10)
        .flat_map(|seed| ratios(seed, &points, &[0, 2, 5, 7, 12, 14, 17, 23], 15.0))
        .collect();
    let median = median(all.iter().copied()).unwrap();
    let share = within(&all, 0.75, 1.33);
    let [low, high] = [0.05, 0.95].map(|p| quantile(all.iter().copied(), p).unwrap());
    println!(
        "{} bounds: median {median:.3}, 5 to 95 % {low:.3} to {high:.3}, {share:.3} within 0.75 to 1.33",
        all.len()
    );
    assert!((0.9..=1.1).contains(&median), "{median}");
    assert!(share >= 0.9, "{share}");
}
