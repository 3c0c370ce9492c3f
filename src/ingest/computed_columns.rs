//! Channels that formulas compute, as columns beside the recorded ones.

use std::collections::BTreeMap;
use std::ops::Range;

use super::column_source::ColumnSource;
use crate::flight::fill_value::is_fill_value_in;
use crate::flight::{Channel, Formula};

/// Rows of the columns of a formula that are in memory at once.
const ROWS: usize = 1 << 16;

/// A source with the columns that the formulas of a channel map add to it.
#[derive(Debug)]
pub struct ComputedColumns<'a, S: ?Sized> {
    source: &'a S,
    formulas: BTreeMap<&'a str, &'a Formula>,
}

impl<'a, S: ColumnSource + ?Sized> ComputedColumns<'a, S> {
    #[must_use]
    pub fn of(source: &'a S, channels: &'a BTreeMap<String, Channel>) -> Self {
        let formulas = channels.iter();
        let formulas =
            formulas.filter_map(|(name, channel)| Some((name.as_str(), channel.formula.as_ref()?)));
        ComputedColumns {
            source,
            formulas: formulas.collect(),
        }
    }

    /// Values of the formula's columns in some rows.
    fn operands(
        &self,
        file: usize,
        formula: &Formula,
        rows: &Range<usize>,
    ) -> Result<Vec<Vec<f64>>, String> {
        let read = |column: &str| {
            let mut values = Vec::with_capacity(rows.len());
            let mut append = |part: &[f64]| values.extend_from_slice(part);
            self.source.read(file, column, rows.clone(), &mut append)?;
            Ok(values)
        };
        let operands = formula.operands().iter();
        operands.map(|operand| read(&operand.column)).collect()
    }
}

impl<S: ColumnSource + ?Sized> ColumnSource for ComputedColumns<'_, S> {
    fn flight_id(&self) -> &str {
        self.source.flight_id()
    }

    fn files(&self) -> usize {
        self.source.files()
    }

    fn name(&self, file: usize) -> String {
        self.source.name(file)
    }

    fn rows(&self, file: usize) -> usize {
        self.source.rows(file)
    }

    /// `true` if the file has the column, or every column of its formula.
    fn has(&self, file: usize, column: &str) -> bool {
        match self.formulas.get(column) {
            None => self.source.has(file, column),
            Some(formula) => {
                let mut operands = formula.operands().iter();
                operands.all(|operand| self.source.has(file, &operand.column))
            }
        }
    }

    /// A formula's unit is checked with its columns.
    fn unit(&self, file: usize, column: &str) -> Option<&str> {
        match self.formulas.get(column) {
            None => self.source.unit(file, column),
            Some(_) => None,
        }
    }

    fn unreadable(&self, file: usize, column: &str) -> Option<&str> {
        self.source.unreadable(file, column)
    }

    fn read(
        &self,
        file: usize,
        column: &str,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String> {
        let Some(formula) = self.formulas.get(column) else {
            return self.source.read(file, column, rows, sink);
        };
        for from in rows.clone().step_by(ROWS) {
            let part = from..(from + ROWS).min(rows.end);
            let operands = self.operands(file, formula, &part)?;
            let mut at_row = vec![f64::NAN; operands.len()];
            let value = |row: usize| {
                for ((own, values), operand) in
                    at_row.iter_mut().zip(&operands).zip(formula.operands())
                {
                    let recorded = values.get(row).copied();
                    let measured = recorded.filter(|v| !is_fill_value_in(*v, &operand.unit));
                    *own = measured.unwrap_or(f64::NAN);
                }
                formula.value(&at_row)
            };
            let values: Vec<f64> = (0..part.len()).map(value).collect();
            sink(&values);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::RawFlight;
    use crate::flight::channel::RawColumn;
    use crate::flight::formula::Operand;
    use crate::units::Unit;

    #[test]
    fn a_formula_is_a_column_where_a_file_has_all_of_its_own() {
        let operand = |column: &str| {
            Ok(Operand {
                column: column.to_owned(),
                unit: "kN".to_owned(),
                factor: 1.0,
            })
        };
        let sum = Formula::parse("L + R", Unit::of_signal("thrust_lbf"), operand).unwrap();
        let channel = Channel {
            formula: Some(sum),
            ..Channel::plain("thrust_lbf", "lbf")
        };
        let channels = BTreeMap::from([("thrust".to_owned(), channel)]);
        let column = |f: &dyn Fn(usize) -> f64| RawColumn {
            unit: Some("kN".to_owned()),
            values: (0..ROWS + 3).map(f).collect(),
        };
        let file = |names: &[&str]| RawFlight {
            flight_id: "f".to_owned(),
            columns: names
                .iter()
                .map(|name| {
                    (
                        (*name).to_owned(),
                        column(&|k| if k == 2 { f64::NAN } else { k as f64 }),
                    )
                })
                .collect(),
        };
        let files = [file(&["L", "R"]), file(&["L"])];
        let source = ComputedColumns::of(&files[..], &channels);
        assert!(source.has(0, "thrust") && source.has(1, "L") && !source.has(1, "thrust"));
        let mut values = Vec::new();
        let rows = 1..ROWS + 3;
        source
            .read(0, "thrust", rows.clone(), &mut |part| {
                values.extend_from_slice(part);
            })
            .unwrap();
        assert_eq!(values.len(), rows.len());
        for (value, row) in values.iter().zip(rows) {
            // 2 kN are 449.6179 lbf.
            let expected = 449.617_886_2 * row as f64;
            assert_eq!(value.is_nan(), row == 2);
            assert!(
                row == 2 || (value - expected).abs() < 1e-6 * expected,
                "{row}: {value}"
            );
        }
    }
}
