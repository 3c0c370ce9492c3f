//! Choice of cards against exhaustive search, and its updates against dense algebra.

use approx::assert_relative_eq;
use nalgebra::DMatrix;

use crate::flight_plan::choice::{
    Aim, AimPart, Budget, CardChoice, CardSet, CoefficientCovariance, Price,
};
use crate::model::PlannedRows;
use crate::numerics::statistics::random::RandomStream;

const CARDS: usize = 12;

/// Rows that a card observes of a coefficient.
const ROWS: usize = 2;

const AIMS: usize = 8;

/// Random posterior of the coefficient with a place: covariance G Gᵀ of cards' rows and aims over fewer
/// unknowns, so that cards overlap and complete each other.
fn coefficient(place: usize, random: &mut RandomStream) -> (CoefficientCovariance, Vec<Aim>) {
    let (rows, unknowns) = (CARDS * ROWS + AIMS, 10);
    let gains = DMatrix::from_fn(rows, unknowns, |_, j| random.normal() / (1.0 + j as f64));
    let noise = |random: &mut RandomStream| {
        let root = DMatrix::from_fn(ROWS, ROWS, |_, _| random.normal());
        let size = (1.5 * random.normal()).exp() * 0.3;
        (&root * root.transpose() + DMatrix::identity(ROWS, ROWS) * 0.2) * size
    };
    let cards = (0..CARDS).map(|card| {
        (random.uniform() < 0.8).then(|| PlannedRows {
            rows: card * ROWS..(card + 1) * ROWS,
            noise: noise(random),
        })
    });
    let cards = cards.collect();
    let aims = (0..AIMS).map(|i| Aim {
        parts: vec![AimPart {
            coefficient: place,
            row: CARDS * ROWS + i,
        }],
        weight: random.uniform(),
        wanted: if random.uniform() < 0.5 { 0.3 } else { 0.0 },
        point: place * AIMS + i,
    });
    let aims = aims.collect();
    let coefficient = CoefficientCovariance {
        covariance: &gains * gains.transpose(),
        cards,
    };
    (coefficient, aims)
}

fn choice(seed: u64, minutes: impl Fn(usize) -> f64, budget: Budget) -> CardChoice {
    let mut random = RandomStream::new(seed, "posterior");
    let both = [0, 1].map(|place| coefficient(place, &mut random));
    let [(first, of_first), (second, of_second)] = both;
    CardChoice {
        coefficients: vec![first, second],
        aims: of_first.into_iter().chain(of_second).collect(),
        prices: (0..CARDS)
            .map(|card| Price {
                minutes: minutes(card),
                alpha_deg: 5.0 * card as f64,
            })
            .collect(),
        budget,
    }
}

/// A choice with each aim of the first coefficient in the second as well.
fn with_shared_aims(mut choice: CardChoice) -> CardChoice {
    for aim in &mut choice.aims[..AIMS] {
        let row = aim.parts[0].row;
        aim.parts.push(AimPart {
            coefficient: 1,
            row,
        });
    }
    choice
}

/// Flight time of four cards of a minute each.
const FOUR: Budget = Budget {
    minutes: 4.0,
    minutes_per_deg: 0.0,
    repeats: 1,
};

/// Sets of cards, as times, that fit a budget without repeats.
fn sets(choice: &CardChoice) -> Vec<Vec<usize>> {
    let all = (0..1_usize << CARDS).map(|bits| (0..CARDS).map(|c| bits >> c & 1).collect());
    let fits = |times: &Vec<usize>| {
        let cost = times.iter().zip(&choice.prices);
        let minutes: f64 = cost.map(|(n, price)| *n as f64 * price.minutes).sum();
        let flown = || (0..CARDS).filter(|card| times[*card] > 0);
        let way = flown().next_back().zip(flown().next());
        let way = way.map_or(0.0, |(last, first)| 5.0 * (last - first) as f64);
        minutes + way * choice.budget.minutes_per_deg <= choice.budget.minutes + 1e-9
    };
    all.filter(fits).collect()
}

fn share_of_best(choice: &CardChoice) -> f64 {
    let worth = sets(choice)
        .into_iter()
        .map(|times| CardSet::with_times(choice, &times).worth());
    let best = worth.fold(0.0, f64::max);
    choice.choose().worth() / best
}

