//! Intervals that hold, and probabilities that come true.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::fixture::{linear, posterior, specification};
use crate::aero::Axis;
use crate::model::LocalPosterior;
use crate::numerics::dual::Dual;
use crate::numerics::random::RandomStream;
use crate::numerics::root::{EXACT, root};
use crate::qualities::analysis::AxisAnalysis;
use crate::qualities::levels::level;
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
        let of_truth = linear.quantities(axis, &truth.mean, Differentiation::ValuesAlone);
        let of_truth: BTreeMap<FlyingQuality, f64> = of_truth
            .unwrap()
            .quantities
            .into_iter()
            .map(|(q, dual)| (q, dual.value))
            .collect();
        let root = root(&truth.covariance, EXACT);
        let mut stream = RandomStream::new(5, axis.name());
        let mut inside: BTreeMap<FlyingQuality, usize> = BTreeMap::new();
        for _ in 0..CAMPAIGNS {
            let estimated = LocalPosterior {
                mean: drawn(&truth.mean, &root, &mut stream),
                ..truth.clone()
            };
            let found = AxisAnalysis::of(axis, &linear, &estimated, 0).unwrap();
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
    let found = AxisAnalysis::of(axis, &linear(axis, &sure), &sure, 400).unwrap();
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
    let found = AxisAnalysis::of(axis, &linear(axis, &unsure), &unsure, 400).unwrap();
    assert!(found.coalesced > 0.05, "{}", found.coalesced);
    let drawn = basis(&found);
    assert_eq!(drawn.basis, DeviationBasis::Draws);
    assert!(drawn.lower < drawn.upper && drawn.deviation > 0.0);
}

/// Reliability part of the Brier score: mean square of forecast less frequency over ten bins.
fn reliability(forecasts: &[(f64, bool)]) -> f64 {
    let mut bins = [(0.0, 0.0, 0.0); 10];
    for (probability, came_true) in forecasts {
        let first_above = bins
            .iter()
            .zip(1..)
            .position(|(_, i)| *probability < 0.1 * f64::from(i));
        let bin = &mut bins[first_above.unwrap_or(9)];
        *bin = (
            bin.0 + 1.0,
            bin.1 + probability,
            bin.2 + f64::from(u8::from(*came_true)),
        );
    }
    let parts = bins.iter().filter(|bin| bin.0 > 0.0);
    let sum: f64 = parts.map(|bin| (bin.1 - bin.2).powi(2) / bin.0).sum();
    sum / forecasts.len() as f64
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
        let found = AxisAnalysis::of(axis, &linear, &estimated, 200).unwrap();
        let is_level_1 = |draw: &&BTreeMap<FlyingQuality, f64>| {
            level_1(&draw.iter().map(|(q, v)| (*q, *v)).collect::<Vec<_>>())
        };
        let count = found.draws.iter().filter(is_level_1).count();
        let of_truth = linear.quantities(axis, &truth, Differentiation::ValuesAlone);
        let of_truth: Vec<(FlyingQuality, f64)> = of_truth
            .unwrap()
            .quantities
            .into_iter()
            .map(|(q, dual)| (q, dual.value))
            .collect();
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
