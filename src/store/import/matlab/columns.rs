//! Columns of a recording from the variables of a file: vectors, the columns of matrices, and both in
//! structs.

use std::collections::BTreeMap;

use super::super::imported_contents::ImportedColumn;

/// Deepest nesting of structs.
pub const DEEPEST: usize = 16;

/// A variable or field.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Rows, columns, and values column by column.
    Numbers(usize, usize, Vec<f64>),
    Text(String),
    Cells(Vec<Value>),
    Struct(Vec<(String, Value)>),
    /// Something else, in words.
    Other(&'static str),
}

impl Value {
    /// Text from 16-bit codes, which both file formats store as numbers.
    pub fn text_of_codes(codes: &[f64]) -> Value {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "16-bit codes"
        )]
        let codes: Vec<u16> = codes.iter().map(|code| *code as u16).collect();
        Value::Text(String::from_utf16_lossy(&codes))
    }
}

/// Columns collected from the variables.
#[derive(Debug, Default)]
pub struct Table {
    columns: Vec<(ImportedColumn, Vec<f64>)>,
    /// Matrices whose columns have no names yet: first column and count.
    matrices: Vec<(usize, usize)>,
    /// Lists of texts, with their names.
    lists: Vec<(String, Vec<String>)>,
    /// Texts, with their names.
    texts: Vec<(String, String)>,
    notes: Vec<String>,
}

impl Table {
    /// Adds a value under the name of its container.
    pub fn add(&mut self, prefix: &str, name: &str, value: Value) {
        match value {
            Value::Numbers(rows, columns, values) => self.add_numbers(name, rows, columns, values),
            Value::Struct(fields) => {
                if let Some((unit, data)) = signal_of(&fields) {
                    let column = ImportedColumn {
                        name: name.to_owned(),
                        unit,
                    };
                    self.columns.push((column, data));
                    return;
                }
                for (field, value) in fields {
                    let full = if prefix.is_empty() {
                        field.clone()
                    } else {
                        format!("{prefix}.{field}")
                    };
                    self.add(&full, &full, value);
                }
            }
            Value::Cells(cells) if cells.iter().any(|cell| matches!(cell, Value::Struct(_))) => {
                self.add_structs(name, cells);
            }
            Value::Cells(cells) => {
                let text = |cell: Value| {
                    if let Value::Text(text) = cell {
                        Some(text)
                    } else {
                        None
                    }
                };
                if let Some(list) = cells.into_iter().map(text).collect() {
                    self.lists.push((name.to_owned(), list));
                }
            }
            Value::Other(what) => self.notes.push(format!("`{name}` is left out: {what}")),
            Value::Text(text) => self.texts.push((name.to_owned(), text)),
        }
    }

    /// Adds the structs of an array, each under its label, as Simulink has them, or under its number.
    fn add_structs(&mut self, name: &str, structs: Vec<Value>) {
        let container = name.rsplit_once('.').map_or("", |(container, _)| container);
        for (n, value) in structs.into_iter().enumerate() {
            let label = label_of(&value);
            let full = match label {
                None => format!("{name}_{}", n + 1),
                Some(label) if container.is_empty() => label,
                Some(label) => format!("{container}.{label}"),
            };
            self.add(&full, &full, value);
        }
    }

    fn add_numbers(&mut self, name: &str, rows: usize, columns: usize, values: Vec<f64>) {
        let head = |name: String| ImportedColumn { name, unit: None };
        if rows == 1 || columns == 1 {
            if values.len() > 1 {
                self.columns.push((head(name.to_owned()), values));
            }
            return;
        }
        if rows == 0 || columns == 0 {
            return;
        }
        // Recordings are longer than wide.
        let (length, width) = (rows.max(columns), rows.min(columns));
        self.matrices.push((self.columns.len(), width));
        for n in 0..width {
            let at = |k: usize| {
                if rows >= columns {
                    n * rows + k
                } else {
                    k * rows + n
                }
            };
            let column = (0..length).map(|k| values[at(k)]).collect();
            self.columns
                .push((head(format!("{name}_{}", n + 1)), column));
        }
    }

