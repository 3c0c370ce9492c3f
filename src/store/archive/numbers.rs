//! Numbers of a column: the types that are numbers or times, and the factor of a clock's ticks.

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Field, Float64Type};

use crate::flight::Channel;
use crate::store::clock_column::{as_floats, tick_unit};
use crate::units::{Quantity, Unit};

/// Refuses a column whose type is neither a number nor, for a clock, a time.
pub(super) fn refuse_other_types(field: &Field, channel: &Channel) -> Result<(), String> {
    let found = field.data_type();
    let fits = found.is_numeric() || *found == DataType::Boolean || *found == DataType::Null;
    if fits || clock_factor(found, channel).is_some() {
        return Ok(());
    }
    let signal = channel.signal.as_str();
    let number = if Unit::of_signal(signal).quantity == Quantity::Time {
        "a number, a timestamp or a duration"
    } else {
        "a number (float, integer or boolean)"
    };
    let remedy = match found {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => {
            "; write its numbers as numbers, or import the recording from CSV (`harvest import`)"
        }
        _ => "",
    };
    Err(format!(
        "column `{}` (signal `{signal}`) is of type {found}; expected {number}{remedy}",
        field.name()
    ))
}

/// Factor from the ticks of timestamps and durations to the unit of the channel map.
pub(super) fn clock_factor(found: &DataType, channel: &Channel) -> Option<f64> {
    let mapped = Unit::parse(&channel.unit).ok()?;
    Unit::parse(tick_unit(found)?).ok()?.factor_to(mapped)
}

/// Passes an array on as numbers, a null as NaN.
pub(super) fn hand_over(
    array: &dyn Array,
    clock_factor: Option<f64>,
    sink: &mut dyn FnMut(&[f64]),
) -> Result<(), arrow::error::ArrowError> {
    if clock_factor.is_none()
        && array.null_count() == 0
        && let Some(plain) = array.as_primitive_opt::<Float64Type>()
    {
        sink(plain.values());
        return Ok(());
    }
    let plain = as_floats(array)?;
    let factor = clock_factor.unwrap_or(1.0);
    let mut numbers: Vec<f64> = plain
        .as_primitive::<Float64Type>()
        .values()
        .iter()
        .map(|v| v * factor)
        .collect();
    if let Some(nulls) = plain.nulls().filter(|n| n.null_count() > 0) {
        numbers
            .iter_mut()
            .zip(nulls)
            .filter(|(_, valid)| !valid)
            .for_each(|(number, _)| *number = f64::NAN);
    }
    sink(&numbers);
    Ok(())
}
