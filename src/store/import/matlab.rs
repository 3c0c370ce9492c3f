//! MATLAB 5 files (`-v6`, `-v7`): vectors, the columns of matrices, and both in structs.
//!
//! Layout: MAT-File Format, The MathWorks, 2024, chapter 1.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::contents::{Contents, ImportedColumn, refused};
use super::flight_file::{BATCH_ROWS, write};
use crate::error::{Error, Result};

/// Largest file: more than any flight.
const LARGEST: u64 = 4 << 30;
/// Bytes of a compressed variable when it is unpacked, at most.
const LARGEST_VARIABLE: u64 = 4 << 30;
/// Deepest nesting of structs.
const DEEPEST: usize = 16;

/// Imports a MATLAB file.
pub fn import(source: &Path, file: &Path) -> Result<Contents> {
    let opened = std::fs::File::open(source).map_err(Error::io(source, "cannot open it"))?;
    let mut bytes = Vec::new();
    opened
        .take(LARGEST)
        .read_to_end(&mut bytes)
        .map_err(Error::io(source, "cannot read it"))?;
    let variables = variables(&bytes).map_err(|what| refused(source, &what))?;
    let mut table = Table::default();
    let single = variables.len() == 1;
    for (name, value) in variables {
        table.add(if single { "" } else { &name }, &name, value);
    }
    table.name_matrix_columns();
    let rows = table.frequent_length();
    let (columns, notes) = table.of_length(rows);
    if columns.len() < 2 || rows < 2 {
        let what = "it has no two vectors of one length, which could be a recording's columns";
        return Err(refused(source, what));
    }
    let heads: Vec<ImportedColumn> = columns.iter().map(|(head, _)| head.clone()).collect();
    let rows = write(file, &heads, |sink| {
        for from in (0..rows).step_by(BATCH_ROWS) {
            let to = (from + BATCH_ROWS).min(rows);
            let batch: Vec<Vec<f64>> = columns
                .iter()
                .map(|(_, values)| values[from..to].to_vec())
                .collect();
            sink(&batch)?;
        }
        Ok(())
    })?;
    Ok(Contents {
        rows,
        columns: heads,
        notes,
        folder: None,
    })
}

/// A variable or field.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    /// Rows, columns, and values column by column.
    Numbers(usize, usize, Vec<f64>),
    Text(String),
    Cells(Vec<Value>),
    Struct(Vec<(String, Value)>),
    /// Something else, in words.
    Other(&'static str),
}

/// Columns collected from the variables.
#[derive(Debug, Default)]
struct Table {
    columns: Vec<(ImportedColumn, Vec<f64>)>,
    /// Matrices whose columns have no names yet: first column and count.
    matrices: Vec<(usize, usize)>,
    /// Lists of texts, with their names.
    lists: Vec<(String, Vec<String>)>,
    notes: Vec<String>,
}