    /// Names the columns of a matrix by a list of as many texts, and takes their units from
    /// another. Returns `false` if all columns are those of matrices without names.
    pub fn name_matrix_columns(&mut self) -> bool {
        let mut named = self.columns.len();
        let is_units = |name: &str| name.to_lowercase().contains("unit");
        for (first, width) in self.matrices.clone() {
            let mut of_width = self.lists.iter().filter(|(_, list)| list.len() == width);
            let names = of_width.clone().find(|(name, _)| !is_units(name));
            let units = of_width.find(|(name, _)| is_units(name));
            named -= if names.is_none() { width } else { 0 };
            let columns = self.columns.iter_mut().skip(first).take(width).enumerate();
            for (n, (head, _)) in columns {
                if let Some((_, names)) = names {
                    head.name.clone_from(&names[n]);
                }
                head.unit = units
                    .map(|(_, units)| units[n].clone())
                    .or(head.unit.take());
            }
        }
        named > 0 || self.columns.is_empty()
    }

    /// Gives a column without a unit the text that states it: `units.q` or `q_unit` for `q` and for `data.q`.
    pub fn add_stated_units(&mut self) {
        let texts = &self.texts;
        let without = |column: &&mut (ImportedColumn, Vec<f64>)| column.0.unit.is_none();
        for (head, _) in self.columns.iter_mut().filter(without) {
            let own = texts.iter().find(|(text, _)| states_unit(text, &head.name));
            head.unit = own.map(|(_, unit)| unit.trim().to_owned());
        }
    }

    /// Length that most columns have.
    pub fn frequent_length(&self) -> usize {
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        for (_, values) in &self.columns {
            *counts.entry(values.len()).or_default() += 1;
        }
        counts
            .into_iter()
            .max_by_key(|(length, count)| (*count, *length))
            .map_or(0, |(length, _)| length)
    }

    /// Columns of a length, each name once, and the notes.
    pub fn of_length(self, length: usize) -> (Vec<(ImportedColumn, Vec<f64>)>, Vec<String>) {
        let mut notes = self.notes;
        let mut kept: Vec<(ImportedColumn, Vec<f64>)> = Vec::new();
        for (mut head, values) in self.columns {
            if values.len() != length {
                notes.push(format!(
                    "`{}` is left out: {} values, where most columns have {length}",
                    head.name,
                    values.len()
                ));
                continue;
            }
            let base = head.name.clone();
            let mut n = 2;
            while kept.iter().any(|(other, _)| other.name == head.name) {
                head.name = format!("{base}_{n}");
                n += 1;
            }
            kept.push((head, values));
        }
        notes.extend(strip_common_struct(&mut kept));
        (kept, notes)
    }
}

/// `true` if a text of this name states the unit of a column: it has the column's name in a struct `units` beside
/// that of the column, or with `_unit` at the end.
fn states_unit(text: &str, column: &str) -> bool {
    let is_units = |word: &str| ["unit", "units"].contains(&word.to_lowercase().as_str());
    let of_column: Vec<&str> = column.split('.').collect();
    let of_text: Vec<&str> = text.split('.').collect();
    let in_struct = of_text
        .iter()
        .position(|word| is_units(word))
        .is_some_and(|at| {
            let (before, name) = (&of_text[..at], &of_text[at + 1..]);
            !name.is_empty() && of_column.starts_with(before) && of_column.ends_with(name)
        });
    let at_end = || {
        let rest = text
            .strip_prefix(column)
            .and_then(|rest| rest.strip_prefix('_'));
        rest.is_some_and(is_units)
    };
    in_struct || at_end()
}

