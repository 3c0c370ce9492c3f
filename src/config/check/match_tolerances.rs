//! Checks of `match.yaml`: names resolve, tolerances have a width.

use super::names::known_class;
use crate::config::checked::Config;
use crate::config::source::{Files, Source};
use crate::error::Result;
use crate::proof_of_match::{Specification, Test, Tolerance};
use crate::tables::ModelSource;

/// Longest time over which initial state and trim may be matched, s: more would be a fit.
const LONGEST_TRIM_S: f64 = 5.0;

/// Least number of draws: the standard error of a probability of one half is then 11 %.
const LEAST_DRAWS: usize = 20;

/// Largest number of draws: each takes some tens of thousands of multiplications a maneuver.
const MOST_DRAWS: usize = 100_000;

/// Checks the proof of match of a pipeline that has one.
pub(super) fn check(config: &Config, files: &Files) -> Result<()> {
    let (Some(specification), Some(source)) = (&config.proof_of_match, &files.proof_of_match)
    else {
        return Ok(());
    };
    check_numbers(specification, source)?;
    for test in &specification.tests {
        check_classes(test, config, source)?;
        if test.all_of.is_empty() || test.all_of.iter().any(|r| r.one_of.is_empty()) {
            let what = format!("test {} has a list without tolerances", test.test);
            return Err(source.error(&test.test, what));
        }
        let mut tolerances = test
            .all_of
            .iter()
            .flat_map(|requirement| &requirement.one_of);
        if let Some(tolerance) = tolerances.find(|own| !has_width(own)) {
            let name = tolerance.quantity.name();
            let what = format!("`{name}`: give `within` or `within_pct`, greater than zero");
            return Err(source.error(name, what));
        }
    }
    Ok(())
}

fn check_numbers(specification: &Specification, source: &Source) -> Result<()> {
    if specification.models.is_empty() {
        return Err(source.error("models", "`models` names no model"));
    }
    for (i, model) in specification.models.iter().enumerate() {
        if specification.models[..i].contains(model) {
            let what = format!("`models` names `{}` twice", model.name());
            return Err(source.error("models", what));
        }
    }
    let has_model = specification.models.contains(&ModelSource::Database);
    if has_model != specification.database.is_some() {
        let what = "the model `database` needs the key `database` with its file, and the key needs the model";
        return Err(source.error("database", what));
    }
    if !(LEAST_DRAWS..=MOST_DRAWS).contains(&specification.draws) {
        let draws = specification.draws;
        let what = format!("`draws` must lie between {LEAST_DRAWS} and {MOST_DRAWS}, not {draws}");
        return Err(source.error("draws", what));
    }
    if !(specification.trim_s > 0.0 && specification.trim_s <= LONGEST_TRIM_S) {
        let what = format!("`trim_s` must lie between 0 and {LONGEST_TRIM_S}");
        return Err(source.error("trim_s", what));
    }
    if !(specification.inside_pct > 0.0 && specification.inside_pct <= 100.0) {
        return Err(source.error("inside_pct", "`inside_pct` must lie between 0 and 100"));
    }
    Ok(())
}

fn check_classes(test: &Test, config: &Config, source: &Source) -> Result<()> {
    let mut classes = test.classes.iter().flatten();
    classes.try_for_each(|name| known_class(config, source, name))
}

fn has_width(tolerance: &Tolerance) -> bool {
    let widths = [tolerance.within, tolerance.within_pct];
    widths.iter().flatten().all(|width| *width > 0.0) && widths.iter().any(Option::is_some)
}
