//! Numbers of a column: the types that are numbers or times, and the factor of a clock's ticks.

use arrow::array::{Array, AsArray};
use arrow::buffer::NullBuffer;
use arrow::datatypes::{DataType, Field, Float64Type};
use arrow::error::ArrowError;

use crate::flight::Channel;
use crate::numerics::vectors::simd::vectorised;
use crate::store::clock_column::{as_floats, tick_unit};
use crate::units::{Quantity, Unit};

/// Nulls in a word of their bits.
const WORD: usize = u64::BITS as usize;

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

/// Passes an array on as numbers, a null as NaN. The memory of `numbers` is used again from one array of a
/// column to the next.
pub(super) fn hand_over(
    array: &dyn Array,
    clock_factor: Option<f64>,
    numbers: &mut Vec<f64>,
    sink: &mut dyn FnMut(&[f64]),
) -> Result<(), ArrowError> {
    let floats = as_floats(array)?;
    let floats = floats.as_primitive::<Float64Type>();
    let nulls = floats.nulls().filter(|nulls| nulls.null_count() > 0);
    if clock_factor.is_none() && nulls.is_none() {
        sink(floats.values());
        return Ok(());
    }
    let factor = clock_factor.unwrap_or(1.0);
    numbers.clear();
    numbers.extend(floats.values().iter().map(|value| value * factor));
    if let Some(nulls) = nulls {
        blank(numbers, nulls);
    }
    sink(numbers);
    Ok(())
}

/// Sets the numbers of nulls to NaN.
fn blank(numbers: &mut [f64], nulls: &NullBuffer) {
    let words = nulls.inner().bit_chunks();
    vectorised(
        #[inline(always)]
        || {
            for (numbers, valid) in numbers.chunks_mut(WORD).zip(words.iter_padded()) {
                // Without branches, for the vectors.
                for (k, number) in numbers.iter_mut().enumerate() {
                    *number = if valid >> k & 1 == 1 {
                        *number
                    } else {
                        f64::NAN
                    };
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use arrow::array::{Float64Array, Int16Array, TimestampMillisecondArray};

    use super::*;

    fn handed_over(array: &dyn Array, clock_factor: Option<f64>) -> Vec<f64> {
        let (mut numbers, mut all) = (vec![], vec![]);
        let mut keep = |handed: &[f64]| all.extend_from_slice(handed);
        hand_over(array, clock_factor, &mut numbers, &mut keep).unwrap();
        all
    }

    #[test]
    fn nulls_become_nan_wherever_they_lie_and_all_other_numbers_stay() {
        for (every, count) in [(1, 70), (2, 64), (7, 300), (400, 129)] {
            let value = |k: usize| (k % every == every - 1).then_some(k as f64 - 3.5);
            let array: Float64Array = (0..count).map(value).collect();
            // A slice begins in the middle of a word of the nulls.
            for (offset, array) in [(0, array.clone()), (5, array.slice(5, count - 5))] {
                let numbers = handed_over(&array, None);
                let found: Vec<_> = numbers
                    .into_iter()
                    .map(|v| Some(v).filter(|v| !v.is_nan()))
                    .collect();
                let expected: Vec<_> = (offset..count).map(value).collect();
                assert_eq!(found, expected);
            }
        }
        let whole = Int16Array::from(vec![-3, 4]);
        assert_eq!(handed_over(&whole, None), [-3.0, 4.0]);
    }

    #[test]
    fn ticks_of_a_clock_become_its_unit() {
        let ticks = TimestampMillisecondArray::from(vec![Some(25), None]);
        let numbers = handed_over(&ticks, Some(1e-3));
        assert_abs_diff_eq!(numbers[0], 0.025, epsilon = 1e-15);
        assert!(numbers[1].is_nan());
    }
}
