//! Names, units and a clock that the analyst gives to columns of a source that states none.

use std::path::Path;

use super::delimited::name_and_unit;
use super::flight_file::FlightWriter;
use super::imported_contents::{ImportedColumn, refused};
use crate::error::Result;
use crate::units::Unit;

/// Name of the column that counts time from row to row.
const TIME: &str = "time";
/// Place of a column that is left out in a list of names.
const LEFT_OUT: &str = "-";

/// Names of the columns of sources, and the step of sources without a clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Naming {
    /// Columns in the order of the source, `None` for one that is left out; empty if the source names them.
    names: Vec<Option<ImportedColumn>>,
    /// Time from row to row, s.
    step_s: Option<f64>,
}

impl Naming {
    /// Naming of a list such as `time [s], de [rad], -, V [m/s]`, and of a step in s.
    ///
    /// # Errors
    /// A sentence: the list has an empty or repeated name or an unknown unit, or the step is not positive.
    pub fn of(names: Option<&str>, step_s: Option<f64>) -> Result<Naming, String> {
        let names = names.map(parsed_names).transpose()?.unwrap_or_default();
        if step_s.is_some_and(|step| !(step.is_finite() && step > 0.0)) {
            return Err("--step takes the time from row to row in s, such as 0.02".to_owned());
        }
        let has_time = || names.iter().flatten().any(|column| column.name == TIME);
        if step_s.is_some() && has_time() {
            return Err(format!(
                "--step counts the column `{TIME}`, which --names has too: give one of the two"
            ));
        }
        Ok(Naming { names, step_s })
    }

    /// Refuses names and a step for a tall recording.
    ///
    /// # Errors
    /// [`crate::error::Error::Archive`] if either is given.
    pub(super) fn refuse_tall(&self, source: &Path) -> Result<()> {
        if *self == Naming::default() {
            return Ok(());
        }
        let what = "a recording of the columns time, name and value has names and a clock of its own: leave --names and \
                    --step out";
        Err(refused(source, what))
    }

    /// `true` if the analyst names the columns.
    #[must_use]
    pub fn has_names(&self) -> bool {
        !self.names.is_empty()
    }

    /// Begins the file of a source with some columns.
    ///
    /// # Errors
    /// [`crate::error::Error::Archive`] for another number of columns than names, or a second clock.
    pub(super) fn writer(
        &self,
        source: &Path,
        file: &Path,
        columns: &[ImportedColumn],
    ) -> Result<NamedWriter> {
        let heads = self.heads(columns).map_err(|what| refused(source, &what))?;
        let is_left_out =
            |n: &usize| matches!(self.names.get(*n), Some(None)) || self.replaces(&columns[*n]);
        let kept = (0..columns.len()).filter(|n| !is_left_out(n));
        Ok(NamedWriter {
            writer: FlightWriter::of(file, &heads)?,
            heads,
            kept: kept.collect(),
            step_s: self.step_s,
            rows: 0,
        })
    }

    /// `true` for a column of times in whose place a step counts the time.
    fn replaces(&self, column: &ImportedColumn) -> bool {
        self.step_s.is_some() && !self.has_names() && column.name == TIME
    }

    /// Note about a column of times that is left out.
    pub(super) fn note_on_time(&self, columns: &[ImportedColumn]) -> Option<String> {
        let replaced = columns.iter().any(|column| self.replaces(column));
        replaced.then(|| format!("`{TIME}` of the source is left out: --step counts the time"))
    }

    /// Names and units of the columns that are written.
    fn heads(&self, columns: &[ImportedColumn]) -> Result<Vec<ImportedColumn>, String> {
        let own = || columns.iter().map(|column| column.name.as_str());
        if self.has_names() && self.names.len() != columns.len() {
            return Err(format!(
                "--names has {} names, and the file {} columns of numbers: {}",
                self.names.len(),
                columns.len(),
                own().collect::<Vec<_>>().join(", ")
            ));
        }
        let time = self.step_s.map(|_| ImportedColumn {
            name: TIME.to_owned(),
            unit: Some("s".to_owned()),
        });
        let named = if self.has_names() {
            self.names.iter().flatten().cloned().collect()
        } else {
            let kept = columns.iter().filter(|column| !self.replaces(column));
            kept.cloned().collect::<Vec<_>>()
        };
        Ok(time.into_iter().chain(named).collect())
    }
}

