//! Minutes of planned flights, beside those of the paper's list: every class at every ten degrees.

use super::world::{FlownCard, World, evidence};
use crate::flight_plan::candidate::{CandidateCard, reach_deg};
use crate::numerics::statistics::mean::finite_mean;
use crate::numerics::statistics::order_statistics::median;
use crate::tables::PosteriorRow;

const UP_TO_40: &[f64] = &[10.0, 20.0, 30.0, 40.0];
/// Angles of attack of the list.
pub const UP_TO_60: &[f64] = &[10.0, 20.0, 30.0, 40.0, 50.0, 60.0];

/// Classes and angles of attack of the list, by flight.
const LIST: [&[(&str, &[f64])]; 4] = [
    &[("SSIMD_LON", UP_TO_60), ("OLON", UP_TO_40)],
    &[("SSIMD_LAT", UP_TO_60), ("OLAT", UP_TO_40)],
    &[("3211", UP_TO_60), ("PPSS", UP_TO_40), ("PPSSTV", UP_TO_60)],
    &[("PYRS", UP_TO_40), ("PYRSTV", UP_TO_60)],
];

/// Planned flights of a seed; each has this part of the list's minutes.
const FLIGHTS: usize = 5;

/// Uncertainty after some flights.
#[derive(Clone, Copy, Debug)]
struct Knowledge {
    minutes: f64,
    /// Mean of the logarithms of the standard deviations, each derivative counting as one.
    log_deviation: f64,
    /// Share of the 95 % bands that hold the truth.
    holds: f64,
}

impl World {
    fn knowledge(&self, flown: &[FlownCard], minutes: f64) -> Knowledge {
        let model = self.model(&evidence(flown));
        let truth = self.shipped.config.tunnel.clamped();
        let rows = model.rows.posterior.iter();
        let rows = rows.filter(|row| row.prior_deviation > 0.0 && row.alpha_deg >= 10.0);
        let rows: Vec<&PosteriorRow> = rows.collect();
        let holds = rows.iter().filter_map(|row| {
            let mach = row.mach.unwrap_or_default();
            let truth = truth.value(&row.derivative, row.alpha_deg, mach)?.value;
            Some(f64::from((row.lower_95..=row.upper_95).contains(&truth)))
        });
        let of_derivative = |derivative: &str| {
            let own = rows.iter().filter(|row| row.derivative == derivative);
            finite_mean(own.map(|row| row.standard_deviation.ln()))
        };
        Knowledge {
            minutes,
            log_deviation: finite_mean(model.quantities().filter_map(of_derivative)).unwrap(),
            holds: finite_mean(holds).unwrap(),
        }
    }

    /// Time of a flight with these cards.
    fn minutes(&self, cards: &[CandidateCard]) -> f64 {
        let (low, high) = reach_deg(cards.iter());
        let of_cards: f64 = cards.iter().map(|card| card.minutes).sum();
        of_cards + (high - low) * self.budget(0.0).minutes_per_deg
    }

    /// Flies the list; returns the maneuvers and their minutes.
    pub fn fly_list(&self) -> (Vec<FlownCard>, f64) {
        let all = self.candidates();
        let (mut flown, mut minutes) = (vec![], 0.0);
        for (i, flight) in LIST.iter().enumerate() {
            let is_listed = |c: &&CandidateCard| {
                let mut points = flight.iter();
                points.any(|(class, alphas)| {
                    c.card.class == *class && alphas.contains(&c.card.alpha_deg)
                })
            };
            let cards: Vec<CandidateCard> = all.iter().filter(is_listed).cloned().collect();
            minutes += self.minutes(&cards);
            flown.extend(self.fly(&format!("list {i}"), &cards));
        }
        (flown, minutes)
    }

    /// Uncertainty after the flights of the list.
    fn by_list(&self) -> Knowledge {
        let (flown, minutes) = self.fly_list();
        self.knowledge(&flown, minutes)
    }

    /// Uncertainty after each of the planned flights, from the tunnel alone.
    fn by_plans(&self, list_minutes: f64) -> Vec<Knowledge> {
        let budget = self.budget(list_minutes / FLIGHTS as f64);
        let (mut flown, mut minutes) = (vec![], 0.0);
        let fly = |i: usize| {
            let cards = self.cards(&self.plan(&flown, budget));
            minutes += self.minutes(&cards);
            flown.extend(self.fly(&format!("planned {i}"), &cards));
            self.knowledge(&flown, minutes)
        };
        (0..FLIGHTS).map(fly).collect()
    }
}

/// Share of the list's minutes after which planned flights have reached the same uncertainty;
/// `None` if they never do.
fn share_of_minutes(list: &Knowledge, planned: &[Knowledge]) -> Option<f64> {
    let after = planned
        .iter()
        .position(|k| k.log_deviation <= list.log_deviation)?;
    let to = planned[after];
    let Some(from) = after.checked_sub(1).map(|before| planned[before]) else {
        return Some(to.minutes / list.minutes);
    };
    let part = (from.log_deviation - list.log_deviation) / (from.log_deviation - to.log_deviation);
    Some((from.minutes + part * (to.minutes - from.minutes)) / list.minutes)
}

/// `make next-study`: planned flights from the tunnel alone beside the list, over ten seeds.
#[test]
#[ignore = "a study of minutes"]
#[expect(clippy::print_stdout, reason = "the figures are the study's result")]
fn planned_flights_need_fewer_minutes_than_the_list() {
    let (mut shares, mut holds) = (vec![], vec![]);
    for seed in 1..=10 {
        let world = World::with_shipped_candidates(seed);
        let list = world.by_list();
        let planned = world.by_plans(list.minutes);
        let share = share_of_minutes(&list, &planned);
        println!("seed {seed}: list {list:.3?}");
        println!("  planned {planned:.3?}");
        println!("  share of the minutes {share:.3?}");
        shares.push(share.unwrap_or(f64::INFINITY));
        holds.extend(planned.iter().map(|k| k.holds));
    }
    let median = median(shares.iter().copied()).unwrap();
    let holds = finite_mean(holds).unwrap();
    println!("median share of the minutes {median:.3}; {holds:.3} of the bands hold");
    assert!(median <= 0.6, "{median}");
    assert!((0.93..=0.97).contains(&holds), "{holds}");
}
