//! Decision that a flight is to bring: between which limits a quantity lies.
//!
//! The quantity is x = g + n. g is a linear combination of the derivatives; by tonight's posterior
//! it is normal with mean m and standard deviation σ. n is independent, with standard deviation ν,
//! which no flight lowers. The quantity is decided once x lies between two neighbouring limits with
//! a stated probability p.
//!
//! A flight that lowers the standard deviation of g to σ′ moves its mean to m′. Before the flight
//! m′ is normal with mean m and variance τ² = σ² − σ′². With s² = σ′² + ν² the interval from l to u
//! is decided if
//!
//! Φ((u − m′)/s) − Φ((l − m′)/s) ≥ p.
//!
//! The left side falls with the distance of m′ from the interval's middle, so this holds for m′
//! from a to b. The flight decides with the probability Σ Φ((b − m)/τ) − Φ((a − m)/τ) over the
//! intervals, which do not overlap for p over a half. With one limit at the distance d of the mean,
//! and without n, it is Φ((d − zσ′)/τ) + Φ(−(d + zσ′)/τ), where Φ(z) = p.

use crate::numerics::normal;

/// Halvings of an interval by which a root is found.
const HALVINGS: usize = 60;

/// Quantity to be decided.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Mean by tonight's posterior.
    pub mean: f64,
    /// Ascending limits.
    pub limits: Vec<f64>,
    /// Standard deviation ν, which no flight lowers.
    pub rest: f64,
    /// Probability p that decides, over a half.
    pub share: f64,
    /// `true` if the limits lie about the mean and move with it.
    pub follows_mean: bool,
}

impl Decision {
    /// The most probable interval, and its probability, for this standard deviation of the
    /// derivatives' part.
    #[must_use]
    pub fn most_probable(&self, deviation: f64) -> ((f64, f64), f64) {
        let spread = deviation.hypot(self.rest);
        let below = |limit: f64| normal::below((limit - self.mean) / spread);
        let all = self.intervals();
        let all = all.map(|(low, high)| ((low, high), below(high) - below(low)));
        let anything = ((f64::NEG_INFINITY, f64::INFINITY), 0.0);
        all.fold(
            anything,
            |best, own| if own.1 > best.1 { own } else { best },
        )
    }

    fn is_decided(&self, deviation: f64) -> bool {
        self.most_probable(deviation).1 >= self.share
    }

    /// Probability that a flight decides the quantity by changing the standard deviation from
    /// `before` to `after`.
    #[must_use]
    pub fn decided(&self, before: f64, after: f64) -> f64 {
        let spread = after.hypot(self.rest);
        let moved = (before * before - after * after).max(0.0).sqrt();
        if self.follows_mean || moved <= 0.0 {
            return f64::from(u8::from(self.is_decided(after)));
        }
        let deciding = self
            .intervals()
            .filter_map(|own| self.deciding(own, spread));
        let probability = deciding.map(|(low, high)| {
            normal::below((high - self.mean) / moved) - normal::below((low - self.mean) / moved)
        });
        probability.sum::<f64>().clamp(0.0, 1.0)
    }

    /// `true` if the quantity is not decided yet, and exact derivatives might decide it.
    #[must_use]
    pub fn is_open(&self, before: f64) -> bool {
        !self.is_decided(before) && self.decided(before, 0.0) > 0.0
    }

    /// Largest standard deviation after a flight that decides with the stated probability; zero where
    /// none does.
    #[must_use]
    pub fn wanted(&self, before: f64) -> f64 {
        largest_up_to(before, |after| self.decided(before, after) >= self.share)
    }

    fn intervals(&self) -> impl Iterator<Item = (f64, f64)> {
        let limits = self.limits.iter().copied();
        let lows = std::iter::once(f64::NEG_INFINITY).chain(limits.clone());
        lows.zip(limits.chain([f64::INFINITY]))
    }

    /// Range of means for which an interval is decided; `None` if it is too narrow for the spread.
    fn deciding(&self, (low, high): (f64, f64), spread: f64) -> Option<(f64, f64)> {
        let distance = normal::quantile(self.share) * spread;
        match (low.is_finite(), high.is_finite()) {
            (false, false) => Some((low, high)),
            (false, true) => Some((low, high - distance)),
            (true, false) => Some((low + distance, high)),
            (true, true) => {
                let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
                let inside = |offset: f64| normal::within(half, offset, spread);
                (inside(0.0) >= self.share).then(|| {
                    let offset = largest_up_to(half, |offset| inside(offset) >= self.share);
                    (middle - offset, middle + offset)
                })
            }
        }
    }
}

/// Largest number from zero to a limit that satisfies a condition, which must fail at every larger
/// number; zero if no number does.
fn largest_up_to(limit: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, limit);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
