//! Experience with the classes of a campaign.

use approx::assert_relative_eq;

use crate::estimate::{Covariance, Estimated};
use crate::flight_plan::experience::{CampaignHistory, colour, noise_factors, with_noise};
use crate::maneuver::Maneuver;
use crate::output_error::error_effect::{ErrorEffect, SharedError};
use crate::tables::{ContributionRow, FitRow, Outcome};

/// Two parameters: variances of 1 and 4 by Cramér and Rao, three times as large corrected, and the
/// effects of a held value (0.5, 1) and of a bias (0, 2).
fn covariance() -> Covariance {
    let held = ErrorEffect {
        error: SharedError::Held("x".into()),
        deviation: 1.0,
        change: vec![0.5, 1.0],
    };
    let bias = ErrorEffect {
        error: SharedError::Bias("y".into()),
        deviation: 1.0,
        change: vec![0.0, 2.0],
    };
    Covariance {
        names: vec!["a".into(), "b".into()],
        white: vec![1.0 + 0.25, 0.5, 0.5, 4.0 + 1.0],
        corrected: vec![3.0 + 0.25, 0.5, 0.5, 12.0 + 1.0 + 4.0],
        shared_errors: vec![held, bias],
    }
}

#[test]
fn the_colour_is_without_the_errors_that_maneuvers_share() {
    assert_relative_eq!(colour(&covariance()).unwrap(), 3.0);
}

#[test]
fn more_noise_leaves_the_shared_errors_as_they_are() {
    let noisier = with_noise(&covariance(), 2.0);
    assert_relative_eq!(noisier.corrected[0], 6.25);
    assert_relative_eq!(noisier.corrected[1], 0.5);
    assert_relative_eq!(noisier.corrected[3], 24.0 + 5.0);
    assert_relative_eq!(colour(&noisier).unwrap(), 6.0);
}

/// Maneuvers of class `A` of which each converged or not, and one of class `B` that did.
fn history(converged: &[bool]) -> (Vec<Maneuver>, Vec<FitRow>, Vec<Option<Covariance>>) {
    let mut maneuvers = vec![];
    let mut fits = vec![];
    for (i, is_usable) in converged.iter().chain([&true]).enumerate() {
        let mut maneuver = Maneuver::example(&format!("m{i}"), 10.0);
        if i == converged.len() {
            maneuver.class = "B".into();
        }
        let outcome = if *is_usable {
            Outcome::Converged
        } else {
            Outcome::NotConverged
        };
        fits.push(FitRow {
            outcome,
            ..Estimated::unknown_class(&maneuver).fit
        });
        maneuvers.push(maneuver);
    }
    let covariances = vec![Some(covariance()); maneuvers.len()];
    (maneuvers, fits, covariances)
}

#[test]
fn the_share_of_usable_maneuvers_is_the_class_s_own_beside_two_of_the_campaign() {
    let (maneuvers, fits, covariances) = history(&[true, true, false]);
    let row = |class: &str, weight| ContributionRow {
        maneuver_id: String::new(),
        class: class.into(),
        coefficient: String::new(),
        weight,
    };
    let contributions = [row("A", 0.5), row("A", 0.9), row("B", 1.0)];
    let history = CampaignHistory {
        maneuvers: &maneuvers,
        fits: &fits,
        covariances: &covariances,
        contributions: &contributions,
    };
    // Of the campaign's four maneuvers three: (3 + 1) / (4 + 1).
    let ordinary = 0.8;
    let own = history.of("A");
    assert_relative_eq!(own.usable, (2.0 + 2.0 * ordinary) / 5.0);
    assert_relative_eq!(own.weight, 0.7);
    let other = history.of("C");
    assert_relative_eq!(other.usable, ordinary);
    assert_relative_eq!(other.weight, 0.8);
    let quieter = with_noise(&covariance(), 0.5);
    let as_noisy = covariance();
    let factors = noise_factors(&history, [("A", &quieter), ("C", &as_noisy)]);
    assert_relative_eq!(factors["A"], 2.0);
    assert_relative_eq!(factors["C"], 1.0);
}
