//! Surfaces of the left and the right side that are mirror images: their half difference is one input.

use super::vocabulary::{Input, SIDES, input};
use super::words::{Spelling, words};
use crate::inspection::recording::{Column, Recording, column_names};
use crate::output_error::identifiability;

/// Largest correlation of mirror images. Ailerons that move twice as far up as down have −0.95; elevons
/// whose pitch command is a quarter of the roll command have −0.88.
const MIRRORED: f64 = -0.93;

/// Least number of rows in which both columns have a value: a few seconds of a usual recorder.
const FEWEST_ROWS: usize = 200;

/// Two columns with names of opposite sides and mirrored values.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorImages {
    /// Name of the half difference: that of the columns without their side.
    pub name: String,
    pub left: String,
    pub right: String,
    /// Correlation of the two columns.
    pub correlation: f64,
}

impl MirrorImages {
    /// Pairs of surfaces among the columns of recordings.
    #[must_use]
    pub fn of(recordings: &[Recording]) -> Vec<MirrorImages> {
        let names = column_names(recordings);
        let mut found: Vec<MirrorImages> = Vec::new();
        for left in &names {
            for right in &names {
                let Some(name) = common_name(left, right) else {
                    continue;
                };
                let is_taken =
                    names.contains(&name.as_str()) || found.iter().any(|m| m.name == name);
                let correlation = correlation_in(recordings, left, right);
                if let Some(correlation) = correlation.filter(|c| *c <= MIRRORED && !is_taken) {
                    found.push(MirrorImages {
                        name,
                        left: (*left).to_owned(),
                        right: (*right).to_owned(),
                        correlation,
                    });
                }
            }
        }
        found
    }

    /// Recordings with the half difference in place of the two columns.
    #[must_use]
    pub fn replaced(&self, recordings: &[Recording]) -> Vec<Recording> {
        recordings.iter().map(|r| self.replaced_in(r)).collect()
    }

    fn replaced_in(&self, recording: &Recording) -> Recording {
        let mut columns = recording.columns.clone();
        columns.retain(|column| column.name != self.left && column.name != self.right);
        let pair = recording
            .column(&self.left)
            .zip(recording.column(&self.right));
        columns.extend(pair.map(|(left, right)| {
            Column {
                name: self.name.clone(),
                stated: left.stated.clone(),
                values: left
                    .values
                    .iter()
                    .zip(&right.values)
                    .map(|(l, r)| 0.5 * (l - r))
                    .collect(),
            }
        }));
        Recording {
            name: recording.name.clone(),
            columns,
        }
    }

    /// Formula of the half difference, or of its negative.
    #[must_use]
    pub fn formula(&self, sign: f64) -> String {
        let [left, right] = [&self.left, &self.right].map(|name| operand(name));
        if sign < 0.0 {
            format!("0.5 * ({right} - {left})")
        } else {
            format!("0.5 * ({left} - {right})")
        }
    }

    /// Reason for the proposal, in words.
    #[must_use]
    pub fn evidence(&self) -> String {
        format!(
            "a proposal: {} and {} are mirror images (correlation {:.3}), so their half difference is one input",
            self.left, self.right, self.correlation
        )
    }
}

/// Name of a column as a formula has it.
fn operand(name: &str) -> String {
    let is_plain = name
        .chars()
        .all(|c| c.is_alphanumeric() || c == '_' || c == '.');
    if is_plain && name.starts_with(char::is_alphabetic) {
        name.to_owned()
    } else {
        format!("`{name}`")
    }
}

/// Name of a surface without its side, for the names of its left and its right half.
fn common_name(left: &str, right: &str) -> Option<String> {
    let spellings = [Spelling::of(left), Spelling::of(right)];
    let [l, r] = [&spellings[0].words, &spellings[1].words];
    let has_quotes = [left, right].iter().any(|name| name.contains('`'));
    if let ([l], [r]) = (&l[..], &r[..]) {
        return attached_sides(l, r).filter(|_| !has_quotes);
    }
    let mut differing = l.iter().zip(r).enumerate().filter(|(_, (l, r))| l != r);
    let (at, (of_left, of_right)) = differing.next()?;
    let is_pair = SIDES
        .iter()
        .any(|(left, right)| of_left == left && of_right == right);
    let is_surface = input(&spellings[0]).is_some_and(Input::is_surface);
    let is_one = l.len() == r.len() && l.len() > 1 && differing.next().is_none();
    if !(is_pair && is_surface && is_one) || has_quotes {
        return None;
    }
    let mut common = words(left);
    // The words of the whole name begin with those before the unit.
    common.remove(at);
    Some(common.join("_"))
}