impl Table {
    /// Adds a value under the name of what contains it.
    fn add(&mut self, prefix: &str, name: &str, value: Value) {
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
            Value::Text(_) => {}
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

    /// Names the columns of a matrix by a list of as many texts, and gives them units by another.
    fn name_matrix_columns(&mut self) {
        let is_units = |name: &str| name.to_lowercase().contains("unit");
        for (first, width) in self.matrices.clone() {
            let mut of_width = self.lists.iter().filter(|(_, list)| list.len() == width);
            let names = of_width.clone().find(|(name, _)| !is_units(name));
            let units = of_width.find(|(name, _)| is_units(name));
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
    }

    /// Length that most columns have.
    fn frequent_length(&self) -> usize {
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
    fn of_length(self, length: usize) -> (Vec<(ImportedColumn, Vec<f64>)>, Vec<String>) {
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
        (kept, notes)
    }
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

/// Bytes of a file with its byte order.
#[derive(Clone, Copy)]
struct Reader<'a> {
    bytes: &'a [u8],
    is_little: bool,
}

/// Type of an element, and its bytes.
struct Element<'a> {
    kind: u32,
    data: &'a [u8],
}

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const TRUNCATED: &str = "the file ends within a variable: it was cut off";

/// Variables of a file.
fn variables(bytes: &[u8]) -> std::result::Result<Vec<(String, Value)>, String> {
    let is_little = match bytes.get(126..128) {
        Some(b"IM") => true,
        Some(b"MI") => false,
        _ => return Err("its header has no byte order".to_owned()),
    };
    let mut reader = Reader {
        bytes: bytes.get(128..).unwrap_or_default(),
        is_little,
    };
    let mut variables = Vec::new();
    while !reader.bytes.is_empty() {
        let element = reader.next()?;
        let variable = if element.kind == COMPRESSED {
            let mut unpacked = Vec::new();
            ZlibDecoder::new(element.data)
                .take(LARGEST_VARIABLE)
                .read_to_end(&mut unpacked)
                .map_err(|e| format!("a compressed variable is damaged: {e}"))?;
            let mut inner = Reader {
                bytes: &unpacked,
                is_little,
            };
            let element = inner.next()?;
            (element.kind == MATRIX)
                .then(|| matrix(element.data, is_little, 0))
                .transpose()?
        } else {
            (element.kind == MATRIX)
                .then(|| matrix(element.data, is_little, 0))
                .transpose()?
        };
        variables.extend(variable);
    }
    Ok(variables)
}

impl<'a> Reader<'a> {
    fn word(&self, at: usize) -> std::result::Result<u32, String> {
        let bytes = self
            .bytes
            .get(at..at + 4)
            .and_then(|b| <[u8; 4]>::try_from(b).ok());
        let bytes = bytes.ok_or(TRUNCATED)?;
        Ok(if self.is_little {
            u32::from_le_bytes(bytes)
        } else {
            u32::from_be_bytes(bytes)
        })
    }

    /// The next element, with its padding behind it.
    fn next(&mut self) -> std::result::Result<Element<'a>, String> {
        let tag = self.word(0)?;
        let (kind, size, from) = if tag >> 16 == 0 {
            (tag, self.word(4)? as usize, 8)
        } else {
            (tag & 0xffff, (tag >> 16) as usize, 4)
        };
        let data = self.bytes.get(from..from + size).ok_or(TRUNCATED)?;
        let padded = if kind == COMPRESSED {
            from + size
        } else {
            (from + size).next_multiple_of(8)
        };
        self.bytes = self.bytes.get(padded..).unwrap_or_default();
        Ok(Element { kind, data })
    }
}

/// Name and value of a matrix element.
fn matrix(
    data: &[u8],
    is_little: bool,
    depth: usize,
) -> std::result::Result<(String, Value), String> {
    if data.is_empty() {
        return Ok((String::new(), Value::Other("empty")));
    }
    if depth > DEEPEST {
        return Err(format!("structs are nested more than {DEEPEST} deep"));
    }
    let mut reader = Reader {
        bytes: data,
        is_little,
    };
    let flags = reader.next()?;
    let flags = Reader {
        bytes: flags.data,
        is_little,
    }
    .word(0)?;
    let dimensions = reader.next()?;
    let dimensions = numbers(&dimensions, is_little)?;
    let name = text(reader.next()?.data);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a size, checked against the data"
    )]
    let sizes: Vec<usize> = dimensions.iter().map(|d| d.max(0.0) as usize).collect();
    let count = sizes
        .iter()
        .try_fold(1_usize, |a, b| a.checked_mul(*b))
        .ok_or(TRUNCATED)?;
    let (rows, columns) = (
        sizes.first().copied().unwrap_or(0),
        count / sizes.first().copied().unwrap_or(1).max(1),
    );
    let value = match flags & 0xff {
        1 => {
            let cells = (0..count.min(data.len()))
                .map(|_| Ok(matrix(reader.next()?.data, is_little, depth + 1)?.1));
            Value::Cells(cells.collect::<std::result::Result<_, String>>()?)
        }
        2 if count == 1 => structure(&mut reader, depth)?,
        4 => Value::Text(characters(&reader.next()?, is_little)?),
        6..=15 => {
            let values = numbers(&reader.next()?, is_little)?;
            if values.len() != count {
                return Err(format!(
                    "`{name}` has {} values for {count} places",
                    values.len()
                ));
            }
            Value::Numbers(rows, columns, values)
        }
        2 => Value::Other("an array of structs"),
        5 => Value::Other("a sparse matrix"),
        _ => Value::Other("an object; save its numbers as plain vectors"),
    };
    Ok((name, value))
}

/// Fields of a struct of one element.
fn structure(reader: &mut Reader, depth: usize) -> std::result::Result<Value, String> {
    let length = reader.next()?;
    let length = Reader {
        bytes: length.data,
        is_little: reader.is_little,
    }
    .word(0)? as usize;
    let names = reader.next()?.data;
    let names: Vec<String> = names.chunks(length.max(1)).map(text).collect();
    let field = |name: String| {
        let element = reader.next()?;
        Ok((name, matrix(element.data, reader.is_little, depth + 1)?.1))
    };
    let fields = names
        .into_iter()
        .map(field)
        .collect::<std::result::Result<_, String>>()?;
    Ok(Value::Struct(fields))
}

/// Text up to its first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Text of a char array: bytes of UTF-8, or 16-bit codes.
fn characters(element: &Element, is_little: bool) -> std::result::Result<String, String> {
    if matches!(element.kind, 1 | 2 | 16) {
        return Ok(text(element.data));
    }
    let codes = numbers(element, is_little)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "16-bit codes"
    )]
    let codes: Vec<u16> = codes.iter().map(|code| *code as u16).collect();
    Ok(String::from_utf16_lossy(&codes))
}

/// Numbers of an element of any numeric type.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_lossless,
    reason = "one conversion for all types; 64-bit integers beyond 2^53 are no measurements"
)]
fn numbers(element: &Element, is_little: bool) -> std::result::Result<Vec<f64>, String> {
    macro_rules! of {
        ($type:ty) => {{
            let one = |bytes: &[u8]| {
                let bytes = bytes.try_into().unwrap_or_default();
                let value = if is_little {
                    <$type>::from_le_bytes(bytes)
                } else {
                    <$type>::from_be_bytes(bytes)
                };
                value as f64
            };
            element
                .data
                .chunks_exact(size_of::<$type>())
                .map(one)
                .collect()
        }};
    }
    Ok(match element.kind {
        1 => of!(i8),
        2 | 16 => of!(u8),
        3 => of!(i16),
        4 | 17 => of!(u16),
        5 => of!(i32),
        6 => of!(u32),
        7 => of!(f32),
        9 => of!(f64),
        12 => of!(i64),
        13 => of!(u64),
        other => return Err(format!("numbers of the unknown type {other}")),
    })
}
