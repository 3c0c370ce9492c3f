//! Notation of the field: derivatives with subscripts, units in words, numbers with significant
//! digits, outcomes in words.

use minijinja::HtmlEscape;

use crate::aero::{Axis, Coefficient, DerivativeUnit};
use crate::tables::Outcome;
use crate::units::Unit;

/// Dash in place of a missing value.
pub const DASH: &str = "\u{2013}";

/// Outcome of a fit in words.
#[must_use]
pub fn outcome_in_words(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::NotConverged => "did not converge",
        other => other.name(),
    }
}

/// Coefficient of a derivative named `<coefficient>_<regressor>`; `None` for a bias.
#[must_use]
pub fn coefficient_of(name: &str) -> Option<Coefficient> {
    let (prefix, _) = name.split_once('_')?;
    [Axis::Longitudinal, Axis::Lateral]
        .into_iter()
        .flat_map(Axis::coefficients)
        .find(|coefficient| format!("{coefficient:?}") == prefix)
}

/// Symbol of a derivative in HTML: C with a subscript, δ for surfaces, Greek angles. A bias keeps
/// its name.
#[must_use]
pub fn symbol(name: &str) -> String {
    let (Some(_), Some((prefix, regressor))) = (coefficient_of(name), name.split_once('_')) else {
        return escaped(name);
    };
    let coefficient = prefix.strip_prefix('C').unwrap_or(prefix);
    format!(
        "C<sub>{}{}</sub>",
        escaped(coefficient),
        escaped(&regressor_symbol(regressor))
    )
}

fn regressor_symbol(regressor: &str) -> String {
    match regressor {
        "alpha" => "α".to_owned(),
        "beta" => "β".to_owned(),
        _ => match regressor.strip_prefix('d') {
            Some(surface) if !surface.is_empty() => format!("δ{surface}"),
            _ if regressor.len() > 1 => format!("_{regressor}"),
            _ => regressor.to_owned(),
        },
    }
}

/// Text escaped for HTML.
#[must_use]
pub fn escaped(text: &str) -> String {
    HtmlEscape(text).to_string()
}

/// A page without characters that XML forbids or that reorder a line: names of files may hold them.
#[must_use]
pub fn well_formed(page: String) -> String {
    let is_forbidden = |c: char| {
        c.is_control() && !matches!(c, '\t' | '\n' | '\r')
            || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}')
    };
    if page.contains(is_forbidden) {
        page.replace(is_forbidden, "\u{fffd}")
    } else {
        page
    }
}

/// Unit of a derivative in words; empty for a pure number.
#[must_use]
pub fn unit(word: &str) -> String {
    let unit = DerivativeUnit::from_word(word);
    unit.map_or_else(|| word.to_owned(), |unit| unit.typeset().to_owned())
}

/// Name of a signal without the unit suffix.
#[must_use]
pub fn without_unit(signal: &str) -> &str {
    Unit::of_signal(signal)
        .suffix
        .and_then(|suffix| signal.strip_suffix(suffix))
        .unwrap_or(signal)
}

/// Writes a number with `significant` digits and a typographic minus; a dash if it is missing or
/// not finite.
#[must_use]
pub fn number(value: Option<f64>, significant: usize) -> String {
    let Some(value) = value.filter(|v| v.is_finite()) else {
        return DASH.to_owned();
    };
    Digits::for_values([value], significant).write(Some(value))
}

/// A number with `decimals` decimals; a dash if not finite.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    Digits::Decimals(decimals).write(Some(value))
}

/// Angle of attack in whole degrees if within 0.05° of one, else with one decimal.
#[must_use]
pub fn angle(alpha_deg: f64) -> String {
    let whole = (alpha_deg - alpha_deg.round()).abs() < 0.05;
    format!("{}°", fixed(alpha_deg, usize::from(!whole)))
}

/// A number with its noun: `1 maneuver`, `2 maneuvers`.
#[must_use]
pub fn count(n: usize, noun: &str) -> String {
    if n == 1 {
        format!("1 {noun}")
    } else {
        format!("{n} {noun}s")
    }
}

/// Form of all numbers of a column, so that their decimal points align.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    Decimals(usize),
    Scientific(usize),
}

impl Digits {
    /// Form in which the largest value shows `significant` digits.
    #[must_use]
    pub fn for_values(values: impl IntoIterator<Item = f64>, significant: usize) -> Digits {
        let largest = values
            .into_iter()
            .filter(|v| v.is_finite())
            .fold(0.0_f64, |m, v| m.max(v.abs()));
        if largest == 0.0 {
            return Digits::Decimals(0);
        }
        let shown = i32::try_from(significant).unwrap_or(i32::MAX);
        let magnitude = power_of_ten(largest);
        let decimals = shown.saturating_sub(1).saturating_sub(magnitude);
        match usize::try_from(decimals) {
            Ok(decimals) if decimals <= 8 => Digits::Decimals(decimals),
            Err(_) if magnitude < 9 => Digits::Decimals(0),
            _ => Digits::Scientific(significant.saturating_sub(1)),
        }
    }

    /// Form for tick labels that need a number of decimals; scientific beyond six.
    #[must_use]
    pub fn of_ticks(decimals: usize) -> Digits {
        if decimals <= 6 {
            Digits::Decimals(decimals)
        } else {
            Digits::Scientific(1)
        }
    }

    /// Writes a number in this form; a dash if missing or not finite.
    #[must_use]
    pub fn write(self, value: Option<f64>) -> String {
        let Some(value) = value.filter(|v| v.is_finite()) else {
            return DASH.to_owned();
        };
        let text = match self {
            Digits::Decimals(decimals) => format!("{value:.decimals$}"),
            Digits::Scientific(decimals) => format!("{value:.decimals$e}"),
        };
        let zero = text
            .trim_start_matches('-')
            .chars()
            .all(|c| matches!(c, '0' | '.'));
        if zero {
            text.trim_start_matches('-').to_owned()
        } else {
            text.replace('-', "\u{2212}")
        }
    }
}

/// Power of ten of the first digit of a positive finite number.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the logarithm of a finite number is within ±324"
)]
#[must_use]
pub fn power_of_ten(value: f64) -> i32 {
    value.log10().floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_have_the_symbols_of_the_field() {
        for (name, html) in [
            ("CN_alpha", "C<sub>Nα</sub>"),
            ("Cn_beta", "C<sub>nβ</sub>"),
            ("Cm_dpv", "C<sub>mδpv</sub>"),
            ("CA_0", "C<sub>A0</sub>"),
            ("CN_ba", "C<sub>N_ba</sub>"),
            ("an_bias", "an_bias"),
            ("CX_<b>", "CX_&lt;b&gt;"),
            ("CN_<b>", "C<sub>N_&lt;b&gt;</sub>"),
        ] {
            assert_eq!(symbol(name), html);
        }
    }

    #[test]
    fn numbers_show_significant_digits_and_missing_ones_a_dash() {
        assert_eq!(number(Some(-0.012_345), 3), "\u{2212}0.0123");
        assert_eq!(number(Some(12_345.6), 3), "12346");
        assert_eq!(number(Some(0.0), 3), "0");
        assert_eq!(number(Some(1.2e-12), 3), "1.20e\u{2212}12");
        assert_eq!(number(Some(f64::NAN), 3), DASH);
        assert_eq!(number(Some(f64::NEG_INFINITY), 3), DASH);
        assert_eq!(number(None, 3), DASH);
        assert_eq!(fixed(-0.001, 1), "0.0");
        assert_eq!(angle(29.98), "30°");
        assert_eq!(angle(29.5), "29.5°");
    }
}
