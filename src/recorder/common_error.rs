//! Mean of an error over the flights, its scatter between them, and flights far from the others.

use super::error_series::{ErrorSample, ErrorSeries};
use crate::numerics::statistics::random_effects::{Observation, RandomEffects};
use crate::numerics::statistics::student;

/// Least number of flights with a common error: with fewer, the scatter is less certain than its
/// own size.
const FEWEST_FLIGHTS: usize = 4;

/// Probability of the distance by chance, over the flights of a series, below which a flight counts
/// as far from the others. It is low because some fifty series are examined.
const FAR_PROBABILITY: f64 = 1e-4;

/// Least share of a flight's stated variance that its estimate really has. The bounds of the reconstruction contain
/// systematic parts that one recorder has alike: over 108 simulated flights the errors of attitudes were 0.56 to 0.65
/// of the bounds. A larger share: a scatter between flights hides behind the bounds, and completed errors get too
/// small a bound.
const TRUE_SHARE: f64 = 0.35;

/// Mean and scatter of an error.
#[derive(Clone, Debug, PartialEq)]
pub struct CommonError {
    pub mean: f64,
    /// Standard deviation of the mean, including the error that all flights share.
    pub bound: f64,
    /// Standard deviation of the error between flights.
    pub scatter: f64,
    /// Upper 90 % limit of the scatter. The scatter of few flights is itself uncertain.
    pub scatter_limit: f64,
    /// Ids of the flights far from the others, which the mean leaves out.
    pub far: Vec<String>,
}

impl CommonError {
    /// Common error of a series; `None` with too few flights.
    #[must_use]
    pub fn of(series: &ErrorSeries) -> Option<CommonError> {
        let mut near: Vec<&ErrorSample> = series.samples.iter().collect();
        let mut far = Vec::new();
        while near.len() >= FEWEST_FLIGHTS
            && let Some(farthest) = farthest(&near, series.ordinary)
        {
            far.push(near.remove(farthest).flight_id.clone());
        }
        if near.len() < FEWEST_FLIGHTS {
            return None;
        }
        let observations = observations(&near);
        let pooled = RandomEffects::mean_of(&observations)?;
        let widening = student::widening_95(pooled.degrees_of_freedom);
        Some(CommonError {
            mean: pooled.mean(),
            bound: (widening * pooled.variance().sqrt()).hypot(systematic(&near, &pooled)),
            scatter: pooled.scatter_variance.sqrt(),
            scatter_limit: scatter_limit(&observations)?.sqrt(),
            far,
        })
    }

    /// Error of a flight from its own evidence and the common error, with its standard deviation.
    #[must_use]
    pub fn of_flight(&self, own: Option<&ErrorSample>) -> (f64, f64) {
        let prior = (self.scatter_limit.powi(2) + self.bound.powi(2)).recip();
        let (moment, information) = own.map_or((0.0, 0.0), |own| {
            let information = own.bound.powi(-2);
            (information * own.value, information)
        });
        let total = prior + information;
        ((prior * self.mean + moment) / total, total.recip().sqrt())
    }
}

/// Upper 90 % limit of τ² if the flights state variances that are too large.
fn scatter_limit(observations: &[Observation]) -> Option<f64> {
    let with_true = |y: &Observation| Observation {
        variance: TRUE_SHARE * y.variance,
        ..*y
    };
    let observations: Vec<Observation> = observations.iter().map(with_true).collect();
    RandomEffects::mean_of(&observations)?.scatter_limit(&observations)
}

/// Standard deviation of the mean from the parts that all flights share: the mean of the flights'
/// systematic parts, with the weights of the mean.
fn systematic(samples: &[&ErrorSample], pooled: &RandomEffects<1>) -> f64 {
    let weight = |s: &ErrorSample| (s.bound * s.bound + pooled.scatter_variance).recip();
    let moment: f64 = samples.iter().map(|s| weight(s) * s.systematic).sum();
    moment / samples.iter().map(|s| weight(s)).sum::<f64>()
}

fn observations(samples: &[&ErrorSample]) -> Vec<Observation> {
    let observation = |sample: &&ErrorSample| Observation {
        value: sample.value,
        variance: sample.bound * sample.bound,
    };
    samples.iter().map(observation).collect()
}

