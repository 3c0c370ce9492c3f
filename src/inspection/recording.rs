//! A recording as found: columns by name, with the unit that the file states where it states one.

use crate::flight::fill_value::is_usual;

/// One column of a recording, on the rows of the file; a null is a NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    pub name: String,
    /// Unit in the metadata of the file, as written there.
    pub stated: Option<String>,
    pub values: Vec<f64>,
}

impl Column {
    /// Fill value of the column, such as -9999: a usual one from which the largest measurement is far.
    fn fill_value(&self, largest: f64) -> Option<f64> {
        let usual = self.values.iter().copied().find(|value| is_usual(*value));
        usual.filter(|fill| largest < LARGEST_SHARE * fill.abs())
    }
}

/// Largest measurement of a column beside a fill value, as a share of it.
const LARGEST_SHARE: f64 = 0.5;

/// Recordings with the fill values of their columns missing; `None` if they have none.
#[must_use]
pub fn without_fill_values(recordings: &[Recording]) -> Option<Vec<Recording>> {
    let mut cleaned: Option<Vec<Recording>> = None;
    for name in column_names(recordings) {
        let columns = || recordings.iter().filter_map(|r| r.column(name));
        let values = || columns().flat_map(|column| column.values.iter().copied());
        let measured = values().filter(|v| v.is_finite() && !is_usual(*v));
        let Some(largest) = measured.map(f64::abs).max_by(f64::total_cmp) else {
            continue;
        };
        let Some(fill) = columns().find_map(|column| column.fill_value(largest)) else {
            continue;
        };
        for recording in cleaned.get_or_insert_with(|| recordings.to_vec()) {
            let own = recording
                .columns
                .iter_mut()
                .filter(|column| column.name == name);
            for value in own.flat_map(|column| &mut column.values) {
                if is_usual(*value) && value.abs() >= fill.abs() {
                    *value = f64::NAN;
                }
            }
        }
    }
    cleaned
}

/// Columns of one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    pub name: String,
    pub columns: Vec<Column>,
}

impl Recording {
    /// Column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }
}

/// Names of all columns, in the order of the files.
#[must_use]
pub fn column_names(recordings: &[Recording]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for column in recordings.iter().flat_map(|r| &r.columns) {
        if !names.contains(&column.name.as_str()) {
            names.push(&column.name);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fill_values_are_missing_where_all_measurements_are_far_from_them() {
        let recording = |values: &[f64]| Recording {
            name: "f".to_owned(),
            columns: vec![Column {
                name: "q".to_owned(),
                stated: None,
                values: values.to_vec(),
            }],
        };
        let cleaned = without_fill_values(&[recording(&[1.0, -9_999.0, 3.0])]).unwrap();
        assert!(cleaned[0].columns[0].values[1].is_nan());
        for values in [
            &[1.0, 2.0][..],
            &[-9_999.0, -9_999.0],
            &[9_000.0, 9_999.0, 12_000.0],
        ] {
            assert_eq!(
                without_fill_values(&[recording(values)]),
                None,
                "{values:?}"
            );
        }
    }
}