/// Name of a surface whose halves have the letter of their side at the end of a word: `da` of `dal` and `dar`.
fn attached_sides(left: &str, right: &str) -> Option<String> {
    let name = left.strip_suffix('l')?;
    let is_pair = right.strip_suffix('r') == Some(name);
    let is_surface = input(&Spelling::of(name)).is_some_and(Input::is_surface);
    (is_pair && is_surface).then(|| name.to_owned())
}

/// Correlation of two columns where both have values; `None` where one of them rests.
fn correlation_in(recordings: &[Recording], a: &str, b: &str) -> Option<f64> {
    let pairs = recordings
        .iter()
        .filter_map(|r| r.column(a).zip(r.column(b)));
    let pairs = pairs.flat_map(|(a, b)| a.values.iter().zip(&b.values));
    let pairs: Vec<(f64, f64)> = pairs
        .map(|(a, b)| (*a, *b))
        .filter(|(a, b)| a.is_finite() && b.is_finite())
        .collect();
    if pairs.len() < FEWEST_ROWS {
        return None;
    }
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
    identifiability::correlation(&a, &b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a column over time.
    type Motion = fn(f64) -> f64;

    fn recording(columns: &[(&str, Motion)]) -> Recording {
        let column = |(name, value): &(&str, Motion)| Column {
            name: (*name).to_owned(),
            stated: Some("rad".to_owned()),
            values: (0..1000).map(|k| value(0.1 * f64::from(k))).collect(),
        };
        Recording {
            name: "flight".to_owned(),
            columns: columns.iter().map(column).collect(),
        }
    }

    #[test]
    fn mirror_images_by_name_and_by_data_have_a_half_difference() {
        let flight = recording(&[
            ("AILERON_R", |t| 0.02 - 0.1 * t.sin()),
            ("AILERON_L", |t| 0.1 * t.sin()),
            ("q", f64::sin),
        ]);
        let found = MirrorImages::of(std::slice::from_ref(&flight));
        let [pair] = &found[..] else {
            panic!("{found:?}")
        };
        assert_eq!(
            (pair.name.as_str(), pair.left.as_str()),
            ("aileron", "AILERON_L")
        );
        assert_eq!(pair.formula(1.0), "0.5 * (AILERON_L - AILERON_R)");
        assert_eq!(pair.formula(-1.0), "0.5 * (AILERON_R - AILERON_L)");
        let replaced = &pair.replaced(&[flight])[0];
        let names: Vec<&str> = replaced.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["q", "aileron"]);
        let value = replaced.columns[1].values[10];
        assert!(
            (value - (0.1 * 1.0_f64.sin() - 0.01)).abs() < 1e-12,
            "{value}"
        );
    }

    #[test]
    fn sides_may_be_the_last_letter_of_a_word() {
        let flight = |left, right| recording(&[(left, f64::sin), (right, |t| -t.sin())]);
        let name = |left, right| {
            let found = MirrorImages::of(&[flight(left, right)]);
            found.first().map(|pair| pair.name.clone())
        };
        assert_eq!(name("DAL", "DAR").as_deref(), Some("da"));
        assert_eq!(name("fuel", "fuer"), None);
    }

    #[test]
    fn columns_that_are_no_mirror_images_stay() {
        let left: Motion = f64::sin;
        let mirrored: Motion = |t| -t.sin();
        for columns in [
            // Together, as stabilators in pitch, and independent of each other.
            [("aileron_left", left), ("aileron_right", left)],
            [("aileron_left", left), ("aileron_right", f64::cos)],
            [("aileron_left", left), ("aileron_right", |_| 0.0)],
            // Names of no sides, and of no surface.
            [("aileron_a", left), ("aileron_b", mirrored)],
            [("fuel_left", left), ("fuel_right", mirrored)],
        ] {
            let found = MirrorImages::of(&[recording(&columns)]);
            assert!(found.is_empty(), "{found:?}");
        }
        let with_total = [
            ("aileron_left", left),
            ("aileron_right", mirrored),
            ("aileron", left),
        ];
        assert!(MirrorImages::of(&[recording(&with_total)]).is_empty());
    }

    #[test]
    fn a_name_that_a_formula_cannot_have_stands_in_backticks() {
        let flight = recording(&[
            ("Aileron Left [rad]", f64::sin),
            ("Aileron Right [rad]", |t| -t.sin()),
        ]);
        let found = MirrorImages::of(&[flight]);
        assert_eq!(
            found[0].formula(1.0),
            "0.5 * (`Aileron Left [rad]` - `Aileron Right [rad]`)"
        );
        assert!(found[0].name.starts_with("aileron"), "{found:?}");
    }
}
