//! Columns of numbers in a Parquet file, and those of a clock: timestamps and durations, in ticks.

use std::sync::Arc;

use arrow::array::{Array, ArrayRef, ArrowPrimitiveType, AsArray};
use arrow::compute::cast;
use arrow::datatypes::{
    DataType, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, TimeUnit, UInt8Type,
    UInt16Type, UInt32Type,
};
use arrow::error::ArrowError;

/// Unit of a clock's ticks; `None` for a column that is no clock.
#[must_use]
pub(super) fn tick_unit(kind: &DataType) -> Option<&'static str> {
    let (DataType::Timestamp(tick, _) | DataType::Duration(tick)) = kind else {
        return None;
    };
    Some(match tick {
        TimeUnit::Second => "s",
        TimeUnit::Millisecond => "ms",
        TimeUnit::Microsecond => "us",
        TimeUnit::Nanosecond => "ns",
    })
}

/// `true` for timestamps and durations.
#[must_use]
pub(super) fn is_clock(kind: &DataType) -> bool {
    tick_unit(kind).is_some()
}

/// Column as 64-bit floats; that of a clock in its ticks. A text that is no number is a null.
///
/// # Errors
/// A column of a type that has no numbers.
pub(super) fn as_floats(column: &dyn Array) -> Result<ArrayRef, ArrowError> {
    Ok(match column.data_type() {
        kind if is_clock(kind) => cast(&cast(column, &DataType::Int64)?, &DataType::Float64)?,
        DataType::Float32 => widened::<Float32Type>(column),
        DataType::Int8 => widened::<Int8Type>(column),
        DataType::Int16 => widened::<Int16Type>(column),
        DataType::Int32 => widened::<Int32Type>(column),
        DataType::UInt8 => widened::<UInt8Type>(column),
        DataType::UInt16 => widened::<UInt16Type>(column),
        DataType::UInt32 => widened::<UInt32Type>(column),
        _ => cast(column, &DataType::Float64)?,
    })
}

/// Column of a narrower type of numbers, compiled here: `cast` is built without optimisation, and recorders
/// have many such columns.
fn widened<T: ArrowPrimitiveType>(column: &dyn Array) -> ArrayRef
where
    f64: From<T::Native>,
{
    let narrow = column.as_primitive::<T>();
    Arc::new(narrow.unary::<_, Float64Type>(f64::from))
}

#[cfg(test)]
mod tests {
    use arrow::array::{
        BooleanArray, DurationMicrosecondArray, Float32Array, Float64Array, Int8Array, Int16Array,
        Int32Array, StringArray, UInt8Array, UInt16Array, UInt32Array,
    };

    use super::*;

    #[test]
    fn a_clock_is_read_in_its_ticks_and_other_columns_as_numbers() {
        let clock: ArrayRef = Arc::new(DurationMicrosecondArray::from(vec![25_000, 50_000]));
        assert_eq!(tick_unit(clock.data_type()), Some("us"));
        let read = as_floats(&clock).unwrap();
        assert_eq!(
            read.as_primitive::<Float64Type>().values(),
            &[25_000.0, 50_000.0]
        );
        let flag: ArrayRef = Arc::new(BooleanArray::from(vec![true, false]));
        assert!(!is_clock(flag.data_type()));
        let read = as_floats(&flag).unwrap();
        assert_eq!(read.as_primitive::<Float64Type>().values(), &[1.0, 0.0]);
        let text = StringArray::from(vec!["up"]);
        assert!(as_floats(&text).unwrap().is_null(0));
    }

    #[test]
    fn every_type_of_numbers_is_read_as_arrow_casts_it_with_its_nulls() {
        let columns: [ArrayRef; 8] = [
            Arc::new(Int8Array::from(vec![Some(i8::MIN), None])),
            Arc::new(Int16Array::from(vec![Some(i16::MIN), None])),
            Arc::new(Int32Array::from(vec![Some(i32::MIN), None])),
            Arc::new(UInt8Array::from(vec![Some(u8::MAX), None])),
            Arc::new(UInt16Array::from(vec![Some(u16::MAX), None])),
            Arc::new(UInt32Array::from(vec![Some(u32::MAX), None])),
            Arc::new(Float32Array::from(vec![Some(0.1), None])),
            Arc::new(Float64Array::from(vec![Some(0.1), None])),
        ];
        for column in columns {
            let expected = cast(&column, &DataType::Float64).unwrap();
            assert_eq!(&as_floats(&column).unwrap(), &expected);
            assert!(expected.is_null(1));
        }
    }
}
