//! Simulation-based calibration (Talts et al. 2018): truth from the prior, flights from the truth, ranks of
//! the truth in the posterior.

use nalgebra::DVector;

use super::fixture::{Flown, at, diagonal, exact, maneuver, posterior, tunnel};
use crate::model::Settings;
use crate::numerics::linear_algebra::root::{EXACT, root};
use crate::numerics::statistics::normal;
use crate::numerics::statistics::random::RandomStream;

/// Draws truth and estimates of one campaign; returns the rank of the truth of the slope at 20 deg.
fn rank(noise: &mut RandomStream, settings: &Settings) -> f64 {
    let tunnel = tunnel(Some(0.01));
    let (size, length_deg) = (
        (0.4 * noise.normal()).exp(),
        (0.5 * noise.normal()).exp() * 15.0,
    );
    // The slope's difference at 5 deg steps; flights at the same angles.
    let alphas: Vec<f64> = (0..9).map(|i| 5.0 * f64::from(i)).collect();
    let fading = |d: f64| {
        let r = 3f64.sqrt() * d / length_deg;
        (1.0 + r) * (-r).exp()
    };
    let covariance = nalgebra::DMatrix::from_fn(9, 9, |i, j| {
        (size * 0.01).powi(2) * (fading((alphas[i] - alphas[j]).abs()) + 0.25) / 1.25
    });
    let root = root(&covariance, EXACT);
    let differences = &root * DVector::from_fn(root.ncols(), |_, _| noise.normal());
    let flown: Vec<Flown> = [0, 2, 3, 5, 6, 8]
        .into_iter()
        .enumerate()
        .map(|(i, place)| {
            let bound = 0.006;
            let known = tunnel.value("CN_alpha", alphas[place], 0.3).unwrap().value;
            let value = known + differences[place] + bound * noise.normal();
            let estimates = [("CN_alpha", value)];
            let (id, flight) = (format!("m{i}"), format!("f{i}"));
            Flown {
                maneuver: maneuver(&id, &flight, alphas[place]),
                ..Flown::new(&id, &flight, alphas[place], &estimates, &diagonal([bound]))
            }
        })
        .collect();
    let settings = Settings {
        alpha_step_deg: 5.0,
        ..settings.clone()
    };
    let (value, deviation) = at(&posterior(&flown, &tunnel, &settings), "CN_alpha", 20.0);
    let truth = tunnel.value("CN_alpha", 20.0, 0.3).unwrap().value + differences[4];
    normal::below((truth - value) / deviation)
}

#[test]
fn ranks_of_the_truth_in_its_posterior_are_flat() {
    let mut noise = RandomStream::new(11, "ranks");
    let settings = exact();
    let mut counts = [0_u32; 10];
    let all = 600;
    for _ in 0..all {
        let rank = rank(&mut noise, &settings);
        let bin = counts
            .iter()
            .enumerate()
            .position(|(i, _)| rank * 10.0 < (i + 1) as f64);
        counts[bin.unwrap_or(9)] += 1;
    }
    let expected = f64::from(all) / 10.0;
    let square: f64 = counts
        .iter()
        .map(|n| (f64::from(*n) - expected).powi(2) / expected)
        .sum();
    // 99.9 % of χ² with nine degrees of freedom.
    assert!(square < 27.9, "{counts:?}: {square}");
}
