//! Numbers rounded to some significant digits.

/// Powers of ten that a floating-point number holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Distance from the middle between two neighbours, in the sixth digit, up to which the notation
/// decides: far beyond the rounding error of the scaled value.
const NEAR_MIDDLE: f64 = 1e-6;

/// A number with three significant digits.
#[must_use]
pub fn rounded(value: f64) -> String {
    let digits = format!("{value:.2e}");
    digits
        .parse()
        .map_or(digits, |number: f64| number.to_string())
}

/// A number with six significant digits, rounded as its decimal notation is.
#[must_use]
pub fn with_six_digits(value: f64) -> f64 {
    scaled_to_six_digits(value).unwrap_or_else(|| format!("{value:.5e}").parse().unwrap_or(value))
}

/// [`with_six_digits`] by a power of ten in place of the notation; `None` where the two might
/// differ. Integer and power are exact, so their quotient is the number nearest to the decimal
/// fraction.
fn scaled_to_six_digits(value: f64) -> Option<f64> {
    let size = value.abs();
    if size >= 1e6 {
        return None;
    }
    let power = EXACT_POWERS.iter().find(|power| size * **power >= 1e5)?;
    let scaled = size * power;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and below 10⁶"
    )]
    let below = f64::from(scaled as u32);
    let beyond_middle = scaled - below - 0.5;
    if beyond_middle.abs() < NEAR_MIDDLE {
        return None;
    }
    let nearest = if beyond_middle > 0.0 {
        below + 1.0
    } else {
        below
    };
    Some((nearest / power).copysign(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits_are_those_of_the_notation() {
        let notation = |value: f64| format!("{value:.5e}").parse::<f64>().unwrap();
        let special = [
            0.0,
            -0.0,
            f64::INFINITY,
            1.0,
            999_999.5,
            999_999.4,
            1e6,
            1e5,
            0.1,
            1e-17,
            1e-18,
            1e300,
            5e-324,
            123_456.5,
            1.234_565,
            0.999_999_5,
            2.5e-5,
            0.001,
            99_999.95,
        ];
        let spread = (0..20_000).map(|k| {
            let k = f64::from(k);
            (k * 0.7).sin() * 10.0_f64.powf(8.0 * (k * 0.013).cos())
        });
        let middles = (100_000..101_000).map(|k| (f64::from(k) + 0.5) / 1e5);
        for value in special.into_iter().chain(spread).chain(middles) {
            for value in [value, -value, value.next_up(), value.next_down()] {
                let (found, expected) = (with_six_digits(value), notation(value));
                assert_eq!(found.to_bits(), expected.to_bits(), "{value:e}");
            }
        }
        assert!(with_six_digits(f64::NAN).is_nan());
    }
}
