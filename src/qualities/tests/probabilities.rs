//! Intervals that hold, and probabilities that come true.

use std::collections::BTreeMap;

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};

use super::fixture::{linear, posterior, specification};
use crate::aero::Axis;
use crate::model::LocalPosterior;
use crate::numerics::dual::Dual;
use crate::numerics::linear_algebra::root::{EXACT, root};
use crate::numerics::statistics::forecasts::reliability;
use crate::numerics::statistics::random::RandomStream;
use crate::qualities::analysis::{AxisAnalysis, Drawn, standard_draws};
use crate::qualities::levels::{level, value_of};
use crate::qualities::linear::Differentiation;
use crate::tables::{DeviationBasis, FlyingQuality, Level};

/// A draw from a Gaussian.
fn drawn(mean: &DVector<f64>, root: &DMatrix<f64>, stream: &mut RandomStream) -> DVector<f64> {
    let deviates = DVector::from_fn(root.ncols(), |_, _| stream.normal());
    mean + root * deviates
}

/// Uncertainty with correlations: of neighbours a half.
fn correlated(axis: Axis, share: f64) -> LocalPosterior {
    let plain = posterior(axis, share);
    let n = plain.mean.len();
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        let distance = i32::try_from(i.abs_diff(j)).unwrap();
        0.5f64.powi(distance) * (plain.covariance[(i, i)] * plain.covariance[(j, j)]).sqrt()
    });
    LocalPosterior {
        covariance,
        ..plain
    }
}

#[test]
fn the_95_percent_intervals_of_all_quantities_hold_in_1000_campaigns() {
    const CAMPAIGNS: usize = 1000;
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let truth = correlated(axis, 0.04);
        let linear = linear(axis, &truth);
        let none = standard_draws(axis, truth.values.len(), 0);
        let of_truth = linear.quantities(axis, &truth.mean, Differentiation::ValuesAlone);
        let of_truth: BTreeMap<FlyingQuality, f64> =
            of_truth.unwrap().values().into_iter().collect();
        let root = root(&truth.covariance, EXACT);
        let mut stream = RandomStream::new(5, axis.name());
        let mut inside: BTreeMap<FlyingQuality, usize> = BTreeMap::new();
        for _ in 0..CAMPAIGNS {
            let estimated = LocalPosterior {
                mean: drawn(&truth.mean, &root, &mut stream),
                ..truth.clone()
            };
            let found = AxisAnalysis::of(axis, &linear, &estimated, &none).unwrap();
            for (quantity, dual) in &found.mean.quantities {
                let uncertainty = found.uncertainty(*quantity, dual);
                let holds = (uncertainty.lower..=uncertainty.upper).contains(&of_truth[quantity]);
                *inside.entry(*quantity).or_default() += usize::from(holds);
            }
        }
        for (quantity, inside) in inside {
            if of_truth[&quantity].is_finite() {
                let share = inside as f64 / CAMPAIGNS as f64;
                assert!((0.93..=0.97).contains(&share), "{quantity}: {share}");
            }
        }
    }
}

#[test]
fn modes_that_coalesce_have_the_standard_deviation_of_draws() {
    let axis = Axis::Lateral;
    let sure = posterior(axis, 0.01);
    let draws = standard_draws(axis, sure.values.len(), 400);
    let found = AxisAnalysis::of(axis, &linear(axis, &sure), &sure, &draws).unwrap();
    let basis = |found: &AxisAnalysis| {
        let (quantity, dual) = &found.mean.quantities[0];
        found.uncertainty(*quantity, dual)
    };
    assert_eq!(basis(&found).basis, DeviationBasis::Slopes);
    // A directional stability of nearly zero: in some draws the Dutch roll is no oscillation.
    let mut unsure = posterior(axis, 0.01);
    let place = unsure
        .values
        .iter()
        .position(|v| v.derivative == "Cn_beta")
        .unwrap();
    unsure.mean[place] = -0.0002;
    unsure.covariance[(place, place)] = 0.0006 * 0.0006;
    let found = AxisAnalysis::of(axis, &linear(axis, &unsure), &unsure, &draws).unwrap();
    assert!(found.coalesced > 0.05, "{}", found.coalesced);
    let drawn = basis(&found);
    assert_eq!(drawn.basis, DeviationBasis::Draws);
    assert!(drawn.lower < drawn.upper && drawn.deviation > 0.0);
}

