//! Products of units with exponents: `N m-1 s`, `m2/s2/K`.

use super::quantity::{BASE_NAMES, Dimensions};
use super::unit::{UNITS, Unit, is_multiplication_dot, plain, superscript};

/// Product of units with exponents: its dimensions, and the factor to the product of the base units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitProduct {
    pub dimensions: Dimensions,
    pub factor: f64,
}

impl UnitProduct {
    /// Parses a product of units, also one of a quantity that no signal has. Units after a slash
    /// divide; a hyphen before a letter multiplies, as in `slug-ft2`.
    #[must_use]
    pub fn parse(text: &str) -> Option<UnitProduct> {
        let (mut dimensions, mut factor) = ([0; 6], 1.0);
        let text = &without_hyphens(text);
        for (n, part) in text.split('/').enumerate() {
            let side = if n == 0 { 1 } else { -1 };
            let is_between =
                |c: char| matches!(c, ' ' | '*' | '.' | '(' | ')') || is_multiplication_dot(c);
            let words = part.split(is_between);
            let mut words = words.filter(|word| !word.is_empty()).peekable();
            words.peek()?;
            for word in words {
                let (unit, exponent) = power(word)?;
                let (own, base) = unit.quantity.dimensions();
                for (sum, own) in dimensions.iter_mut().zip(own) {
                    *sum += side * exponent * own;
                }
                factor *= (unit.factor * base).powi(side * exponent);
            }
        }
        Some(UnitProduct { dimensions, factor })
    }
}

/// Name of a quantity's first unit with these dimensions, or their product.
#[must_use]
pub fn name_of(dimensions: Dimensions) -> String {
    let kept = UNITS.iter().find(|u| u.dimensions() == dimensions);
    if let Some(kept) = kept {
        return kept.name.to_owned();
    }
    let factors = BASE_NAMES.iter().zip(dimensions).filter(|(_, n)| *n != 0);
    let factors = factors.map(|(name, exponent)| match exponent {
        1 => (*name).to_owned(),
        _ => format!("{name}{exponent}"),
    });
    factors.collect::<Vec<String>>().join(" ")
}

/// A text with a space for each hyphen between a unit and a letter.
fn without_hyphens(text: &str) -> String {
    let mut before = None;
    let mut rest = text.chars().peekable();
    let mut plain = String::with_capacity(text.len());
    while let Some(c) = rest.next() {
        let is_between = before.is_some_and(char::is_alphanumeric)
            && rest.peek().is_some_and(|c| c.is_alphabetic());
        plain.push(if c == '-' && is_between { ' ' } else { c });
        before = Some(c);
    }
    plain
}

/// A unit and its exponent: `s2`, `s^-2`.
fn power(word: &str) -> Option<(Unit, i32)> {
    if word == "1" {
        return Some((Unit::of_signal(""), 1));
    }
    let end = word
        .find(|c: char| c.is_ascii_digit() || "^-+".contains(c) || superscript(c).is_some())
        .unwrap_or(word.len());
    let (name, exponent) = word.split_at(end);
    let exponent = plain(exponent);
    let exponent = if exponent.is_empty() {
        1
    } else {
        exponent.parse().ok()?
    };
    // A product has no zero: degC in it could be a temperature or a difference.
    let has_no_zero = |unit: &Unit| unit.offset == 0.0;
    let unit = Unit::named(name).filter(has_no_zero)?;
    (-4..=4).contains(&exponent).then_some((unit, exponent))
}
