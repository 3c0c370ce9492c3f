//! Choice of the cards of a flight: the information that they bring, against the minutes that they
//! take.
//!
//! The derivatives of each coefficient have a Gaussian distribution. A card observes some of their
//! linear combinations with noise; the effect on the covariance does not depend on the observed
//! values. An aim is a quantity whose standard deviation is to be lowered. It may have parts in
//! several coefficients, which are independent. Let v be its variance, the sum over the parts, and
//! w its wanted standard deviation. Flying a set of cards is worth
//!
//! Σ weight · ½ (ln max(v before, w²) − ln max(v after, w²))
//!
//! in nats, summed over the aims. A reduction below the wanted deviation is worth nothing.
//!
//! The search builds two greedy sets: by worth, and by worth per minute. It improves each by
//! exchange: it removes a card, fills the minutes again, and keeps the change if the worth rises. A
//! greedy set alone is worse than the best one if cards complement each other, or if the minutes do
//! not divide evenly.

use nalgebra::{Cholesky, DMatrix, Dyn};

use crate::lab::campaign::NextFlight;
use crate::model::PlannedRows;
use crate::numerics::linear_algebra::triangular::solve_lower;

/// Worth below which a card adds nothing, nats.
const LEAST_WORTH: f64 = 1e-6;

/// Least improvement of a set by an exchange, as a share of its worth: smaller ones take time and
/// change no decision.
const LEAST_IMPROVEMENT: f64 = 1e-4;

/// Largest number of rounds of exchanges: the search then ends with the set it has.
const MOST_ROUNDS: usize = 20;

/// Quantity whose standard deviation is to be lowered.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim {
    pub parts: Vec<AimPart>,
    pub weight: f64,
    /// Wanted standard deviation; zero if every reduction counts.
    pub wanted: f64,
    /// Index of the quantity among the requested quantities.
    pub point: usize,
}

/// Part of an aim in one coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AimPart {
    /// Index of the coefficient.
    pub coefficient: usize,
    /// Row of the coefficient's covariance.
    pub row: usize,
}

/// Covariance of one coefficient's derivatives, with the cards' observations.
#[derive(Clone, Debug)]
pub struct CoefficientCovariance {
    pub covariance: DMatrix<f64>,
    /// In the order of the cards; `None` for a card that observes nothing of the coefficient.
    pub cards: Vec<Option<PlannedRows>>,
}

/// Variance of an aim's parts, from the covariance of each coefficient.
pub fn variance<'c>(parts: &[AimPart], covariance: impl Fn(usize) -> &'c DMatrix<f64>) -> f64 {
    let variances = parts.iter();
    variances
        .map(|part| covariance(part.coefficient)[(part.row, part.row)])
        .sum()
}

/// Price of a card.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Price {
    /// Time of the card with its trim and recovery.
    pub minutes: f64,
    pub alpha_deg: f64,
}

/// Flight time, and the rates at which it is spent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    pub minutes: f64,
    /// Time to change the angle of attack by one degree. Cards are flown by ascending angle.
    pub minutes_per_deg: f64,
    /// Largest number of times that one card is flown.
    pub repeats: usize,
}

impl Budget {
    /// Budget of a flight of some minutes at the prices of the cards.
    #[must_use]
    pub fn of(next: &NextFlight, minutes: f64) -> Budget {
        Budget {
            minutes,
            minutes_per_deg: next.change_s_per_deg / 60.0,
            repeats: next.repeats,
        }
    }
}

/// Choice to be made.
#[derive(Clone, Debug)]
pub struct CardChoice {
    pub coefficients: Vec<CoefficientCovariance>,
    pub aims: Vec<Aim>,
    pub prices: Vec<Price>,
    pub budget: Budget,
}

/// Criterion by which a set is filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Preference {
    Worth,
    WorthPerMinute,
}

