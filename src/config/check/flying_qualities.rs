//! Checks of `qualities.yaml`: names resolve, controls and feedback have an effect, limits are ranges,
//! each within that of the next level.

use super::names::known_name;
use crate::aero::{AeroModel, Axis, Coefficient, Derivative};
use crate::config::checked::Config;
use crate::config::source::{Files, Source};
use crate::error::Result;
use crate::qualities::{
    FEEDBACK_STATES, LevelLimit, Range, Requirement, Specification, feedback_axis,
};

/// Least number of draws that give a probability to a per cent or two.
const LEAST_DRAWS: usize = 100;

/// Largest number of draws: each takes the roots of two matrices at each angle of attack.
const MOST_DRAWS: usize = 1_000_000;

/// Largest gearing and gain, deg of a surface per deg or per deg/s: no surface follows so far.
const LARGEST_GAIN: f64 = 100.0;

/// Checks the specification of a pipeline that has one.
pub(super) fn check(config: &Config, files: &Files) -> Result<()> {
    let (Some(specification), Some(source)) = (&config.qualities, &files.qualities) else {
        return Ok(());
    };
    let surfaces = config.aero_model.derivatives.iter();
    let surfaces: Vec<&str> = surfaces.filter_map(|d| d.regressor.surface()).collect();
    let named = specification.pitch_control.keys();
    for surface in named.chain(specification.feedback.keys()) {
        known_name(source, surface, &surfaces, "surface of the model")?;
    }
    pitch_control(specification, &config.aero_model, source)?;
    feedback(specification, &config.aero_model, source)?;
    if !(LEAST_DRAWS..=MOST_DRAWS).contains(&specification.draws) {
        let draws = specification.draws;
        let what = format!("`draws` must lie between {LEAST_DRAWS} and {MOST_DRAWS}, not {draws}");
        return Err(source.error("draws", what));
    }
    requirements(specification, source)?;
    limits(specification, source)
}

/// Derivatives of an axis that are of a surface.
fn moved<'a>(
    aero_model: &'a AeroModel,
    axis: Axis,
    surface: &'a str,
) -> impl Iterator<Item = &'a Derivative> {
    let derivatives = aero_model.derivatives_of(axis);
    derivatives.filter(move |d| d.regressor.signals().any(|name| name == surface))
}

/// Checks that the pitch control moves the aircraft in pitch.
fn pitch_control(
    specification: &Specification,
    aero_model: &AeroModel,
    source: &Source,
) -> Result<()> {
    let error = |name: &str, what: String| Err(source.error_under("pitch_control", name, what));
    if specification.pitch_control.is_empty() {
        let what = "`pitch_control` names no surface; n/α and 1/T_θ2 need one";
        return error("pitch_control", what.to_owned());
    }
    for (surface, gearing) in &specification.pitch_control {
        if moved(aero_model, Axis::Longitudinal, surface)
            .next()
            .is_none()
        {
            let what = format!("`pitch_control`: `{surface}` has no longitudinal derivative");
            return error(surface, what);
        }
        if let Some(what) = too_large(surface, *gearing) {
            return error(surface, what);
        }
    }
    let pitches = |(surface, gearing): (&String, &f64)| {
        let mut moved = moved(aero_model, Axis::Longitudinal, surface);
        *gearing != 0.0 && moved.any(|d| d.coefficient == Coefficient::Cm)
    };
    if specification.pitch_control.iter().any(pitches) {
        return Ok(());
    }
    let what = "`pitch_control` moves no pitching moment: its gearings are zero, or its surfaces have no derivative of \
                Cm; n/α and 1/T_θ2 need one";
    error("pitch_control", what.to_owned())
}

/// Checks that each gain of the feedback has an effect in the equations of its state.
fn feedback(specification: &Specification, aero_model: &AeroModel, source: &Source) -> Result<()> {
    for (surface, gains) in &specification.feedback {
        for (state, gain) in gains {
            let error = |what: String| Err(source.error_under("feedback", state, what));
            let kind = "state that feedback may use";
            known_name(source, state, &FEEDBACK_STATES, kind)?;
            let axis = feedback_axis(state);
            if moved(aero_model, axis, surface).next().is_none() {
                return error(format!(
                    "feedback of `{state}` to `{surface}` has no effect: `{surface}` has no {} derivative",
                    axis.name()
                ));
            }
            if let Some(what) = too_large(state, *gain) {
                return error(what);
            }
        }
    }
    Ok(())
}