#[test]
fn four_of_twelve_cards_reach_95_percent_of_the_best_of_all_495_sets() {
    for seed in 0..100 {
        let choice = choice(seed, |_| 1.0, FOUR);
        let whole = sets(&choice);
        assert_eq!(
            whole
                .iter()
                .filter(|set| set.iter().sum::<usize>() == 4)
                .count(),
            495
        );
        for choice in [choice.clone(), with_shared_aims(choice)] {
            let share = share_of_best(&choice);
            assert!(share >= 0.95, "seed {seed}: {share}");
        }
    }
}

#[test]
fn uneven_minutes_and_ways_between_angles_reach_95_percent_as_well() {
    for seed in 100..130 {
        let minutes = |card: usize| 0.5 + (card * 7 % 5) as f64 * 0.4;
        let budget = Budget {
            minutes: 5.0,
            minutes_per_deg: 0.03,
            ..FOUR
        };
        let choice = choice(seed, minutes, budget);
        let chosen = choice.choose();
        assert!(chosen.minutes() <= 5.0);
        let share = share_of_best(&choice);
        assert!(share >= 0.95, "seed {seed}: {share}");
    }
}

#[test]
fn a_card_updates_the_covariance_as_a_gaussian_observation_does() {
    let choice = with_shared_aims(choice(7, |_| 1.0, FOUR));
    let mut times = vec![0; CARDS];
    for card in [1, 4, 4, 9] {
        times[card] += 1;
    }
    let updated = |coefficient: &CoefficientCovariance| {
        let mut expected = coefficient.covariance.clone();
        for card in [1, 4, 4, 9] {
            let Some(rows) = &coefficient.cards[card] else {
                continue;
            };
            let pick = DMatrix::from_fn(ROWS, expected.nrows(), |i, j| {
                f64::from(u8::from(j == rows.rows.start + i))
            });
            let sum = &pick * &expected * pick.transpose() + &rows.noise;
            let gain = &expected * pick.transpose() * sum.try_inverse().unwrap();
            expected -= &gain * &pick * &expected;
        }
        expected
    };
    let expected: Vec<DMatrix<f64>> = choice.coefficients.iter().map(updated).collect();
    let flown = CardSet::with_times(&choice, &times);
    for aim in &choice.aims {
        let parts = aim.parts.iter();
        let variance: f64 = parts
            .map(|part| expected[part.coefficient][(part.row, part.row)])
            .sum();
        assert_relative_eq!(flown.deviation(aim), variance.sqrt(), max_relative = 1e-9);
    }
    times[4] = 1;
    let (once, without) = (CardSet::with_times(&choice, &times), flown.without(4));
    assert_relative_eq!(without.worth(), once.worth(), max_relative = 1e-9);
    assert_relative_eq!(
        once.gain(4),
        flown.worth() - once.worth(),
        max_relative = 1e-7
    );
    assert_eq!(without.times, once.times);
}

#[test]
fn what_goes_beyond_a_wanted_bound_is_worth_nothing() {
    let aim = |wanted| Aim {
        parts: vec![],
        weight: 2.0,
        wanted,
        point: 0,
    };
    // From 0.4 to 0.1: the logarithm of 4 times the weight; to a wanted 0.2 that of 2.
    assert_relative_eq!(aim(0.0).worth(0.16, 0.01), 2.0 * 4f64.ln());
    assert_relative_eq!(aim(0.2).worth(0.16, 0.01), 2.0 * 2f64.ln());
    assert_relative_eq!(aim(0.5).worth(0.16, 0.01), 0.0);
}

#[test]
fn a_card_is_flown_as_often_as_the_budget_says() {
    for (repeats, most) in [(1, 1), (3, 3)] {
        let budget = Budget {
            minutes: 100.0,
            repeats,
            ..FOUR
        };
        let choice = choice(3, |_| 1.0, budget);
        let chosen = choice.choose();
        assert_eq!(chosen.times.iter().max(), Some(&most));
        let nothing = Budget {
            minutes: 0.5,
            ..FOUR
        };
        let choice = CardChoice {
            budget: nothing,
            ..choice.clone()
        };
        assert_eq!(choice.choose().times, [0; CARDS]);
    }
}
