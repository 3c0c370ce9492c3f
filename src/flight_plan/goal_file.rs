//! File of goals, read and checked against the pipeline and its posterior.

use std::path::Path;

use super::goal_points::{GoalBasis, GoalPoint};
use super::goals::{Goal, GoalSubject, Goals};
use crate::config::{Config, Source};
use crate::error::{Result, did_you_mean};
use crate::model::Model;
use crate::tables::{Airframe, FlyingQuality, ModelSource};

/// Reads the goals. Without a file every quantity of the posterior is a goal.
///
/// # Errors
/// A mistake in the file, with its place.
pub fn read(file: Option<&Path>, config: &Config, model: &Model) -> Result<Vec<Goal>> {
    let Some(file) = file else {
        return Ok(model.quantities().map(Goal::of).collect());
    };
    let source = Source::read(file.to_owned())?;
    let goals: Goals = source.parse()?;
    if goals.goals.is_empty() {
        return Err(source.error("goals", "`goals` lists no goal"));
    }
    for goal in &goals.goals {
        let name = goal.name();
        if let Some(mistake) = goal.mistake() {
            return Err(source.error(name, format!("{name}: {mistake}")));
        }
        let unknown = match goal.subject() {
            Some(GoalSubject::Derivative(name)) => unknown_derivative(name, model),
            Some(GoalSubject::Level(airframe, quantity)) => {
                unknown_level(airframe, quantity, config)
            }
            Some(GoalSubject::Match(class, model)) => unknown_match(class, model, config),
            None => None,
        };
        if let Some(what) = unknown {
            return Err(source.error(name, what));
        }
    }
    Ok(goals.goals)
}

/// Checks that each goal of a file has an angle of attack, within the reach of all candidates.
///
/// # Errors
/// The first goal that has none, with its place in the file.
pub fn check_reached(file: Option<&Path>, goals: &[Goal], basis: &GoalBasis) -> Result<()> {
    let Some(file) = file else { return Ok(()) };
    let own = |i: usize| -> Vec<GoalPoint> { basis.points_of(i, &goals[i], &|_| None) };
    let judged = |goal: &Goal| !matches!(goal.subject(), Some(GoalSubject::Derivative(_)));
    let missed = (0..goals.len()).find(|i| judged(&goals[*i]) && own(*i).is_empty());
    let Some(goal) = missed.map(|i| &goals[i]) else {
        return Ok(());
    };
    let name = goal.name();
    let what = match goal.subject() {
        Some(GoalSubject::Match(..)) => format!(
            "no flown maneuver of class `{name}` can be flown again at these angles of attack: \
             widen `alpha_deg` or name another class"
        ),
        _ => format!(
            "`{name}` does not exist, or was not flown, at any of these angles of attack: widen \
             `alpha_deg` or name another quantity (table qualities)"
        ),
    };
    Err(Source::read(file.to_owned())?.error(name, what))
}

/// Reason why a derivative cannot be a goal; `None` if it can.
fn unknown_derivative(name: &str, model: &Model) -> Option<String> {
    let near = || did_you_mean(name, model.quantities());
    let is_unknown = model.breakpoints_deg(name).is_none();
    is_unknown.then(|| format!("the posterior has no derivative `{name}`{}", near()))
}

/// Reason why the level of a quantity cannot be a goal; `None` if it can.
fn unknown_level(airframe: Airframe, quantity: FlyingQuality, config: &Config) -> Option<String> {
    let Some(specification) = &config.qualities else {
        return Some(format!(
            "the level of `{quantity}` is decided by the limits of qualities.yaml, which the \
             pipeline lacks: write one after pipelines/harv/qualities.yaml"
        ));
    };
    if specification.limits_of(quantity).next().is_none() {
        Some(format!(
            "qualities.yaml has no limit of `{quantity}` for its category and class: name a \
             quantity that it limits"
        ))
    } else if !specification.airframes().contains(&airframe) {
        Some(format!(
            "`airframe: {airframe}` needs the feedback of qualities.yaml, which has none"
        ))
    } else {
        None
    }
}

/// Reason why the match of a class cannot be a goal; `None` if it can.
fn unknown_match(class: &str, model: Option<ModelSource>, config: &Config) -> Option<String> {
    if config.proof_of_match.is_none() {
        return Some(format!(
            "the match of `{class}` is decided by the tolerances of match.yaml, which the pipeline \
             lacks: write one after pipelines/harv/match.yaml"
        ));
    }
    if config.class(class).is_none() {
        let classes = config.classes.iter().map(|c| c.name.as_str());
        let near = did_you_mean(class, classes);
        return Some(format!("the pipeline has no class `{class}`{near}"));
    }
    let is_given = model != Some(ModelSource::Database)
        || config
            .proof_of_match
            .as_ref()
            .is_some_and(|own| own.database.is_some());
    if model == Some(ModelSource::Trend) {
        Some("trends are no model of a plan: name `posterior`, `tunnel` or `database`".to_owned())
    } else if is_given {
        None
    } else {
        Some("`model: database` needs the key `database` of match.yaml".to_owned())
    }
}