fn too_large(name: &str, gain: f64) -> Option<String> {
    let is_allowed = gain.abs() <= LARGEST_GAIN;
    (!is_allowed).then(|| {
        format!("`{name}` must lie between -{LARGEST_GAIN} and {LARGEST_GAIN}, not {gain}")
    })
}

/// Checks that there are paragraphs, each once and with limits.
fn requirements(specification: &Specification, source: &Source) -> Result<()> {
    let all = &specification.requirements;
    if all.is_empty() {
        return Err(source.error("requirements", "`requirements` lists no paragraph"));
    }
    for (place, own) in all.iter().enumerate() {
        let error = |name: &str, what: String| {
            let entry = ("paragraph", place);
            Err(source.error_in_entry(&["requirements"], entry, name, what))
        };
        let paragraph = &own.paragraph;
        if all[..place]
            .iter()
            .any(|other| other.paragraph == *paragraph)
        {
            let what = format!("paragraph {paragraph} stands twice: put its limits in one list");
            return error("paragraph", what);
        }
        if own.limits.is_empty() {
            return error(
                "limits",
                format!("paragraph {paragraph}: `limits` lists no limit"),
            );
        }
    }
    Ok(())
}

/// Checks each limit.
fn limits(specification: &Specification, source: &Source) -> Result<()> {
    let mut place = 0;
    for requirement in &specification.requirements {
        for (i, limit) in requirement.limits.iter().enumerate() {
            let found = mistake(limit)
                .or_else(|| unrelated(limit).map(|what| ("raised", what)))
                .or_else(|| repeated(requirement, i).map(|what| ("quantity", what)));
            if let Some((name, what)) = found {
                let what = format!("a limit of `{}`: {what}", limit.quantity.name());
                let entry = ("quantity", place);
                return Err(source.error_in_entry(&["requirements"], entry, name, what));
            }
            place += 1;
        }
    }
    Ok(())
}

/// Key and description of the first mistake: a limit that never applies, a level that allows nothing,
/// or less than a better level.
fn mistake(limit: &LevelLimit) -> Option<(&'static str, String)> {
    let never = |name: &'static str| (name, format!("`{name}` is empty, so it never applies"));
    if limit.categories.as_ref().is_some_and(Vec::is_empty) {
        return Some(never("categories"));
    }
    if limit.classes.as_ref().is_some_and(Vec::is_empty) {
        return Some(never("classes"));
    }
    let levels = [(1, limit.level_1), (2, limit.level_2), (3, limit.level_3)];
    let mut pairs = levels.array_windows();
    let empty = levels
        .iter()
        .find_map(|(level, range)| empty(*level, range));
    let found = empty.or_else(|| pairs.find_map(|[better, worse]| narrower(better, worse)));
    found.map(|what| ("quantity", what))
}

/// Message for a rise with a quantity that does not move with the limited one, or for a fall.
fn unrelated(limit: &LevelLimit) -> Option<String> {
    let raised = limit.raised?;
    let by = raised.by.name();
    if raised.by == limit.quantity {
        return Some(format!("`raised` is by `{by}` itself"));
    }
    if raised.by.axis() != limit.quantity.axis() {
        let axis = raised.by.axis().name();
        return Some(format!(
            "`raised` is by `{by}`, a quantity of the {axis} axis"
        ));
    }
    let mut slopes = [raised.level_1, raised.level_2, raised.level_3].into_iter();
    let negative = slopes.find(|slope| *slope < 0.0)?;
    Some(format!("`raised` must not be negative, not {negative}"))
}

/// Message for a limit that an earlier one of the paragraph repeats, for the same categories and classes.
fn repeated(requirement: &Requirement, place: usize) -> Option<String> {
    let own = &requirement.limits[place];
    let mut earlier = requirement.limits[..place].iter();
    let is_same = |other: &LevelLimit| {
        other.quantity == own.quantity
            && other.categories == own.categories
            && other.classes == own.classes
    };
    earlier.any(is_same).then(|| {
        format!(
            "it stands twice in paragraph {} for the same categories and classes",
            requirement.paragraph
        )
    })
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
