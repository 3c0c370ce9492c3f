//! Variables of an HDF5 file: MATLAB 7.3, and the recordings of other programs.
//!
//! MATLAB writes a dataset for each array, with its class as the attribute `MATLAB_class` and the
//! sizes in reverse order. It writes a group for each struct. A cell array refers to datasets of
//! the group `#refs#`. Other programs write datasets and groups alike, and a unit as an attribute
//! of its dataset.

use std::cell::Cell;
use std::collections::BTreeMap;

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, H5Type, Hdf5File, OpenOptions};

use super::columns::{DEEPEST, Value};

/// Group of the objects that cells refer to. Names of MATLAB's own groups begin with `#`.
const REFERRED: &str = "#refs#";

/// Attributes of a dataset or group, as MATLAB names them.
const CLASS: &str = "MATLAB_class";
const EMPTY: &str = "MATLAB_empty";
const OBJECT: &str = "MATLAB_object_decode";
const SPARSE: &str = "MATLAB_sparse";

/// Attributes in which programs write a unit.
const UNITS: [&str; 4] = ["unit", "units", "Unit", "Units"];

/// Largest ratio of a variable's bytes to those of its file: the best that its compression can
/// reach.
const LARGEST_RATIO: usize = 1100;

/// Largest number of datasets and groups of a file, each counted once per reference. References may
/// form a tree whose branches are all one dataset.
const MOST_MEMBERS: usize = 100_000;

type Result<T> = std::result::Result<T, String>;

/// Variables of a file, in the order of their names.
///
/// # Errors
/// A sentence that names the damage.
pub fn variables(bytes: Vec<u8>) -> Result<Vec<(String, Value)>> {
    let largest = bytes.len().saturating_mul(LARGEST_RATIO);
    let options = OpenOptions::default()
        .with_max_read_bytes(largest)
        .with_max_chunk_bytes(largest);
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(|e| damaged(&e))?;
    let root = file.root_group().map_err(|e| damaged(&e))?;
    let referred = root.group(REFERRED).and_then(|group| group.datasets());
    let referred = referred.unwrap_or_default().into_iter();
    let reader = Reader {
        referred: referred.map(|own| (own.address(), own)).collect(),
        address_bytes: usize::from(root.offset_size()),
        members: Cell::new(0),
    };
    reader.fields(&root, 0)
}

/// Reader of the variables of one file.
struct Reader {
    /// Datasets to which cells refer, by their address.
    referred: BTreeMap<u64, Dataset>,
    address_bytes: usize,
    /// Datasets and groups read so far.
    members: Cell<usize>,
}

impl Reader {
    /// Counts a dataset or a group.
    ///
    /// # Errors
    /// They are more than a recording has.
    fn count(&self) -> Result<()> {
        self.members.set(self.members.get() + 1);
        if self.members.get() > MOST_MEMBERS {
            return Err(format!(
                "more than {MOST_MEMBERS} arrays and structs, counted as often as others refer to them"
            ));
        }
        Ok(())
    }

    /// Datasets and groups of a group.
    fn fields(&self, group: &Group, depth: usize) -> Result<Vec<(String, Value)>> {
        if depth > DEEPEST {
            return Err(format!("structs are nested more than {DEEPEST} deep"));
        }
        self.count()?;
        let (groups, datasets) = group.members().map_err(|e| damaged(&e))?;
        let mut fields = Vec::new();
        for dataset in &datasets {
            fields.push((dataset.name().to_owned(), self.dataset(dataset, depth)?));
        }
        for group in groups.iter().filter(|g| !g.name().starts_with('#')) {
            let value = if group.attribute(SPARSE).is_ok() {
                Value::Other("a sparse matrix")
            } else {
                Value::Struct(self.fields(group, depth + 1)?)
            };
            fields.push((group.name().to_owned(), value));
        }
        fields.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(fields)
    }

    /// Value of a dataset, with its unit where an attribute names it.
    fn dataset(&self, dataset: &Dataset, depth: usize) -> Result<Value> {
        self.count()?;
        let value = self.bare(dataset, depth)?;
        let mut units = UNITS.iter().filter_map(|name| attribute(dataset, name));
        Ok(match (value, units.next()) {
            (value @ Value::Numbers(..), Some(unit)) => Value::Struct(vec![
                ("data".to_owned(), value),
                ("unit".to_owned(), Value::Text(unit)),
            ]),
            (value, _) => value,
        })
    }

