//! Clock of a recording: the column that counts time, and its unit.

use super::names::vocabulary::{EXACT, meanings};
use super::names::words::Spelling;
use super::recording::{Column, Recording, column_names};
use crate::flight::signal;
use crate::numerics::statistics::mean::finite_mean;
use crate::numerics::statistics::order_statistics::{median, quantile};
use crate::units::{Quantity, Unit};

/// Least share of steps that go forwards in a column that counts time.
const FORWARDS: f64 = 0.99;
/// Share of its mean by which the median step of a clock differs at most.
const UNEVEN: f64 = 0.5;
/// Fraction of the steps that the mean leaves out: the longest ones. A recorder may be off between
/// test points, and each test point has hundreds of rows.
const OFF: f64 = 0.01;
/// Steps between samples that recorders have, s: 1 kHz to 2 Hz.
const STEPS_S: (f64, f64) = (0.000_9, 0.55);

/// The column that counts time.
#[derive(Clone, Debug, PartialEq)]
pub struct ClockColumn {
    pub name: String,
    pub unit: Unit,
    /// Median step between rows, s.
    pub step_s: f64,
    /// `true` if name and unit leave no doubt.
    pub is_sure: bool,
    pub evidence: String,
}

/// Finds the column that counts time.
#[must_use]
pub fn find_clock(recordings: &[Recording]) -> Option<ClockColumn> {
    let names = column_names(recordings);
    let candidates = names.into_iter().filter_map(|name| clock(recordings, name));
    candidates
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, clock)| clock)
}

/// Column whose name is exactly that of time, and which does not rise evenly: its name with the reason in words. `None`
/// if another column is a clock by its name.
#[must_use]
pub fn uneven_clock(recordings: &[Recording]) -> Option<String> {
    let means_time = |name: &&str| {
        let meanings = meanings(&Spelling::of(name));
        // A name that only contains the word may be another time, such as that of an engine.
        meanings.contains(&(signal::TIME, EXACT))
    };
    let names = column_names(recordings).into_iter().filter(means_time);
    let names: Vec<&str> = names.collect();
    if names.iter().any(|name| clock(recordings, name).is_some()) {
        return None;
    }
    names.first().map(|name| {
        let columns = recordings.iter().filter_map(|r| Some((r, r.column(name)?)));
        if let Some(reason) = columns.clone().find_map(|(r, column)| coarse_clock(r, column)) {
            return reason;
        }
        let backwards = |(recording, column): (&Recording, &Column)| {
            let steps = column.values.windows(2).map(|pair| pair[1] - pair[0]);
            let is_back = |step: &f64| step.is_nan() || *step <= 0.0;
            let rows = steps.clone().filter(is_back).count();
            let first = steps.clone().position(|step| is_back(&step))?;
            Some((recording.name.clone(), rows, steps.count(), first + 2))
        };
        let most = columns.filter_map(backwards).max_by_key(|found| found.1);
        match most {
            Some((file, rows, all, first)) => format!(
                "`{name}` does not count time in {file}: it does not rise in {rows} of {all} steps, first in row {first}"
            ),
            None => format!("`{name}` does not count time: its steps are uneven"),
        }
    })
}

/// Message for a column of times that never go backwards and often repeat: they are written with too few digits.
fn coarse_clock(recording: &Recording, column: &Column) -> Option<String> {
    let values = &column.values;
    let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
    let repeated = steps().filter(|step| *step == 0.0).count();
    let is_coarse =
        steps().all(|step| step >= 0.0) && repeated as f64 > (1.0 - FORWARDS) * values.len() as f64;
    let mean_step = (values.last()? - values.first()?) / (values.len() - 1) as f64;
    (is_coarse && mean_step > 0.0).then(|| {
        format!(
            "`{name}` has too few digits in {file}: {repeated} of {all} rows repeat the time before. Export it with more \
             digits, or import the text with `--step`, which counts the time from row to row in place of a column `time`: \
             {mean_step:.4} in its unit",
            name = column.name,
            file = recording.name,
            all = values.len()
        )
    })
}

