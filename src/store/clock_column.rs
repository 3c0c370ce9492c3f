//! Columns of numbers in a Parquet file, and those of a clock: timestamps and durations, in ticks.

use arrow::array::{Array, ArrayRef};
use arrow::compute::cast;
use arrow::datatypes::{DataType, TimeUnit};
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
    if is_clock(column.data_type()) {
        cast(&cast(column, &DataType::Int64)?, &DataType::Float64)
    } else {
        cast(column, &DataType::Float64)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use arrow::array::{AsArray, BooleanArray, DurationMicrosecondArray, StringArray};
    use arrow::datatypes::Float64Type;

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
}