/// A file whose columns have the names of the analyst.
pub struct NamedWriter {
    writer: FlightWriter,
    /// Columns of the file.
    pub heads: Vec<ImportedColumn>,
    /// Places in the source of the columns that are written.
    kept: Vec<usize>,
    step_s: Option<f64>,
    /// Number of rows written.
    pub rows: usize,
}

impl NamedWriter {
    /// Writes columns of the source, of one length.
    ///
    /// # Errors
    /// [`crate::error::Error::Store`] naming the file.
    pub fn write(&mut self, columns: &[Vec<f64>]) -> Result<()> {
        let rows = columns.first().map_or(0, Vec::len);
        let times = self.step_s.map(|step_s| {
            let rows = self.rows..self.rows + rows;
            rows.map(|row| row as f64 * step_s).collect::<Vec<f64>>()
        });
        self.rows += rows;
        let kept = self.kept.iter().map(|at| columns[*at].as_slice());
        let written: Vec<&[f64]> = times.as_deref().into_iter().chain(kept).collect();
        self.writer.write(&written)
    }

    /// Puts the file in its place and returns the number of rows.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] or [`crate::error::Error::Store`] naming the file.
    pub fn place(self) -> Result<usize> {
        self.writer.place()
    }
}

/// Note for columns without names, which have those of their places.
pub fn note_on_nameless(columns: &[ImportedColumn]) -> String {
    let count = columns.len();
    format!(
        "the source names none of its {count} columns; if you know them, import it again with --names 'time [s], alpha \
         [deg], …' in their order (- for one that is left out): names and units are more certain than what the motion \
         determines"
    )
}

/// Columns of a list of names.
fn parsed_names(list: &str) -> Result<Vec<Option<ImportedColumn>>, String> {
    let mut columns: Vec<Option<ImportedColumn>> = Vec::new();
    for (n, field) in list.split([',', '\n']).map(str::trim).enumerate() {
        let (name, unit) = name_and_unit(field);
        let is_taken = || columns.iter().flatten().any(|other| other.name == name);
        if name.is_empty() {
            return Err(format!(
                "--names: column {} has no name; write `{LEFT_OUT}` for a column that is left out",
                n + 1
            ));
        }
        if name != LEFT_OUT && is_taken() {
            return Err(format!("--names: `{name}` comes twice"));
        }
        if let Some(unit) = unit.as_deref().filter(|unit| Unit::parse(unit).is_err()) {
            return Err(format!(
                "--names: harvest does not have the unit `{unit}` of {name}"
            ));
        }
        columns.push((name != LEFT_OUT).then_some(ImportedColumn { name, unit }));
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_source(count: usize) -> Vec<ImportedColumn> {
        let column = |n: usize| ImportedColumn {
            name: format!("column_{}", n + 1),
            unit: None,
        };
        (0..count).map(column).collect()
    }

    fn names(heads: &[ImportedColumn]) -> Vec<(&str, Option<&str>)> {
        let heads = heads.iter();
        heads
            .map(|head| (head.name.as_str(), head.unit.as_deref()))
            .collect()
    }

    #[test]
    fn columns_have_the_names_that_are_given_and_a_step_counts_time() {
        let naming = Naming::of(Some("de [rad], -, V (m/s)"), Some(0.1)).unwrap();
        let heads = naming.heads(&of_source(3)).unwrap();
        let expected = [("time", Some("s")), ("de", Some("rad")), ("V", Some("m/s"))];
        assert_eq!(names(&heads), expected);
        let step = Naming::of(None, Some(0.1)).unwrap();
        assert_eq!(names(&step.heads(&of_source(1)).unwrap()).len(), 2);
        let mut timed = of_source(2);
        "time".clone_into(&mut timed[0].name);
        assert_eq!(names(&step.heads(&timed).unwrap()).len(), 2);
        assert!(step.note_on_time(&timed).is_some() && step.note_on_time(&of_source(2)).is_none());
    }

    #[test]
    fn mistakes_of_names_and_steps_are_named() {
        let refused = |names: &str, step| Naming::of(Some(names), step).unwrap_err();
        assert!(refused("a, a", None).contains("`a` comes twice"));
        assert!(refused("a,, b", None).contains("column 2 has no name"));
        assert!(refused("a [furlong]", None).contains("unit `furlong` of a"));
        assert!(refused("time, a", Some(0.1)).contains("give one of the two"));
        assert!(Naming::of(None, Some(f64::NAN)).is_err());
        let naming = Naming::of(Some("a, b"), None).unwrap();
        let message = naming.heads(&of_source(3)).unwrap_err();
        assert!(
            message.contains("2 names, and the file 3 columns"),
            "{message}"
        );
    }
}