/// A column as a clock, with the weight of its name; `None` for a column that is no clock.
fn clock(recordings: &[Recording], name: &str) -> Option<(f64, ClockColumn)> {
    let columns = recordings.iter().filter_map(|r| r.column(name));
    let mut steps = Vec::new();
    let mut stated = None;
    for column in columns {
        steps.extend(column.values.windows(2).map(|pair| pair[1] - pair[0]));
        stated = stated.or_else(|| Unit::parse(column.stated.as_deref()?).ok());
    }
    steps.retain(|step| step.is_finite());
    let step = median(steps.iter().copied())?;
    let is_even = is_even(&steps, step);
    let spelling = Spelling::of(name);
    let meaning = meanings(&spelling)
        .into_iter()
        .find(|m| m.0 == signal::TIME);
    let stated = stated.or(spelling.unit);
    if !is_even || stated.is_some_and(|unit| unit.quantity != Quantity::Time) {
        return None;
    }
    let (unit, by) = match stated {
        Some(unit) => (unit, "the unit is stated"),
        None => (of_step(step)?, "the unit follows from the step alone"),
    };
    let step_s = step * unit.factor_to(Unit::of_signal(signal::TIME))?;
    let is_usual = (STEPS_S.0..=STEPS_S.1).contains(&step_s);
    let weight = meaning.map_or(0.0, |m| m.1) + if stated.is_some() { 0.5 } else { 0.0 };
    let evidence = format!("rises evenly by {step_s:.4} s from row to row; {by}");
    let is_sure = is_usual && (meaning.is_some() || stated.is_some());
    let name = name.to_owned();
    Some((
        weight + f64::from(u8::from(is_usual)),
        ClockColumn {
            name,
            unit,
            step_s,
            is_sure,
            evidence,
        },
    ))
}

/// `true` if nearly all steps go forwards, and their mean is near the median.
fn is_even(steps: &[f64], median: f64) -> bool {
    let forwards = || steps.iter().copied().filter(|step| *step > 0.0);
    let longest = quantile(forwards(), 1.0 - OFF);
    let mean = longest.and_then(|longest| finite_mean(forwards().filter(|step| *step <= longest)));
    forwards().count() as f64 >= FORWARDS * steps.len() as f64
        && mean.is_some_and(|mean| (median / mean - 1.0).abs() < UNEVEN)
}

/// Unit in which a step is that of a recorder.
fn of_step(step: f64) -> Option<Unit> {
    let units = ["s", "ms", "us", "ns"].into_iter();
    let mut units = units.filter_map(|name| Unit::parse(name).ok());
    units.find(|unit| {
        let step_s = unit
            .factor_to(Unit::of_signal(signal::TIME))
            .map(|f| f * step);
        step_s.is_some_and(|s| (STEPS_S.0..=STEPS_S.1).contains(&s))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Step of the clock that is found in rows of 40 Hz with a gap after every 800 rows, s.
    fn step_s(gap_s: f64) -> Option<f64> {
        let time = |k: usize| 0.025 * k as f64 + gap_s * (k / 800) as f64;
        let column = Column {
            name: "t".to_owned(),
            stated: None,
            values: (0..8_000).map(time).collect(),
        };
        let recording = Recording {
            name: "f".to_owned(),
            columns: vec![column],
        };
        find_clock(&[recording]).map(|clock| clock.step_s)
    }

    #[test]
    fn a_recorder_that_is_off_between_test_points_has_a_clock() {
        for gap_s in [0.0, 100.0, 10_000.0] {
            let found = step_s(gap_s).unwrap();
            assert!((found - 0.025).abs() < 1e-9, "{gap_s} s: {found}");
        }
    }

    #[test]
    fn a_column_named_time_that_goes_backwards_is_named_with_its_row() {
        let back = |k: i32| f64::from(if k < 250 { k } else { 500 - k });
        let column = |name: &str, value: &dyn Fn(i32) -> f64| Column {
            name: name.to_owned(),
            stated: None,
            values: (0..500).map(|k| 0.02 * value(k)).collect(),
        };
        let mut recording = Recording {
            name: "f".to_owned(),
            columns: vec![column("time", &back), column("q", &f64::from)],
        };
        let reason = uneven_clock(std::slice::from_ref(&recording)).unwrap();
        assert!(
            reason.contains("in f: it does not rise in 249 of 499 steps, first in row 252"),
            "{reason}"
        );
        recording.columns.push(column("clock", &f64::from));
        assert_eq!(uneven_clock(&[recording]), None);
    }

    #[test]
    fn a_clock_with_too_few_digits_is_named_with_what_to_do() {
        let column = Column {
            name: "time".to_owned(),
            stated: None,
            values: (0..1000).map(|k| f64::from(k / 4) * 0.1).collect(),
        };
        let recording = Recording {
            name: "f".to_owned(),
            columns: vec![column],
        };
        let reason = uneven_clock(&[recording]).unwrap();
        let words = ["750 of 1000 rows", "`--step`", "0.0249 in its unit"];
        assert!(words.iter().all(|w| reason.contains(w)), "{reason}");
    }

    #[test]
    fn a_column_that_rises_unevenly_is_no_clock() {
        let values: Vec<f64> = (0..1000).map(|k| f64::from(k * k * k)).collect();
        let recording = Recording {
            name: "f".to_owned(),
            columns: vec![Column {
                name: "t".to_owned(),
                stated: None,
                values,
            }],
        };
        assert_eq!(find_clock(&[recording]), None);
    }
}
