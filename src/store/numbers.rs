//! Arrays of any numeric type as numbers.

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Decimal32Type, Decimal64Type, Decimal128Type, Decimal256Type, DurationMicrosecondType,
    DurationMillisecondType, DurationNanosecondType, DurationSecondType, Float16Type, Float32Type,
    Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, TimestampMicrosecondType,
    TimestampMillisecondType, TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, Float64Array};
use arrow_schema::{DataType, TimeUnit};

/// Converts an array of numbers, booleans or nulls; timestamps and durations become their ticks.
/// `None` for other types.
pub(super) fn numbers(array: &dyn Array) -> Option<Float64Array> {
    use DataType as D;
    macro_rules! converted {
        ($type:ty, $convert:expr) => {
            array
                .as_primitive_opt::<$type>()?
                .unary::<_, Float64Type>($convert)
        };
    }
    macro_rules! ticks {
        ($unit:expr, $second:ty, $milli:ty, $micro:ty, $nano:ty) => {
            match $unit {
                TimeUnit::Second => converted!($second, |v| v as f64),
                TimeUnit::Millisecond => converted!($milli, |v| v as f64),
                TimeUnit::Microsecond => converted!($micro, |v| v as f64),
                TimeUnit::Nanosecond => converted!($nano, |v| v as f64),
            }
        };
    }
    let of_scale = |scale: i8| 10_f64.powi(i32::from(scale));
    Some(match array.data_type() {
        D::Float64 => array.as_primitive_opt::<Float64Type>()?.clone(),
        D::Float32 => converted!(Float32Type, f64::from),
        D::Float16 => converted!(Float16Type, f64::from),
        D::Int8 => converted!(Int8Type, f64::from),
        D::Int16 => converted!(Int16Type, f64::from),
        D::Int32 => converted!(Int32Type, f64::from),
        D::Int64 => converted!(Int64Type, |v| v as f64),
        D::UInt8 => converted!(UInt8Type, f64::from),
        D::UInt16 => converted!(UInt16Type, f64::from),
        D::UInt32 => converted!(UInt32Type, f64::from),
        D::UInt64 => converted!(UInt64Type, |v| v as f64),
        D::Decimal32(_, scale) => converted!(Decimal32Type, |v| f64::from(v) / of_scale(*scale)),
        D::Decimal64(_, scale) => converted!(Decimal64Type, |v| v as f64 / of_scale(*scale)),
        D::Decimal128(_, scale) => converted!(Decimal128Type, |v| v as f64 / of_scale(*scale)),
        D::Decimal256(_, scale) => converted!(Decimal256Type, |v| {
            let (low, high) = v.wrapping_abs().to_parts();
            let size = high as f64 * TWO_TO_128 + low as f64;
            (if v.is_negative() { -size } else { size }) / of_scale(*scale)
        }),
        D::Boolean => {
            let values = array.as_boolean_opt()?.iter();
            values.map(|v| v.map(|v| f64::from(u8::from(v)))).collect()
        }
        D::Null => Float64Array::new_null(array.len()),
        D::Timestamp(unit, _) => ticks!(
            unit,
            TimestampSecondType,
            TimestampMillisecondType,
            TimestampMicrosecondType,
            TimestampNanosecondType
        ),
        D::Duration(unit) => ticks!(
            unit,
            DurationSecondType,
            DurationMillisecondType,
            DurationMicrosecondType,
            DurationNanosecondType
        ),
        _ => return None,
    })
}

/// 2¹²⁸: the weight of the upper half of a number of 256 bits.
const TWO_TO_128: f64 = 340_282_366_920_938_463_463_374_607_431_768_211_456.0;

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use arrow_array::{
        ArrayRef, BooleanArray, Decimal128Array, DurationMicrosecondArray, Float32Array, Int8Array,
        Int64Array, NullArray, StringArray, TimestampNanosecondArray, UInt64Array,
    };

    use super::*;

    #[test]
    fn every_numeric_type_becomes_numbers_and_nulls_stay() {
        let cases: [(ArrayRef, f64); 8] = [
            (Arc::new(Float32Array::from(vec![Some(0.25), None])), 0.25),
            (Arc::new(Int8Array::from(vec![Some(-3), None])), -3.0),
            (
                Arc::new(Int64Array::from(vec![Some(1 << 60), None])),
                2_f64.powi(60),
            ),
            (
                Arc::new(UInt64Array::from(vec![Some(u64::MAX), None])),
                2_f64.powi(64),
            ),
            (Arc::new(BooleanArray::from(vec![Some(true), None])), 1.0),
            (
                Arc::new(
                    Decimal128Array::from(vec![Some(-12_345), None])
                        .with_precision_and_scale(9, 2)
                        .unwrap(),
                ),
                -123.45,
            ),
            (
                Arc::new(TimestampNanosecondArray::from(vec![Some(7), None])),
                7.0,
            ),
            (
                Arc::new(DurationMicrosecondArray::from(vec![Some(-7), None])),
                -7.0,
            ),
        ];
        for (array, expected) in cases {
            let found = numbers(&array).unwrap();
            assert_eq!(found.value(0).to_bits(), f64::to_bits(expected));
            assert!(found.is_null(1), "{:?}", array.data_type());
        }
        assert_eq!(numbers(&NullArray::new(2)).unwrap().null_count(), 2);
        assert!(numbers(&StringArray::from(vec!["1"])).is_none());
    }

    #[test]
    fn a_negative_number_of_256_bits_keeps_its_sign() {
        let array = arrow_array::Decimal256Array::from(vec![number_of_256_bits(-150)]);
        let array = array.with_precision_and_scale(9, 1).unwrap();
        assert!((numbers(&array).unwrap().value(0) + 15.0).abs() < 1e-12);
    }

    /// A number of 256 bits.
    fn number_of_256_bits(
        number: i128,
    ) -> <Decimal256Type as arrow_array::ArrowPrimitiveType>::Native {
        let high = if number < 0 { -1 } else { 0 };
        <Decimal256Type as arrow_array::ArrowPrimitiveType>::Native::from_parts(
            number.cast_unsigned(),
            high,
        )
    }
}
