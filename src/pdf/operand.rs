//! Operands of PDF operators: numbers and colours.

use std::fmt::{Display, Formatter, Result, Write};

/// Red, green and blue.
pub type Colour = [u8; 3];

/// A number with at most two decimals, as short as possible.
#[derive(Clone, Copy)]
pub struct Number(pub f32);

/// Number of hundredths that a 64-bit integer holds with certainty.
const MOST_HUNDREDTHS: f64 = 1e15;

/// Characters of the longest number of hundredths, with sign and point.
const LONGEST: usize = 18;

impl Number {
    /// Appends the number. Without a format string in between, a path of many points is written in less time.
    pub fn write_to(self, text: &mut impl Write) -> Result {
        let hundredths = (100.0 * f64::from(self.0)).round();
        if hundredths == 0.0 || !hundredths.is_finite() {
            return text.write_str("0");
        }
        if hundredths.abs() > MOST_HUNDREDTHS {
            return write!(text, "{}", hundredths / 100.0);
        }
        #[expect(clippy::cast_possible_truncation, reason = "limited above")]
        let hundredths = hundredths as i64;
        text.write_str(decimal(hundredths, &mut [0; LONGEST]))
    }
}

impl Display for Number {
    fn fmt(&self, f: &mut Formatter) -> Result {
        self.write_to(f)
    }
}

/// Writes hundredths as a decimal number. Its digits are those of an integer, which are found several times
/// as fast as those of a fraction.
fn decimal(hundredths: i64, characters: &mut [u8; LONGEST]) -> &str {
    let mut rest = hundredths.unsigned_abs();
    let mut decimals = 2;
    while decimals > 0 && rest.is_multiple_of(10) {
        rest /= 10;
        decimals -= 1;
    }
    let mut first = LONGEST;
    let mut put = |character| {
        first -= 1;
        characters[first] = character;
    };
    // From the last digit to the first, at least to that of the ones.
    for place in 0.. {
        if place == decimals && decimals > 0 {
            put(b'.');
        }
        put(b'0' + (rest % 10) as u8);
        rest /= 10;
        if rest == 0 && place >= decimals {
            break;
        }
    }
    if hundredths < 0 {
        put(b'-');
    }
    str::from_utf8(&characters[first..]).unwrap_or_default()
}

/// A colour as three numbers from 0 to 1.
pub struct Rgb(pub Colour);

impl Display for Rgb {
    fn fmt(&self, f: &mut Formatter) -> Result {
        let [red, green, blue] = self.0.map(|value| Number(f32::from(value) / 255.0));
        write!(f, "{red} {green} {blue}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_possible() {
        let written =
            [0.0, -0.001, 1.5, 12.345, -3.0, f32::NAN].map(|value| Number(value).to_string());
        assert_eq!(written, ["0", "0", "1.5", "12.35", "-3", "0"]);
        for k in -300..300 {
            let value = 0.37 * k as f32;
            let plain = format!("{value:.2}");
            let short = plain.trim_end_matches('0').trim_end_matches('.');
            assert_eq!(Number(value).to_string(), if k == 0 { "0" } else { short });
        }
        for large in [-9.9e12, 1e20_f32] {
            assert_eq!(Number(large).to_string(), f64::from(large).to_string());
        }
    }
}
