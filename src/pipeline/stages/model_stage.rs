//! Posterior of the campaign. It is made anew each time from the estimates.

use std::collections::BTreeMap;

use crate::aero::{Coefficient, Combined};
use crate::config::Config;
use crate::error::{Problem, ProblemStage};
use crate::estimate::HeldValues;
use crate::maneuver::Means;
use crate::model::{self, Failure, MOST_POINTS, ManeuverResults, Model, PublishedManeuver};
use crate::output_error::Outcome;
use crate::pipeline::campaign::Campaign;
use crate::pipeline::problems::problem;
use crate::tables::{EstimateRow, LiftAndDragRow};

/// Version of the posterior.
pub const MODEL_VERSION: u32 = 8;

/// Computes the posterior from the maneuvers that converged.
pub fn fit_model(config: &Config, campaign: &mut Campaign) {
    let evidence = evidence(campaign);
    let found = model::model(&evidence, &config.aero_model, &config.tunnel, &config.model);
    let problems: Vec<_> = found.failed.iter().map(failed).collect();
    let sums = &config.aero_model.combined;
    let read_held = |rows: &[EstimateRow]| match config.estimate.held_values {
        HeldValues::Posterior => with_held(rows, &found, &evidence, sums),
        HeldValues::Tunnel => rows.to_vec(),
    };
    let (estimates, combined) = (
        read_held(&campaign.estimates),
        read_held(&campaign.combined),
    );
    let means = campaign.maneuvers.iter().zip(&campaign.means);
    let means = means.filter_map(|(m, means)| Some((m.maneuver_id.as_str(), means.as_ref()?)));
    let lift_and_drag = lift_and_drag(config, &found, &evidence, &means.collect(), &estimates);
    campaign.problems.extend(problems);
    (campaign.estimates, campaign.combined) = (estimates, combined);
    campaign.lift_and_drag = lift_and_drag;
    campaign.model = found;
}

/// Results of the maneuvers that converged, as evidence for the posterior.
pub fn evidence(campaign: &Campaign) -> Vec<ManeuverResults<'_>> {
    let estimates = EstimateRow::by_maneuver(&campaign.estimates);
    let combined = EstimateRow::by_maneuver(&campaign.combined);
    let maneuvers = campaign.maneuvers.iter().zip(&campaign.covariances);
    let evidence = maneuvers.zip(&campaign.fits).filter_map(|(pair, fit)| {
        let (maneuver, covariance) = pair;
        let covariance = covariance.as_ref()?;
        let id = maneuver.maneuver_id.as_str();
        (fit.outcome == Outcome::Converged).then_some(ManeuverResults {
            maneuver,
            estimates: estimates.get(id)?,
            combined: combined.get(id).copied().unwrap_or_default(),
            covariance,
        })
    });
    evidence.collect()
}

/// Lift and drag of the maneuvers, from their estimates as they are published.
fn lift_and_drag(
    config: &Config,
    model: &Model,
    evidence: &[ManeuverResults],
    means: &BTreeMap<&str, &Means>,
    estimates: &[EstimateRow],
) -> Vec<LiftAndDragRow> {
    let estimates = EstimateRow::by_maneuver(estimates);
    let by_posterior = config.estimate.held_values == HeldValues::Posterior;
    let of_maneuver = |evidence: &ManeuverResults| {
        let id = evidence.maneuver.maneuver_id.as_str();
        let flown = PublishedManeuver {
            evidence,
            estimates: estimates.get(id)?,
            means: means.get(id)?,
            aircraft: &config.aircraft,
            aero_model: &config.aero_model,
        };
        Some(model.lift_and_drag(&flown, by_posterior))
    };
    evidence.iter().filter_map(of_maneuver).flatten().collect()
}

/// Rows of the maneuvers with their held values taken from the posterior of the other flights.
fn with_held(
    rows: &[EstimateRow],
    model: &Model,
    evidence: &[ManeuverResults],
    sums: &[Combined],
) -> Vec<EstimateRow> {
    let evidence = evidence
        .iter()
        .map(|e| (e.maneuver.maneuver_id.as_str(), e));
    let evidence: BTreeMap<&str, &ManeuverResults> = evidence.collect();
    let mut new = Vec::with_capacity(rows.len());
    for own in rows.chunk_by(|a, b| a.maneuver_id == b.maneuver_id) {
        match evidence.get(own[0].maneuver_id.as_str()) {
            Some(evidence) => {
                let with = model.with_held(evidence);
                new.extend(own.iter().map(|row| with.row(row, sums)));
            }
            None => new.extend_from_slice(own),
        }
    }
    new
}

/// Problem of a coefficient without posterior.
fn failed((coefficient, failure): &(Coefficient, Failure)) -> Problem {
    let place = format!("{coefficient:?}");
    problem(ProblemStage::Model, "", &place, &reason(*failure))
}

/// Reason of a posterior's failure, in the words of a problem.
fn reason(failure: Failure) -> String {
    match failure {
        Failure::NotFinite => {
            "its posterior could not be computed: an estimate or a covariance is not finite"
                .to_owned()
        }
        Failure::TooManyPoints(points) => format!(
            "its posterior was not computed: the tunnel's tables and `model: alpha_step_deg` make a \
             grid of {points} points for it, and at most {MOST_POINTS} are possible"
        ),
    }
}
