//! Allowed ranges of the numbers in a configuration. A number is checked as it is written: it must
//! be finite and of a size that a campaign can have.

use serde_yaml::Value;

use crate::config::source::Source;
use crate::error::Result;

/// Least and largest value of a number.
type Range = (f64, f64);

/// Ranges by the last name of a key. Sizes that set the amount of work have the narrowest.
const BY_NAME: [(&str, Range); 27] = [
    ("memory_mb", (1.0, 1e9)),
    ("sampling_rate_hz", (0.01, 1e6)),
    ("longest_stretch_h", (0.01, 1000.0)),
    ("block_s", (1e-3, 3600.0)),
    ("window_s", (1e-3, 3600.0)),
    ("windows", (0.0, 1000.0)),
    ("slope_factor", (1.0, 1000.0)),
    ("agreement", (0.0, 1.0)),
    ("most_repeats", (0.0, 1.0)),
    ("least_correlation", (0.0, 1.0)),
    ("least_attitude_correlation", (0.0, 1.0)),
    ("shared_lead_in", (0.0, 1.0)),
    ("max_iterations", (1.0, 10_000.0)),
    ("tolerance", (1e-15, 1.0)),
    ("max_condition_number", (1.0, 1e30)),
    ("max_order", (0.0, 30.0)),
    ("alpha_step_deg", (0.1, 90.0)),
    ("alpha_bin_deg", (1e-3, 180.0)),
    ("alpha_distance_deg", (1e-3, 180.0)),
    ("length_deg", (0.1, 180.0)),
    ("degrees_of_freedom", (1.0, 1e12)),
    ("least_delay_s", (0.0, 10.0)),
    ("r_squared", (-1e12, 1.0)),
    ("contradiction", (0.0, 1.0)),
    ("shards", (1.0, 1e6)),
    ("processors", (1.0, 1e6)),
    ("keep_nights", (1.0, 1e6)),
];

/// Ranges by the end of a key's last name: shares, durations, angles.
const BY_ENDING: [(&str, Range); 3] = [
    ("_share", (0.0, 1.0)),
    ("_s", (0.0, 86_400.0)),
    ("_deg", (0.0, 360.0)),
];

/// Angles and variables of either sign.
const SIGNED: [&str; 6] = [
    "histories_at_alpha_deg",
    "knots_deg",
    "centres_deg",
    "lower_deg",
    "upper_deg",
    "at",
];

/// Smallest step of a signal that segment may search for: zero would make a step of each sample.
const STEPS: Range = (1e-6, 1e9);

/// Ranges of a class's numbers by the last name of a key: inputs of a maneuver, which lasts a day at
/// most.
const OF_CLASS: [(&str, Range); 9] = [
    ("lead_in_s", (0.0, 86_400.0)),
    ("decay_s", (0.0, 86_400.0)),
    ("unit_s", (0.0, 86_400.0)),
    ("at_least", (0.0, 1e6)),
    ("at_most", (0.0, 1e6)),
    ("widths", (1e-3, 1e3)),
    ("tolerance", (0.0, 1e3)),
    ("ratio", (0.0, 1e3)),
    ("above_alpha_deg", (-180.0, 180.0)),
];

/// Ranges of the numbers of test cards, by the last name of a key. They are the numbers that set
/// the amount of work, and the conditions of a card. The standard atmosphere ends at 105,000 ft.
const OF_CARDS: [(&str, Range); 14] = [
    ("seed", (0.0, 1.9e19)),
    ("rate_hz", (0.01, 1e4)),
    ("control_hz", (0.01, 1e5)),
    ("parts", (1.0, 1000.0)),
    ("duration_s", (0.0, 3600.0)),
    ("gradient_ft", (1.0, 1e5)),
    ("per_s", (0.0, 100.0)),
    ("realisations", (1.0, 1e6)),
    ("settle_s", (0.0, 3600.0)),
    ("change_s_per_deg", (0.0, 3600.0)),
    ("repeats", (1.0, 100.0)),
    ("altitude_ft", (-2000.0, 100_000.0)),
    ("mass_slug", (1e-3, 1e6)),
    ("alpha_deg", (-180.0, 180.0)),
];

/// Range of other sizes.
const SIZE: Range = (0.0, 1e12);

/// Checks that the numbers of a file are finite.
pub(super) fn are_finite(source: &Source) -> Result<()> {
    check(source, &|_| (f64::MIN, f64::MAX))
}

/// Checks that the numbers of `pipeline.yaml` are in their ranges.
pub(super) fn of_pipeline(source: &Source) -> Result<()> {
    check(source, &range)
}

/// Checks that the numbers of a class are in their ranges.
pub(super) fn of_class(source: &Source) -> Result<()> {
    check(source, &range_of_class)
}

/// Checks that the numbers of test cards are in their ranges.
///
/// # Errors
/// [`crate::error::Error`] with file and line of the first number outside its range.
pub(crate) fn of_cards(source: &Source) -> Result<()> {
    check(source, &|path| {
        range_by_name(&OF_CARDS, path, (-SIZE.1, SIZE.1))
    })
}

/// Range of the number at a path of keys of a class.
fn range_of_class(path: &[String]) -> Range {
    range_by_name(&OF_CLASS, path, SIZE)
}

/// Range of a number by the last name of its key, or another one.
fn range_by_name(ranges: &[(&str, Range)], path: &[String], otherwise: Range) -> Range {
    let name = path.last().map_or("", String::as_str);
    let known = ranges.iter().find(|(known, _)| *known == name);
    known.map_or(otherwise, |(_, range)| *range)
}

/// Range of the number at a path of keys of `pipeline.yaml`.
fn range(path: &[String]) -> Range {
    let name = path.last().map_or("", String::as_str);
    if path.first().is_some_and(|stage| stage == "segment") && path.iter().any(|key| key == "steps")
    {
        return STEPS;
    }
    if SIGNED.contains(&name) {
        return (f64::MIN, f64::MAX);
    }
    let by_ending = BY_ENDING.iter().find(|(ending, _)| name.ends_with(ending));
    range_by_name(&BY_NAME, path, by_ending.map_or(SIZE, |(_, range)| *range))
}

fn check(source: &Source, range: &dyn Fn(&[String]) -> Range) -> Result<()> {
    let written: Value = source.parse()?;
    match first_outside(&written, &mut Vec::new(), range) {
        None => Ok(()),
        Some((path, number, range)) => {
            let name = path.last().map_or("", String::as_str);
            Err(source.error_at(&path, message(name, number, range)))
        }
    }
}

fn message(name: &str, number: f64, (least, most): Range) -> String {
    if !number.is_finite() {
        return format!("`{name}` must be a finite number, not {number}");
    }
    format!("`{name}` must lie between {least} and {most}, not {number}")
}

/// The first number outside its range, with the names of its keys.
fn first_outside(
    value: &Value,
    path: &mut Vec<String>,
    range: &dyn Fn(&[String]) -> Range,
) -> Option<(Vec<String>, f64, Range)> {
    if let Some(number) = value.as_f64() {
        let (least, most) = range(path);
        let is_inside = number.is_finite() && (least..=most).contains(&number);
        return (!is_inside).then(|| (path.clone(), number, (least, most)));
    }
    if let Some(list) = value.as_sequence() {
        return list
            .iter()
            .find_map(|value| first_outside(value, path, range));
    }
    value.as_mapping()?.iter().find_map(|(key, below)| {
        path.push(key.as_str().unwrap_or_default().to_owned());
        let found = first_outside(below, path, range);
        path.pop();
        found
    })
}
