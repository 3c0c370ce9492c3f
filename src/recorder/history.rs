//! Steps and drifts of an error in the order of the flights.
//!
//! A step divides the flights in two parts with a mean each; a drift is a line over the flights.
//! Either is fitted by a regression, together with the scatter between flights; its size over its
//! standard error has Student's t distribution. The probability of the largest step is the
//! probability of a step at one place times the number of places (Bonferroni). False alarms are
//! therefore no more frequent than stated.

use super::common_error::CommonError;
use super::error_series::{ErrorSample, ErrorSeries};
use crate::numerics::statistics::random_effects::{Observation, RandomEffects};
use crate::numerics::statistics::student;

/// Least number of flights on either side of a step.
const FEWEST_BESIDE: usize = 2;

/// Least number of flights with a history.
const FEWEST_IN_HISTORY: usize = 6;

/// Kind of an error's change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeShape {
    Step,
    Drift,
}

/// Change of an error over the flights.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub shape: ChangeShape,
    /// First flight after a step; first flight of a drift.
    pub since: String,
    /// Size of a step; change of a drift from the first flight to the last.
    pub size: f64,
    /// Standard deviation of the size.
    pub bound: f64,
    /// Probability of a change of this size by chance.
    pub probability: f64,
}

/// The less probable of the largest step and the drift. `None` with too few flights. Flights far from
/// the others are left out.
#[must_use]
pub fn change(series: &ErrorSeries, common: &CommonError) -> Option<Change> {
    let is_near = |sample: &&ErrorSample| !common.far.contains(&sample.flight_id);
    let samples: Vec<&ErrorSample> = series.samples.iter().filter(is_near).collect();
    if samples.len() < FEWEST_IN_HISTORY {
        return None;
    }
    let observation = |sample: &&ErrorSample| Observation {
        value: sample.value,
        variance: sample.bound * sample.bound,
    };
    let observations: Vec<Observation> = samples.iter().map(observation).collect();
    let step = step(&observations, &samples);
    let drift = drift(&observations, &samples);
    let both = [step, drift].into_iter().flatten();
    both.min_by(|a, b| a.probability.total_cmp(&b.probability))
        // Two tests were made.
        .map(|change| Change {
            probability: (2.0 * change.probability).min(1.0),
            ..change
        })
}

/// The least probable step.
fn step(observations: &[Observation], samples: &[&ErrorSample]) -> Option<Change> {
    let places = FEWEST_BESIDE..=observations.len() - FEWEST_BESIDE;
    let count = places.clone().count() as f64;
    let at = |first: usize| {
        let regressors = |i: usize| [1.0, f64::from(u8::from(i >= first))];
        let mut change = second_coefficient(observations, regressors)?;
        change.since.clone_from(&samples[first].flight_id);
        change.probability = (count * change.probability).min(1.0);
        Some(change)
    };
    let steps = places.filter_map(at);
    steps.min_by(|a, b| a.probability.total_cmp(&b.probability))
}

fn drift(observations: &[Observation], samples: &[&ErrorSample]) -> Option<Change> {
    let last = (observations.len() - 1) as f64;
    let change = second_coefficient(observations, |i| [1.0, i as f64 / last - 0.5])?;
    Some(Change {
        shape: ChangeShape::Drift,
        since: samples.first()?.flight_id.clone(),
        ..change
    })
}

/// Second coefficient of a regression as a change.
fn second_coefficient(
    observations: &[Observation],
    regressors: impl Fn(usize) -> [f64; 2],
) -> Option<Change> {
    let fit = RandomEffects::of(observations, regressors)?;
    let (size, bound) = (fit.coefficients[1], fit.covariance[(1, 1)].sqrt());
    Some(Change {
        shape: ChangeShape::Step,
        since: String::new(),
        size,
        bound,
        probability: student::exceedance((size / bound).abs(), fit.degrees_of_freedom),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::statistics::random::RandomStream;
    use crate::tables::InstrumentError;

    /// Twelve flights whose truth is a function of the flight, with scatter and errors.
    fn change_of(truth: impl Fn(usize) -> f64, random: &mut RandomStream) -> Change {
        let samples = (0..12).map(|i| {
            let bound = 0.01 + 0.01 * (i % 3) as f64;
            ErrorSample {
                flight_id: format!("f{i:02}"),
                value: truth(i) + 0.02 * random.normal() + bound * random.normal(),
                bound,
                systematic: 0.0,
            }
        });
        let series = ErrorSeries {
            channel: "alpha".to_owned(),
            signal: "alpha_vane_deg".to_owned(),
            error: InstrumentError::Bias,
            ordinary: 0.3,
            corrected: 0.0,
            samples: samples.collect(),
        };
        let common = CommonError::of(&series).unwrap();
        change(&series, &common).unwrap()
    }

    #[test]
    fn a_step_is_found_with_its_flight_and_size() {
        let mut random = RandomStream::new(1, "step");
        let found = change_of(|i| if i >= 7 { 0.4 } else { 0.1 }, &mut random);
        assert_eq!(
            (found.shape, found.since.as_str()),
            (ChangeShape::Step, "f07")
        );
        assert!(
            (found.size - 0.3).abs() < 3.0 * found.bound && found.bound < 0.03,
            "{found:?}"
        );
        assert!(found.probability < 1e-5, "{found:?}");
    }

    #[test]
    fn a_drift_is_found_with_its_size() {
        let mut random = RandomStream::new(2, "drift");
        let found = change_of(|i| 0.05 * i as f64, &mut random);
        assert_eq!(
            (found.shape, found.since.as_str()),
            (ChangeShape::Drift, "f00")
        );
        assert!((found.size - 0.55).abs() < 3.0 * found.bound, "{found:?}");
        assert!(found.probability < 1e-5, "{found:?}");
    }

    #[test]
    fn steady_errors_rarely_change() {
        const TIMES: u32 = 400;
        let mut random = RandomStream::new(3, "steady");
        let mut alarms = 0;
        for _ in 0..TIMES {
            alarms += u32::from(change_of(|_| 0.2, &mut random).probability < 0.05);
        }
        assert!(alarms < 32, "{alarms} of {TIMES} at 5 %");
    }
}
