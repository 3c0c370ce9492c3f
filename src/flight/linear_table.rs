//! Table of a channel: values over one variable, such as inertias over the mass of fuel.

use serde::Serialize;

/// Values at increasing places, linear between them and held beyond the ends.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LinearTable {
    at: Vec<f64>,
    value: Vec<f64>,
}

/// Relative difference below which two values are equal: rounding of conversions and means.
const SAME_VALUE: f64 = 1e-9;

/// Mistake of a table: the list that has it, `at` or `value`, and the reason in words.
pub type Mistake = (&'static str, String);

impl LinearTable {
    /// Table of values at places.
    ///
    /// # Errors
    /// The list with a mistake: fewer than two places, places that do not increase, lists of different
    /// lengths, or an entry that is not finite.
    pub fn new(at: Vec<f64>, value: Vec<f64>) -> Result<LinearTable, Mistake> {
        for (name, list) in [("at", &at), ("value", &value)] {
            if let Some(entry) = list.iter().find(|entry| !entry.is_finite()) {
                return Err((
                    name,
                    format!("`{name}` has finite numbers only, not {entry}"),
                ));
            }
        }
        if at.len() < 2 {
            return Err((
                "at",
                "`at` needs two numbers or more; one value throughout stands under `constants`"
                    .to_owned(),
            ));
        }
        if let Some([before, after]) = at.array_windows().find(|[before, after]| after <= before) {
            let what = format!("`at` must increase: {after} comes after {before}");
            return Err(("at", what));
        }
        if value.len() != at.len() {
            let what = format!(
                "`value` has {} numbers and `at` {}: each value has its place",
                value.len(),
                at.len()
            );
            return Err(("value", what));
        }
        Ok(LinearTable { at, value })
    }

    /// Value at a place; NaN at a NaN.
    #[must_use]
    pub fn value(&self, place: f64) -> f64 {
        let [Some(first), Some(last)] = [self.at.first(), self.at.last()] else {
            return f64::NAN;
        };
        // The limits keep a NaN.
        let place = place.clamp(*first, *last);
        let above = self.at.partition_point(|at| *at < place).max(1);
        let entry = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(f64::NAN);
        let [x0, x1] = [above - 1, above].map(|i| entry(&self.at, i));
        let [y0, y1] = [above - 1, above].map(|i| entry(&self.value, i));
        y0 + (y1 - y0) * ((place - x0) / (x1 - x0))
    }

    /// First and last place, for a value that only places beyond one of them have.
    #[must_use]
    pub fn held_at(&self, value: f64) -> Option<[f64; 2]> {
        let places = [*self.at.first()?, *self.at.last()?];
        let is = |entry: &f64| (value - entry).abs() <= SAME_VALUE * entry.abs();
        let mut equal = self.value.iter().enumerate().filter(|(_, entry)| is(entry));
        let (only, _) = equal.next()?;
        let is_end = only == 0 || only + 1 == self.value.len();
        (is_end && equal.next().is_none()).then_some(places)
    }

    /// Places of the values.
    #[must_use]
    pub fn at(&self) -> &[f64] {
        &self.at
    }

    /// Values at the places.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn values_are_linear_between_places_and_held_beyond_the_ends() {
        let table =
            LinearTable::new(vec![0.0, 100.0, 300.0], vec![1000.0, 1100.0, 1400.0]).unwrap();
        for (place, value) in [
            (-50.0, 1000.0),
            (0.0, 1000.0),
            (50.0, 1050.0),
            (100.0, 1100.0),
            (200.0, 1250.0),
            (300.0, 1400.0),
            (900.0, 1400.0),
        ] {
            assert_relative_eq!(table.value(place), value, max_relative = 1e-12);
        }
        assert!(table.value(f64::NAN).is_nan());
    }

    #[test]
    fn a_value_is_held_where_only_an_end_has_it() {
        let table = |value: [f64; 3]| LinearTable::new(vec![0.0, 1.0, 2.0], value.to_vec());
        let held = |value: [f64; 3], at: f64| table(value).unwrap().held_at(at);
        assert_eq!(held([5.0, 6.0, 7.0], 5.0), Some([0.0, 2.0]));
        assert_eq!(held([5.0, 6.0, 7.0], 7.0 * (1.0 + 1e-12)), Some([0.0, 2.0]));
        assert_eq!(held([5.0, 6.0, 7.0], 6.0), None);
        assert_eq!(held([5.0, 6.0, 7.0], 5.5), None);
        // A table that is level at an end has its value inside as well.
        assert_eq!(held([0.0, 0.0, 7.0], 0.0), None);
    }

    #[test]
    fn a_table_that_cannot_be_read_is_refused_at_its_list() {
        for (at, value, list, words) in [
            (
                vec![0.0, 2.0, 1.0],
                vec![1.0; 3],
                "at",
                "increase: 1 comes after 2",
            ),
            (
                vec![0.0, 0.0],
                vec![1.0; 2],
                "at",
                "increase: 0 comes after 0",
            ),
            (
                vec![0.0, 1.0],
                vec![1.0; 3],
                "value",
                "3 numbers and `at` 2",
            ),
            (vec![0.0], vec![1.0], "at", "two numbers or more"),
            (vec![], vec![], "at", "two numbers or more"),
            (vec![0.0, f64::NAN], vec![1.0; 2], "at", "finite"),
            (vec![0.0, 1.0], vec![1.0, f64::INFINITY], "value", "finite"),
        ] {
            let (named, what) = LinearTable::new(at, value).unwrap_err();
            assert_eq!(named, list);
            assert!(what.contains(words), "{what}");
        }
    }
}