    fn bare(&self, dataset: &Dataset, depth: usize) -> Result<Value> {
        let has = |name: &str| dataset.attribute(name).is_ok();
        if has(OBJECT) {
            return Ok(Value::Other("an object; save its numbers as plain vectors"));
        }
        if has(EMPTY) {
            return Ok(Value::Other("empty"));
        }
        match (attribute(dataset, CLASS).as_deref(), dataset.dtype()) {
            (Some("char"), _) => Ok(Value::text_of_codes(&numbers(dataset)?)),
            (Some("cell"), _) => self.cells(dataset, depth),
            (Some("struct"), _) => Ok(Value::Other("an array of structs")),
            (_, Datatype::FixedPoint { .. } | Datatype::FloatingPoint { .. }) => {
                let values = numbers(dataset)?;
                // The last size is that of the neighbours in the file: MATLAB's first.
                let rows = dataset.shape().last().map_or(1, |rows| size(*rows));
                let columns = values.len() / rows.max(1);
                Ok(Value::Numbers(rows, columns, values))
            }
            (_, Datatype::String { .. } | Datatype::VarLen { .. }) => {
                let texts = dataset.read_strings().map_err(|e| damaged(&e))?;
                Ok(Value::Cells(texts.into_iter().map(Value::Text).collect()))
            }
            (_, Datatype::Compound { .. }) => Ok(Value::Other(
                "records or complex numbers; save each field, or the real part, as a vector",
            )),
            _ => Ok(Value::Other("neither numbers nor text")),
        }
    }

    /// Values to which the references of a cell array lead.
    fn cells(&self, dataset: &Dataset, depth: usize) -> Result<Value> {
        if depth > DEEPEST {
            return Err(format!("cells are nested more than {DEEPEST} deep"));
        }
        let bytes = dataset.read_native_bytes().map_err(|e| damaged(&e))?;
        let addresses = bytes.chunks_exact(self.address_bytes.max(1));
        let value = |bytes: &[u8]| {
            let address = bytes
                .iter()
                .rev()
                .fold(0, |sum, byte| sum << 8 | u64::from(*byte));
            match self.referred.get(&address) {
                Some(own) => self.dataset(own, depth + 1),
                None => Ok(Value::Other("a cell that is no array")),
            }
        };
        Ok(Value::Cells(addresses.map(value).collect::<Result<_>>()?))
    }
}

fn damaged(error: &Error) -> String {
    format!("it is an HDF5 file that cannot be read: {error}")
}

/// Text of an attribute.
fn attribute(dataset: &Dataset, name: &str) -> Option<String> {
    dataset.attribute(name).ok()?.read_string().ok()
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a size of what is in memory"
)]
fn size(size: u64) -> usize {
    size as usize
}

/// Numbers of any type, in the order of the file.
#[expect(
    clippy::cast_precision_loss,
    reason = "64-bit integers beyond 2^53 are no measurements"
)]
fn numbers(dataset: &Dataset) -> Result<Vec<f64>> {
    match dataset.dtype() {
        Datatype::FloatingPoint { size: 8, .. } => read(dataset, |v: f64| v),
        Datatype::FloatingPoint { size: 4, .. } => read(dataset, |v: f32| f64::from(v)),
        Datatype::FixedPoint { size, signed, .. } => match (size, signed) {
            (1, true) => read(dataset, |v: i8| f64::from(v)),
            (1, false) => read(dataset, |v: u8| f64::from(v)),
            (2, true) => read(dataset, |v: i16| f64::from(v)),
            (2, false) => read(dataset, |v: u16| f64::from(v)),
            (4, true) => read(dataset, |v: i32| f64::from(v)),
            (4, false) => read(dataset, |v: u32| f64::from(v)),
            (8, true) => read(dataset, |v: i64| v as f64),
            (8, false) => read(dataset, |v: u64| v as f64),
            _ => Err(format!("integers of {size} bytes")),
        },
        _ => Err("numbers of an unknown type".to_owned()),
    }
}

fn read<T: H5Type + Copy>(dataset: &Dataset, number: impl Fn(T) -> f64) -> Result<Vec<f64>> {
    let values = dataset.read_array::<T>().map_err(|e| damaged(&e))?;
    Ok(values.iter().map(|value| number(*value)).collect())
}