/// The flight farthest from the others, if neither chance nor an ordinary error explains its
/// distance.
fn farthest(samples: &[&ErrorSample], ordinary: f64) -> Option<usize> {
    let all = observations(samples);
    let probability = |i: usize| {
        let mut others = all.clone();
        let own = others.remove(i);
        let pooled = RandomEffects::mean_of(&others)?;
        let distance = (own.value - pooled.mean()).abs();
        let variance = own.variance + pooled.scatter_variance + pooled.variance();
        let chance = student::exceedance(distance / variance.sqrt(), pooled.degrees_of_freedom);
        let is_far = distance > ordinary && chance * (all.len() as f64) < FAR_PROBABILITY;
        is_far.then_some((i, chance))
    };
    let far = (0..all.len()).filter_map(probability);
    far.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::super::fixture;
    use super::*;
    use crate::numerics::statistics::random::RandomStream;

    fn scales(values: &[(f64, f64)]) -> ErrorSeries {
        fixture::scales(values.iter().copied(), 0.0)
    }

    #[test]
    fn a_flight_far_from_the_others_is_named_and_left_out_of_the_mean() {
        let mut values = vec![
            (0.021, 0.001),
            (0.019, 0.001),
            (0.02, 0.002),
            (0.0205, 0.001),
        ];
        values.extend([
            (0.0195, 0.001),
            (0.02, 0.001),
            (0.0185, 0.001),
            (0.25, 0.004),
        ]);
        let common = CommonError::of(&scales(&values)).unwrap();
        assert_eq!(common.far, ["f7"]);
        assert_abs_diff_eq!(common.mean, 0.0197, epsilon = 5e-4);
        assert!(common.bound < 0.001 && common.scatter < 0.001, "{common:?}");
        assert_eq!(CommonError::of(&scales(&values[..3])), None);
    }

    #[test]
    fn biases_that_scatter_from_flight_to_flight_are_not_far() {
        let values = [0.3, -0.2, 0.1, -0.4, 0.25, 0.0, -0.1].map(|v| (v, 0.01));
        let common = CommonError::of(&scales(&values)).unwrap();
        assert!(common.far.is_empty());
        assert!(common.scatter_limit > common.scatter && common.scatter > 0.2);
    }

    #[test]
    fn a_flight_without_evidence_has_the_mean_and_one_with_much_its_own() {
        let values = [
            (0.021, 0.001),
            (0.019, 0.001),
            (0.02, 0.001),
            (0.0205, 0.001),
        ];
        let common = CommonError::of(&scales(&values)).unwrap();
        let (value, bound) = common.of_flight(None);
        assert_abs_diff_eq!(value, common.mean);
        assert_abs_diff_eq!(
            bound,
            common.scatter_limit.hypot(common.bound),
            epsilon = 1e-12
        );
        let sure = ErrorSample {
            flight_id: String::new(),
            value: 0.03,
            bound: 1e-6,
            systematic: 0.0,
        };
        let (value, bound) = common.of_flight(Some(&sure));
        assert_abs_diff_eq!(value, 0.03, epsilon = 1e-6);
        assert!(bound <= 1e-6);
    }

    #[test]
    fn what_all_flights_have_alike_does_not_average_out() {
        let mut series = scales(&[(0.02, 0.002); 16]);
        series
            .samples
            .iter_mut()
            .for_each(|sample| sample.systematic = 0.001);
        let bound = CommonError::of(&series).unwrap().bound;
        let of_chance = 0.0005 * student::widening_95(15.0);
        assert_abs_diff_eq!(bound, of_chance.hypot(0.001), epsilon = 1e-9);
    }

    #[test]
    fn bounds_of_completed_flights_hold_where_the_flights_state_too_large_ones() {
        const TIMES: u32 = 300;
        let mut random = RandomStream::new(5, "stated");
        let mut inside = 0;
        for _ in 0..TIMES {
            // Attitudes of the light aircraft: errors of 0.07 with bounds of 0.13, and a scatter of 0.12.
            let truth: Vec<f64> = (0..18).map(|_| 0.12 * random.normal()).collect();
            let draw = |truth: &f64| (truth + 0.075 * random.normal(), 0.13);
            let values: Vec<(f64, f64)> = truth[..17].iter().map(draw).collect();
            let common = CommonError::of(&scales(&values)).unwrap();
            let (value, bound) = common.of_flight(None);
            inside += u32::from((value - truth[17]).abs() < 1.96 * bound);
        }
        let share = f64::from(inside) / f64::from(TIMES);
        assert!(share > 0.92, "{share}");
    }

    #[test]
    fn bounds_of_flights_with_little_information_hold() {
        const TIMES: u32 = 300;
        let mut random = RandomStream::new(3, "recorder");
        let mut inside = 0;
        for _ in 0..TIMES {
            let mean = 0.01 * random.normal();
            let truth: Vec<f64> = (0..6).map(|_| mean + 0.002 * random.normal()).collect();
            let mut draw = |truth: f64, bound: f64| (truth + bound * random.normal(), bound);
            let mut values: Vec<(f64, f64)> = truth[..5].iter().map(|t| draw(*t, 0.001)).collect();
            values.push(draw(truth[5], 0.01));
            let series = scales(&values);
            let common = CommonError::of(&series).unwrap();
            let (value, bound) = common.of_flight(series.samples.last());
            inside += u32::from((value - truth[5]).abs() < 1.96 * bound);
        }
        let share = f64::from(inside) / f64::from(TIMES);
        assert!((0.93..0.995).contains(&share), "{share}");
    }
}
