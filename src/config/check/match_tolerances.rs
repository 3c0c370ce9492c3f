//! Checks of `match.yaml`: names resolve, tolerances have a width and belong to the test's axis.

use super::names::known_class;
use crate::config::checked::Config;
use crate::config::source::{Files, Source};
use crate::error::{Error, Result};
use crate::maneuver::Class;
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
    if specification.tests.is_empty() {
        return Err(source.error("tests", "`tests` lists no test"));
    }
    let places = Places { source };
    for (place, test) in specification.tests.iter().enumerate() {
        check_classes(test, config, source)?;
        if let Some(what) = ambiguous(&specification.tests[..place], test, config) {
            return Err(places.of_test(place, &test.test, what));
        }
        if test.all_of.is_empty() {
            let what = format!("test {}: `all_of` lists no requirement", test.test);
            return Err(places.of_test(place, "all_of", what));
        }
    }
    check_requirements(specification, &places)
}

/// Checks the tolerances, each with its number among those of the file.
fn check_requirements(specification: &Specification, places: &Places) -> Result<()> {
    let tests = specification.tests.iter();
    let requirements = tests.flat_map(|test| {
        test.all_of
            .iter()
            .map(move |requirement| (test, requirement))
    });
    let mut tolerances = 0;
    for (place, (test, requirement)) in requirements.enumerate() {
        if requirement.one_of.is_empty() {
            let what = format!("test {}: `one_of` lists no tolerance", test.test);
            return Err(places.of_key("one_of", place, what));
        }
        for tolerance in &requirement.one_of {
            if let Some(what) = mistake(test, tolerance) {
                return Err(places.of_key("quantity", tolerances, what));
            }
            tolerances += 1;
        }
    }
    Ok(())
}

/// Mistake in a tolerance of a test; `None` without one.
fn mistake(test: &Test, tolerance: &Tolerance) -> Option<String> {
    let name = tolerance.quantity.name();
    if !has_width(tolerance) {
        return Some(format!(
            "`{name}`: give `within` or `within_pct`, greater than zero"
        ));
    }
    let own = tolerance.quantity.axis();
    (own != test.axis).then(|| {
        let (number, axis) = (&test.test, test.axis.name());
        format!(
            "`{name}` is a {} quantity, but test {number} is of the {axis} axis",
            own.name()
        )
    })
}

/// Message for a test with the number of an earlier one that judges the same class: their rows could
/// not be distinguished.
fn ambiguous(earlier: &[Test], test: &Test, config: &Config) -> Option<String> {
    let judges = |test: &Test, class: &Class| test.judges(class.axis, &class.name);
    let mut same = earlier.iter().filter(|other| other.test == test.test);
    same.find_map(|other| {
        let mut classes = config.classes.iter();
        let class = classes.find(|class| judges(test, class) && judges(other, class))?;
        Some(format!(
            "test {} stands twice for class {}: put its requirements in one list, or give each its own number",
            test.test, class.name
        ))
    })
}

/// Lines of tests, requirements and tolerances.
struct Places<'a> {
    source: &'a Source,
}

impl Places<'_> {
    fn of_test(&self, place: usize, name: &str, what: String) -> Error {
        let entry = ("test", place);
        self.source.error_in_entry(&["tests"], entry, name, what)
    }

    fn of_key(&self, key: &str, place: usize, what: String) -> Error {
        self.source
            .error_in_entry(&["tests"], (key, place), key, what)
    }
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
    let limited = [
        ("trim_s", specification.trim_s, LONGEST_TRIM_S),
        ("inside_pct", specification.inside_pct, 100.0),
    ];
    for (name, value, most) in limited {
        if !(value > 0.0 && value <= most) {
            let what = format!("`{name}` must be above 0 and at most {most}, not {value}");
            return Err(source.error(name, what));
        }
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
