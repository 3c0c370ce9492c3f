//! Variables of a MATLAB 5 file (`-v6`, `-v7`).
//!
//! Layout: MAT-File Format, The MathWorks, 2024, chapter 1.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::columns::{DEEPEST, Value};

/// Largest size of a compressed variable after unpacking, bytes.
const LARGEST_VARIABLE: u64 = 4 << 30;

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

/// Flag of a matrix with an imaginary part.
const COMPLEX: u32 = 0x0800;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const TRUNCATED: &str = "the file ends within a variable: it was cut off";

/// Variables of a file.
pub fn variables(bytes: &[u8]) -> std::result::Result<Vec<(String, Value)>, String> {
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
    let flags = Reader {
        bytes: reader.next()?.data,
        is_little,
    }
    .word(0)?;
    let sizes = sizes(&reader.next()?, is_little)?;
    let name = text(reader.next()?.data);
    let count = sizes
        .iter()
        .try_fold(1_usize, |a, b| a.checked_mul(*b))
        .ok_or(TRUNCATED)?;
    let rows = sizes.first().copied().unwrap_or(0);
    let value = match flags & 0xff {
        1 => {
            let cells = (0..count.min(data.len()))
                .map(|_| Ok(matrix(reader.next()?.data, is_little, depth + 1)?.1));
            Value::Cells(cells.collect::<std::result::Result<_, String>>()?)
        }
        2 => structures(&mut reader, count, depth)?,
        4 => characters(&reader.next()?, is_little)?,
        6..=15 => {
            let values = numbers(&reader.next()?, is_little)?;
            if values.len() != count {
                return Err(format!(
                    "`{name}` has {} values for {count} places",
                    values.len()
                ));
            }
            let imaginary = if flags & COMPLEX == 0 {
                Vec::new()
            } else {
                numbers(&reader.next()?, is_little)?
            };
            if imaginary.iter().all(|part| *part == 0.0) {
                Value::Numbers(rows, count / rows.max(1), values)
            } else {
                Value::Other("complex numbers; save the real part")
            }
        }
        5 => Value::Other("a sparse matrix"),
        _ => Value::Other("an object; save its numbers as plain vectors"),
    };
    Ok((name, value))
}

/// Sizes of a matrix along its dimensions.
fn sizes(dimensions: &Element, is_little: bool) -> std::result::Result<Vec<usize>, String> {
    let dimensions = numbers(dimensions, is_little)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a size, checked against the data"
    )]
    let sizes = dimensions.iter().map(|d| d.max(0.0) as usize).collect();
    Ok(sizes)
}

/// Structs of an array, each with its fields; a single one as itself.
fn structures(
    reader: &mut Reader,
    count: usize,
    depth: usize,
) -> std::result::Result<Value, String> {
    let length = reader.next()?;
    let length = Reader {
        bytes: length.data,
        is_little: reader.is_little,
    }
    .word(0)? as usize;
    let names = reader.next()?.data;
    let names: Vec<String> = names.chunks(length.max(1)).map(text).collect();
    let mut structs = Vec::new();
    // A struct without fields has no bytes, and any count of them would be stated.
    for _ in 0..if names.is_empty() { 0 } else { count } {
        let field = |name: &String| {
            let element = reader.next()?;
            let value = matrix(element.data, reader.is_little, depth + 1)?.1;
            Ok((name.clone(), value))
        };
        let fields = names.iter().map(field);
        structs.push(Value::Struct(
            fields.collect::<std::result::Result<_, String>>()?,
        ));
    }
    Ok(match structs.pop() {
        Some(single) if structs.is_empty() => single,
        Some(last) => {
            structs.push(last);
            Value::Cells(structs)
        }
        None => Value::Other("an empty struct"),
    })
}

/// Text up to its first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Text of an element: bytes of UTF-8, or 16-bit codes.
fn characters(element: &Element, is_little: bool) -> std::result::Result<Value, String> {
    if matches!(element.kind, 1 | 2 | 16) {
        return Ok(Value::Text(text(element.data)));
    }
    Ok(Value::text_of_codes(&numbers(element, is_little)?))
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
