//! Units as they are written: a name, another spelling, or a product of units.

use super::product::UnitProduct;
use super::unit::{SPELLINGS, UNITS, Unit, plain, unit};

/// Largest relative difference of two factors of one unit: rounding.
const SAME: f64 = 1e-12;

impl Unit {
    /// Parses a unit, another spelling of one, or a product of units of a quantity that harvest
    /// has: `N m-1 s`. Spaces, `^`, `*` and a middle dot are ignored.
    ///
    /// # Errors
    /// A message with the names of all units, for an unknown unit.
    pub fn parse(text: &str) -> Result<Unit, String> {
        Unit::known(text).ok_or_else(|| {
            let names: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
            let names = names.join(", ");
            format!(
                "unknown unit `{text}`{}; the units are {names}, and products of them",
                reason(text)
            )
        })
    }

    /// Parses the unit of a channel of a signal that is kept in `target`.
    ///
    /// # Errors
    /// A message with the units of the signal's quantity, the nearest first, for an unknown unit.
    pub fn parse_for(text: &str, target: Unit) -> Result<Unit, String> {
        Unit::known(text).ok_or_else(|| {
            let names: Vec<&str> = target.alike().map(|u| u.name).collect();
            let near = nearest(text, target).map(|name| format!("; did you mean `{name}`?"));
            let near = near.unwrap_or_else(|| ";".to_owned());
            format!(
                "unknown unit `{text}`{}{near} units of its quantity are {}, and products of units",
                reason(text),
                names.join(", ")
            )
        })
    }

    /// Unit, or product of units, of this text.
    fn known(text: &str) -> Option<Unit> {
        Unit::named(text).or_else(|| Unit::product(text))
    }

    /// Product of units of a quantity that signals have.
    fn product(text: &str) -> Option<Unit> {
        let product = UnitProduct::parse(text)?;
        let kept = UNITS
            .iter()
            .find(|u| u.dimensions() == product.dimensions)?;
        let factor = product.factor / kept.quantity.dimensions().1;
        // `slug-ft2` is `slug ft2`.
        let is_same = |u: &&Unit| {
            u.quantity == kept.quantity && u.offset == 0.0 && (u.factor / factor - 1.0).abs() < SAME
        };
        let same = UNITS.iter().find(is_same).copied();
        Some(same.unwrap_or_else(|| unit("a product of units", None, kept.quantity, factor)))
    }

    /// `true` for a text that no unit of harvest has, and that is not refused for a reason.
    #[must_use]
    pub fn is_unknown(text: &str) -> bool {
        Unit::known(text).is_none() && reason(text).is_empty()
    }
}

/// Units that are refused because they are ambiguous, with the reason.
const REFUSED: &[(&str, &str)] = &[
    (
        "kias",
        "knots of indicated airspeed, which is no true airspeed: convert it by a formula, in which its unit is `kt`",
    ),
    (
        "kcas",
        "knots of calibrated airspeed, which is no true airspeed: convert it by a formula, in which its unit is `kt`",
    ),
    (
        "keas",
        "knots of equivalent airspeed, which is no true airspeed: convert it by a formula, in which its unit is `kt`",
    ),
    (
        "psig",
        "a pressure above the ambient one: add the ambient pressure by a formula, in which its unit is `psi`",
    ),
    (
        "ton",
        "a unit of 907, 1000 or 1016 kg: write `t` for 1000 kg, or give `scale`",
    ),
    ("grad", "a degree or a gon: write `deg`, or give `scale`"),
];

/// Reason why a unit is refused, in words; empty for a unit that is only unknown.
fn reason(text: &str) -> String {
    let lower = plain(text).to_lowercase();
    let refused = REFUSED.iter().find(|(name, _)| *name == lower);
    refused.map_or_else(String::new, |(_, reason)| format!(", {reason}"))
}

/// Least similarity of a suggestion, from 0 to 1: one letter more or less in a name of three.
const SIMILAR: f64 = 0.7;

/// Unit of a quantity with the name or spelling that is most similar to a text (Jaro and Winkler), if
/// one is.
fn nearest(text: &str, target: Unit) -> Option<&'static str> {
    let lower = plain(text).to_lowercase();
    if lower.len() > LONGEST_NAME {
        return None;
    }
    let is_alike = |name: &str| target.alike().any(|u| u.name == name);
    let spellings = SPELLINGS.iter().filter(|(_, name)| is_alike(name));
    let names = target.alike().map(|u| (u.name, u.name));
    let similarity = |name: &str| strsim::jaro_winkler(&lower, &name.to_lowercase());
    let scored = names
        .chain(spellings.copied())
        .map(|(written, name)| (similarity(written), name));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(score, _)| *score > SIMILAR)
        .map(|(_, name)| name)
}

/// Longest text that is compared, bytes: no unit is longer.
const LONGEST_NAME: usize = 40;
