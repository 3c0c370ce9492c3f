//! Checks of `qualities.yaml`: names resolve, limits are ranges, each within that of the next level.

use crate::config::checked::Config;
use crate::config::source::{Files, Source};
use crate::error::{Result, did_you_mean};
use crate::qualities::{FEEDBACK_STATES, LevelLimit, Range, Specification};

/// Least number of draws that give a probability to a per cent or two.
const LEAST_DRAWS: usize = 100;

/// Largest number of draws: each takes the roots of two matrices at each angle of attack.
const MOST_DRAWS: usize = 1_000_000;

/// Checks the specification of a pipeline that has one.
pub(super) fn check(config: &Config, files: &Files) -> Result<()> {
    let (Some(specification), Some(source)) = (&config.qualities, &files.qualities) else {
        return Ok(());
    };
    let known = config.buildup.derivatives.iter();
    let known: Vec<&str> = known.filter_map(|d| d.regressor.surface()).collect();
    for surface in surfaces(specification) {
        check_name(source, surface, &known, "surface of the model")?;
    }
    for state in specification
        .feedback
        .values()
        .flat_map(|gains| gains.keys())
    {
        check_name(
            source,
            state,
            &FEEDBACK_STATES,
            "state that feedback may use",
        )?;
    }
    if specification.pitch_control.is_empty() {
        let what = "`pitch_control` names no surface; n/α and 1/T_θ2 need one";
        return Err(source.error("pitch_control", what));
    }
    if !(LEAST_DRAWS..=MOST_DRAWS).contains(&specification.draws) {
        let draws = specification.draws;
        let what = format!("`draws` must lie between {LEAST_DRAWS} and {MOST_DRAWS}, not {draws}");
        return Err(source.error("draws", what));
    }
    let mut limits = specification.requirements.iter().flat_map(|r| &r.limits);
    limits.try_for_each(|limit| match mistake(limit) {
        None => Ok(()),
        Some(what) => {
            let name = limit.quantity.name();
            Err(source.error(name, format!("a limit of `{name}`: {what}")))
        }
    })
}

/// Describes the first level that allows nothing, or less than a better level.
fn mistake(limit: &LevelLimit) -> Option<String> {
    let levels = [(1, limit.level_1), (2, limit.level_2), (3, limit.level_3)];
    let mut pairs = levels.array_windows();
    let empty = levels
        .iter()
        .find_map(|(level, range)| empty(*level, range));
    empty.or_else(|| pairs.find_map(|[better, worse]| narrower(better, worse)))
}

/// Message for a level that allows nothing.
fn empty(level: usize, range: &Range) -> Option<String> {
    let (min, max) = range.min.zip(range.max)?;
    (min > max).then(|| format!("the `min` {min} of level {level} is above its `max` {max}"))
}

/// Message for a level that allows less than the next better one.
fn narrower((better, own): &(usize, Range), (worse, next): &(usize, Range)) -> Option<String> {
    let less = |limit: &str, own: f64, next: f64| {
        format!(
            "level {worse} allows less than level {better}: its `{limit}` is {next}, that of level {better} {own}"
        )
    };
    match (own.min.zip(next.min), own.max.zip(next.max)) {
        (Some((own, next)), _) if next > own => Some(less("min", own, next)),
        (_, Some((own, next))) if next < own => Some(less("max", own, next)),
        _ => None,
    }
}

fn surfaces(specification: &Specification) -> impl Iterator<Item = &String> {
    let pitch = specification.pitch_control.keys();
    pitch.chain(specification.feedback.keys())
}

fn check_name(source: &Source, name: &str, known: &[&str], kind: &str) -> Result<()> {
    if known.contains(&name) {
        return Ok(());
    }
    let near = did_you_mean(name, known.iter().copied());
    Err(source.error(name, format!("`{name}` is no {kind}{near}")))
}
