//! Probability that the next flight decides the limits between which a quantity lies. They are the
//! levels of a flying quality, or the tolerances of a proof of match.
//!
//! # Symbols
//!
//! All but Φ, p and z are in the unit of the quantity.
//!
//! | symbol | quantity |
//! |---|---|
//! | x = g + n | the quantity |
//! | g | its part that is linear in the derivatives |
//! | m, σ | mean and standard deviation of g in tonight's posterior |
//! | m′, σ′ | the same after the flight |
//! | τ | standard deviation of m′ as seen before the flight |
//! | n, ν | independent part with mean zero, and its standard deviation, which no flight lowers |
//! | s | standard deviation of x after the flight |
//! | l, u | neighbouring limits |
//! | p | probability from which x counts as decided, over a half |
//! | Φ, z | distribution function of the standard normal distribution; Φ(z) = p |
//!
//! # Decision
//!
//! x is *decided* if it lies between two neighbouring limits with the probability p or more. After
//! the flight x is normal with the mean m′ and the variance s² = σ′² + ν². The interval from l to u
//! is decided if
//!
//! Φ((u − m′)/s) − Φ((l − m′)/s) ≥ p.
//!
//! The left side falls as m′ moves away from the middle of the interval. The condition therefore
//! holds for every m′ from some a to some b, the *deciding means* of this interval. The deciding
//! means of two intervals do not overlap, since p is over a half.
//!
//! # Probability before the flight
//!
//! Before the flight m′ is a random variable. It is normal with the mean m and the variance τ² = σ²
//! − σ′², by which the flight lowers the variance of g. The probability that the flight decides is
//! the sum over all intervals of
//!
//! Φ((b − m)/τ) − Φ((a − m)/τ).
//!
//! For one limit at a distance d from m, and ν = 0, the sum is Φ((d − zσ′)/τ) + Φ(−(d + zσ′)/τ).

use crate::numerics::bisection::last_that_holds;
use crate::numerics::statistics::normal;

/// Halvings of an interval in a search: to 2⁻⁶⁰ of its length, the last digit.
const HALVINGS: usize = 60;

/// Quantity x to be decided, in its own unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Mean m in tonight's posterior.
    pub mean: f64,
    /// Limits in ascending order; the outermost intervals reach below the first and above the last
    /// limit.
    pub limits: Vec<f64>,
    /// Standard deviation ν of the part n, which no flight lowers.
    pub fixed_deviation: f64,
    /// Probability p from which the quantity counts as decided, over a half.
    pub required_probability: f64,
    /// `true` if the limits move with the mean, so that the standard deviation alone decides.
    pub follows_mean: bool,
}

impl Decision {
    /// Limits of the most probable interval, and its probability, if g has this standard deviation.
    #[must_use]
    pub fn most_probable(&self, deviation: f64) -> ((f64, f64), f64) {
        let total_deviation = deviation.hypot(self.fixed_deviation);
        let below = |limit: f64| normal::below((limit - self.mean) / total_deviation);
        let all = self.intervals();
        let all = all.map(|(low, high)| ((low, high), below(high) - below(low)));
        let anything = ((f64::NEG_INFINITY, f64::INFINITY), 0.0);
        all.fold(
            anything,
            |best, own| if own.1 > best.1 { own } else { best },
        )
    }

    fn is_decided(&self, deviation: f64) -> bool {
        self.most_probable(deviation).1 >= self.required_probability
    }

    /// Probability that a flight decides the quantity if it lowers the standard deviation of g from
    /// `before` to `after`.
    #[must_use]
    pub fn probability_of_decision(&self, before: f64, after: f64) -> f64 {
        let total_deviation = after.hypot(self.fixed_deviation);
        let moved = (before * before - after * after).max(0.0).sqrt();
        if self.follows_mean || moved <= 0.0 {
            return f64::from(u8::from(self.is_decided(after)));
        }
        let deciding = self
            .intervals()
            .filter_map(|own| self.deciding_means(own, total_deviation));
        let probability = deciding.map(|(low, high)| {
            normal::below((high - self.mean) / moved) - normal::below((low - self.mean) / moved)
        });
        probability.sum::<f64>().clamp(0.0, 1.0)
    }

    /// `true` if the quantity is undecided with the standard deviation `before` of g, and exact
    /// derivatives might decide it.
    #[must_use]
    pub fn is_open(&self, before: f64) -> bool {
        !self.is_decided(before) && self.probability_of_decision(before, 0.0) > 0.0
    }

    /// Largest standard deviation of g after a flight that decides the quantity with the probability
    /// p; zero if no flight does.
    #[must_use]
    pub fn largest_deciding_deviation(&self, before: f64) -> f64 {
        largest_up_to(before, |after| {
            self.probability_of_decision(before, after) >= self.required_probability
        })
    }

    fn intervals(&self) -> impl Iterator<Item = (f64, f64)> {
        let limits = self.limits.iter().copied();
        let lows = std::iter::once(f64::NEG_INFINITY).chain(limits.clone());
        lows.zip(limits.chain([f64::INFINITY]))
    }

    /// Deciding means a and b of the interval from `low` to `high`, for the standard deviation
    /// `total_deviation` of x. `None` if the interval is too narrow to have any.
    fn deciding_means(&self, (low, high): (f64, f64), total_deviation: f64) -> Option<(f64, f64)> {
        let distance = normal::quantile(self.required_probability) * total_deviation;
        match (low.is_finite(), high.is_finite()) {
            (false, false) => Some((low, high)),
            (false, true) => Some((low, high - distance)),
            (true, false) => Some((low + distance, high)),
            (true, true) => {
                let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
                let inside = |offset: f64| normal::within(half, offset, total_deviation);
                (inside(0.0) >= self.required_probability).then(|| {
                    let offset =
                        largest_up_to(half, |offset| inside(offset) >= self.required_probability);
                    (middle - offset, middle + offset)
                })
            }
        }
    }
}

/// Largest number from zero to a limit that satisfies a condition, which must fail at every larger
/// number; zero if no number does.
fn largest_up_to(limit: f64, holds: impl Fn(f64) -> bool) -> f64 {
    last_that_holds((0.0, limit), HALVINGS, holds).0
}