/// One over a normal value with this mean and a standard deviation of one, in draws.
fn reciprocals(mean: f64) -> Vec<f64> {
    let mut stream = RandomStream::new(3, "reciprocals");
    (0..200_000)
        .map(|_| 1.0 / (mean + stream.normal()))
        .collect()
}

#[test]
fn the_interval_of_a_quotient_is_that_of_its_distribution() {
    // A mean of 4: 1/(4 + 1.96), 1/(4 − 1.96), and half of 1/3 − 1/5.
    let drawn = reciprocals(4.0);
    let found = Drawn::of(drawn.iter().copied(), drawn.len()).uncertainty();
    assert_eq!(found.basis, DeviationBasis::Draws);
    assert_relative_eq!(found.lower, 0.167_79, max_relative = 0.01);
    assert_relative_eq!(found.upper, 0.490_19, max_relative = 0.01);
    assert_relative_eq!(found.deviation, 0.066_67, max_relative = 0.01);
    // A mean of 0.5: 1/c with Φ(1/c − 0.5) = Φ(−0.5) ∓ 0.025.
    let drawn = reciprocals(0.5);
    let found = Drawn::of(drawn.iter().copied(), drawn.len()).uncertainty();
    assert_relative_eq!(found.lower, -13.85, max_relative = 0.05);
    assert_relative_eq!(found.upper, 14.31, max_relative = 0.05);
}

#[test]
fn draws_without_a_finite_value_open_the_interval_or_remove_it() {
    let with = |other: f64, count: usize| {
        let values = (0..1000).map(|i| if i < count { other } else { i as f64 });
        Drawn::of(values, 1000).uncertainty()
    };
    let few = with(f64::INFINITY, 20);
    assert!(few.lower.is_finite() && few.upper.is_finite());
    let many = with(f64::INFINITY, 30);
    assert!(many.lower.is_finite() && many.upper == f64::INFINITY && many.deviation.is_finite());
    assert!(with(f64::INFINITY, 200).deviation.is_infinite());
    assert!(with(f64::NAN, 20).upper.is_finite());
    let undefined = with(f64::NAN, 30);
    assert!(undefined.lower.is_nan() && undefined.upper.is_nan() && undefined.deviation.is_nan());
    // A mode that does not exist in a draw has no value there.
    let missing = Drawn::of((0..970).map(f64::from), 1000).uncertainty();
    assert!(missing.lower.is_nan() && missing.upper.is_nan());
}