/// Strips the struct that all names begin with, `rec.` of `rec.q` and `rec.de`. Returns a note about it.
fn strip_common_struct(columns: &mut [(ImportedColumn, Vec<f64>)]) -> Option<String> {
    let (first, _) = columns.first()?;
    let dots = first.name.match_indices('.').map(|(at, _)| at + 1);
    let is_common = |end: &usize| {
        let start = &first.name[..*end];
        let rest = |name: &str| {
            name.strip_prefix(start)
                .is_some_and(|rest| !rest.is_empty())
        };
        columns.iter().all(|(head, _)| rest(&head.name))
    };
    let end = dots.filter(is_common).max()?;
    let start = first.name[..end].to_owned();
    for (head, _) in columns {
        head.name.drain(..end);
    }
    Some(format!("all names begin with `{start}`, which is left out"))
}

/// Name that a struct gives the signal that it holds.
fn label_of(value: &Value) -> Option<String> {
    let Value::Struct(fields) = value else {
        return None;
    };
    let is_label = |name: &str| ["label", "name"].contains(&name.to_lowercase().as_str());
    fields.iter().find_map(|(name, value)| match value {
        Value::Text(text) if is_label(name) && !text.trim().is_empty() => {
            Some(text.trim().to_owned())
        }
        _ => None,
    })
}

/// Unit and values of a struct that holds one signal: `data` or `values`, and perhaps `unit`.
fn signal_of(fields: &[(String, Value)]) -> Option<(Option<String>, Vec<f64>)> {
    let field = |names: &[&str]| {
        let found = fields
            .iter()
            .find(|(name, _)| names.contains(&name.to_lowercase().as_str()));
        found.map(|(_, value)| value)
    };
    let Some(Value::Numbers(rows, columns, values)) = field(&["data", "values", "value"]) else {
        return None;
    };
    let unit = match field(&["unit", "units"]) {
        Some(Value::Text(unit)) => Some(unit.clone()),
        _ => None,
    };
    let is_vector = (*rows == 1 || *columns == 1) && values.len() > 1;
    is_vector.then(|| (unit, values.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stripped(names: &[&str]) -> (Vec<String>, Option<String>) {
        let column = |name: &&str| {
            let head = ImportedColumn {
                name: (*name).to_owned(),
                unit: None,
            };
            (head, Vec::new())
        };
        let mut columns: Vec<_> = names.iter().map(column).collect();
        let note = strip_common_struct(&mut columns);
        (
            columns.into_iter().map(|(head, _)| head.name).collect(),
            note,
        )
    }

    #[test]
    fn a_struct_of_units_states_those_of_the_columns_beside_it() {
        for (text, column) in [
            ("units.q", "data.q"),
            ("tp.Units.fast.q", "tp.data.fast.q"),
            ("q_unit", "q"),
            ("rec.q_Units", "rec.q"),
        ] {
            assert!(states_unit(text, column), "{text} {column}");
        }
        for (text, column) in [
            ("units.q", "data.p"),
            ("a.units.q", "b.data.q"),
            ("units", "q"),
            ("name.q", "data.q"),
        ] {
            assert!(!states_unit(text, column), "{text} {column}");
        }
    }

    #[test]
    fn the_struct_that_holds_all_columns_is_left_out_of_their_names() {
        let (names, note) = stripped(&["rec.q", "rec.de"]);
        assert_eq!(names, ["q", "de"]);
        assert!(note.unwrap().contains("`rec.`"));
        let (names, _) = stripped(&["a.fast.q", "a.fast.p"]);
        assert_eq!(names, ["q", "p"]);
        let (names, _) = stripped(&["a.fast.q", "a.slow.q"]);
        assert_eq!(names, ["fast.q", "slow.q"]);
        for other in [
            &["rec.q", "time"][..],
            &["rec.q", "recorder.q"],
            &["q", "de"],
            &[],
        ] {
            let (names, note) = stripped(other);
            assert_eq!(
                (names.iter().map(String::as_str).collect::<Vec<_>>(), note),
                (other.to_vec(), None)
            );
        }
    }
}