/// A set of cards, and the covariances after flying it.
#[derive(Clone, Debug)]
pub struct CardSet<'a> {
    choice: &'a CardChoice,
    covariances: Vec<DMatrix<f64>>,
    /// Number of times that each card is flown.
    pub times: Vec<usize>,
}

impl CardChoice {
    /// Chooses the set that is worth most, as far as exchanges find it.
    #[must_use]
    pub fn choose(&self) -> CardSet<'_> {
        let start = |preference| {
            let mut set = CardSet::empty(self);
            set.fill(preference);
            set.exchange();
            CardSet::with_times(self, &set.times)
        };
        let [worth, per_minute] = [Preference::Worth, Preference::WorthPerMinute].map(start);
        if worth.worth() > per_minute.worth() {
            worth
        } else {
            per_minute
        }
    }
}

impl<'a> CardSet<'a> {
    /// Set without cards.
    #[must_use]
    pub fn empty(choice: &'a CardChoice) -> CardSet<'a> {
        let coefficients = choice.coefficients.iter();
        CardSet {
            choice,
            covariances: coefficients.map(|c| c.covariance.clone()).collect(),
            times: vec![0; choice.prices.len()],
        }
    }

    /// Set in which each card is flown this number of times.
    #[must_use]
    pub fn with_times(choice: &'a CardChoice, times: &[usize]) -> CardSet<'a> {
        let mut set = CardSet::empty(choice);
        for (card, &times) in times.iter().enumerate() {
            for _ in 0..times {
                set.fly(card);
            }
        }
        set
    }

    /// Adds a card. One whose noise is not positive definite changes nothing.
    pub fn fly(&mut self, card: usize) {
        for (coefficient, covariance) in self.choice.coefficients.iter().zip(&mut self.covariances)
        {
            let Some((rows, sum)) = predicted(coefficient, covariance, card) else {
                continue;
            };
            let columns = covariance.columns_range(rows.rows.clone()).into_owned();
            *covariance -= &columns * sum.solve(&columns.transpose());
        }
        self.times[card] += 1;
    }

    /// The set with one of its cards flown once less.
    #[must_use]
    pub fn without(&self, card: usize) -> CardSet<'a> {
        let mut set = self.clone();
        for (coefficient, covariance) in self.choice.coefficients.iter().zip(&mut set.covariances) {
            let Some(rows) = &coefficient.cards[card] else {
                continue;
            };
            let first = rows.rows.start;
            let own = covariance.view((first, first), rows.noise.shape());
            let Some(rest) = Cholesky::new(&rows.noise - own) else {
                continue;
            };
            let columns = covariance.columns_range(rows.rows.clone()).into_owned();
            *covariance += &columns * rest.solve(&columns.transpose());
        }
        set.times[card] -= 1;
        set
    }

    /// Worth of the set, nats.
    #[must_use]
    pub fn worth(&self) -> f64 {
        let aims = self.choice.aims.iter();
        let before = |coefficient: usize| &self.choice.coefficients[coefficient].covariance;
        aims.map(|aim| aim.worth(variance(&aim.parts, before), self.variance(aim)))
            .sum()
    }

    /// Worth that a further card adds, nats.
    #[must_use]
    pub fn gain(&self, card: usize) -> f64 {
        let both = self.choice.coefficients.iter().zip(&self.covariances);
        let halves: Vec<Option<DMatrix<f64>>> = both
            .map(|(coefficient, covariance)| {
                let (rows, sum) = predicted(coefficient, covariance, card)?;
                let mut halves = covariance.rows_range(rows.rows.clone()).into_owned();
                solve_lower(sum.l_dirty().as_view(), halves.as_view_mut());
                Some(halves)
            })
            .collect();
        let reduction = |part: &AimPart| {
            let halves = halves[part.coefficient].as_ref();
            halves.map_or(0.0, |halves| halves.column(part.row).norm_squared())
        };
        let aims = self.choice.aims.iter();
        aims.map(|aim| {
            let before = self.variance(aim);
            let reduction: f64 = aim.parts.iter().map(reduction).sum();
            aim.worth(before, before - reduction)
        })
        .sum()
    }

    fn variance(&self, aim: &Aim) -> f64 {
        variance(&aim.parts, |coefficient| &self.covariances[coefficient])
    }

    /// Standard deviation of an aim after the set is flown.
    #[must_use]
    pub fn deviation(&self, aim: &Aim) -> f64 {
        self.variance(aim).max(0.0).sqrt()
    }

    /// Minutes of the set: its cards, and the change from the lowest angle of attack to the
    /// highest.
    #[must_use]
    pub fn minutes(&self) -> f64 {
        self.minutes_with(None)
    }

    fn minutes_with(&self, further: Option<usize>) -> f64 {
        let (mut minutes, mut lowest, mut highest) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
        for (card, price) in self.choice.prices.iter().enumerate() {
            let times = self.times[card] + usize::from(further == Some(card));
            if times > 0 {
                minutes += times as f64 * price.minutes;
                lowest = lowest.min(price.alpha_deg);
                highest = highest.max(price.alpha_deg);
            }
        }
        minutes + (highest - lowest).max(0.0) * self.choice.budget.minutes_per_deg
    }

    /// Adds cards as long as one fits and is worth something.
    fn fill(&mut self, preference: Preference) {
        while let Some(card) = self.best(preference) {
            self.fly(card);
        }
    }

    fn best(&self, preference: Preference) -> Option<usize> {
        let minutes = self.minutes();
        let mut best: Option<(usize, f64)> = None;
        for card in 0..self.times.len() {
            let with = self.minutes_with(Some(card));
            let budget = &self.choice.budget;
            if self.times[card] >= budget.repeats || with > budget.minutes {
                continue;
            }
            let gain = self.gain(card);
            let merit = match preference {
                Preference::Worth => gain,
                Preference::WorthPerMinute => gain / (with - minutes),
            };
            if gain > LEAST_WORTH && best.is_none_or(|(_, other)| merit > other) {
                best = Some((card, merit));
            }
        }
        best.map(|(card, _)| card)
    }

    /// Takes out one card after another and fills the minutes again, as long as that is worth more.
    fn exchange(&mut self) {
        let mut worth = self.worth();
        for _ in 0..MOST_ROUNDS {
            let mut is_better = false;
            for card in 0..self.times.len() {
                if self.times[card] == 0 {
                    continue;
                }
                for preference in [Preference::Worth, Preference::WorthPerMinute] {
                    if self.times[card] == 0 {
                        break;
                    }
                    let mut other = self.without(card);
                    other.fill(preference);
                    let of_other = other.worth();
                    if of_other > worth * (1.0 + LEAST_IMPROVEMENT) {
                        (*self, worth, is_better) = (other, of_other, true);
                    }
                }
            }
            if !is_better {
                break;
            }
        }
    }
}

impl Aim {
    /// Worth of lowering the variance of the aim from `before` to `after`, nats.
    #[must_use]
    pub fn worth(&self, before: f64, after: f64) -> f64 {
        let counted = |variance: f64| variance.max(self.wanted * self.wanted);
        let (before, after) = (counted(before), counted(after));
        if after > 0.0 {
            0.5 * self.weight * (before / after).ln()
        } else {
            0.0
        }
    }
}

/// Rows of a card with the covariance of their observations; `None` if the card observes nothing of
/// the coefficient.
fn predicted<'s>(
    coefficient: &'s CoefficientCovariance,
    covariance: &DMatrix<f64>,
    card: usize,
) -> Option<(&'s PlannedRows, Cholesky<f64, Dyn>)> {
    let rows = coefficient.cards[card].as_ref()?;
    let first = rows.rows.start;
    let own = covariance.view((first, first), rows.noise.shape());
    let sum = Cholesky::new(own + &rows.noise)?;
    Some((rows, sum))
}