#[test]
fn control_anticipation_beside_a_load_factor_of_zero_has_the_interval_of_its_distribution() {
    let axis = Axis::Longitudinal;
    let mut unsure = posterior(axis, 0.0);
    let place = unsure
        .values
        .iter()
        .position(|v| v.derivative == "CN_alpha")
        .unwrap();
    let linear = linear(axis, &unsure);
    let at = |slope: f64| {
        let mut values = unsure.mean.clone();
        values[place] = slope;
        linear.quantities(axis, &values, Differentiation::ValuesAlone)
    };
    let value =
        |slope: f64, wanted: FlyingQuality| value_of(&at(slope).unwrap().values(), wanted).unwrap();
    // n/α is linear in the lift slope: its zero, and a mean three standard deviations above it.
    let load_factor = |slope: f64| value(slope, FlyingQuality::LoadFactorPerAlpha);
    let (low, high) = (load_factor(0.0), load_factor(0.05));
    let zero = -0.05 * low / (high - low);
    let deviation = 0.005;
    let mean = zero + 3.0 * deviation;
    let quantity = FlyingQuality::ControlAnticipation;
    // Distribution over the lift slope, by its density.
    let mut weighted: Vec<(f64, f64)> = (-50_000..50_000)
        .map(|i| {
            let z = (f64::from(i) + 0.5) * 1e-4;
            (value(mean + z * deviation, quantity), (-0.5 * z * z).exp())
        })
        .collect();
    weighted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = weighted.iter().map(|own| own.1).sum();
    let quantile = |share: f64| {
        let mut sum = 0.0;
        let mut all = weighted.iter();
        all.find(|own| {
            sum += own.1;
            sum >= share * total
        })
        .unwrap()
        .0
    };
    unsure.mean[place] = mean;
    unsure.covariance[(place, place)] = deviation * deviation;
    let draws = standard_draws(axis, unsure.values.len(), 20_000);
    let found = AxisAnalysis::of(axis, &linear, &unsure, &draws).unwrap();
    let mut quantities = found.mean.quantities.iter();
    let (_, dual) = quantities.find(|(q, _)| *q == quantity).unwrap();
    let own = found.uncertainty(quantity, dual);
    assert_eq!(own.basis, DeviationBasis::Draws);
    assert_relative_eq!(own.lower, quantile(0.025), max_relative = 0.05);
    assert_relative_eq!(own.upper, quantile(0.975), max_relative = 0.05);
}

#[test]
fn the_probability_of_level_1_comes_true() {
    let axis = Axis::Longitudinal;
    let prior = correlated(axis, 0.3);
    let linear = linear(axis, &prior);
    let of_prior = linear.quantities(axis, &prior.mean, Differentiation::ValuesAlone);
    let of_prior = of_prior.unwrap().quantities;
    let is_damping = |(q, _): &&(FlyingQuality, Dual)| *q == FlyingQuality::ShortPeriodDamping;
    let middle = of_prior.iter().find(is_damping).unwrap().1.value;
    // The limit is in the middle of the prior, so that forecasts are uncertain.
    let mut specification = specification();
    let mut requirements = specification.requirements.iter_mut();
    let requirement = requirements.find(|r| r.paragraph == "3.2.2.1.2").unwrap();
    requirement.limits[0].level_1.min = Some(middle);
    let damping = requirement.clone();
    let prior_root = root(&prior.covariance, EXACT);
    // Estimates as sure as half of the prior: the posterior is their mean.
    let posterior_covariance = &prior.covariance * 0.2;
    let noise_root = root(&(&prior.covariance * 0.25), EXACT);
    let draws = standard_draws(axis, prior.values.len(), 200);
    let mut stream = RandomStream::new(11, "forecasts");
    let level_1 =
        |values: &[(FlyingQuality, f64)]| level(&specification, &damping, values) == Level::One;
    let mut forecasts = Vec::new();
    for _ in 0..400 {
        let truth = drawn(&prior.mean, &prior_root, &mut stream);
        let measured = drawn(&truth, &noise_root, &mut stream);
        let estimated = LocalPosterior {
            mean: &prior.mean * 0.2 + measured * 0.8,
            covariance: posterior_covariance.clone(),
            values: prior.values.clone(),
        };
        let found = AxisAnalysis::of(axis, &linear, &estimated, &draws).unwrap();
        let count = found.draws.iter().filter(|draw| level_1(draw)).count();
        let of_truth = linear.quantities(axis, &truth, Differentiation::ValuesAlone);
        let of_truth = of_truth.unwrap().values();
        forecasts.push((count as f64 / found.draws.len() as f64, level_1(&of_truth)));
    }
    let sure = forecasts
        .iter()
        .filter(|(p, _)| !(0.1..=0.9).contains(p))
        .count();
    assert!(sure < 350, "{sure} forecasts are nearly certain");
    let score = reliability(&forecasts);
    assert!(score < 0.01, "{score}");
}
