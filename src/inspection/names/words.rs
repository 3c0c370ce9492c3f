//! Names of columns as words, and the unit that a name states.

use crate::units::Unit;

/// Words of a name, in lower case: parts between signs, changes of case, and brackets.
#[must_use]
pub fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let starts = c.is_uppercase() && before.is_lowercase();
        if starts || !c.is_alphanumeric() {
            words.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Ends of names that state a unit, longest first, with the unit.
const ENDINGS: &[(&[&str], &str)] = &[
    (&["slug", "ft2"], "slug ft2"),
    (&["kg", "m2"], "kg m2"),
    (&["deg", "s"], "deg/s"),
    (&["deg", "sec"], "deg/s"),
    (&["rad", "s"], "rad/s"),
    (&["rad", "sec"], "rad/s"),
    (&["ft", "s2"], "ft/s2"),
    (&["ft", "s"], "ft/s"),
    (&["m", "s2"], "m/s2"),
    (&["m", "s"], "m/s"),
    (&["km", "h"], "km/h"),
    (&["degs"], "deg/s"),
    (&["dps"], "deg/s"),
    (&["rads"], "rad/s"),
    (&["rps"], "rad/s"),
    (&["deg"], "deg"),
    (&["rad"], "rad"),
    (&["fps"], "ft/s"),
    (&["mps"], "m/s"),
    (&["ms2"], "m/s2"),
    (&["mss"], "m/s2"),
    (&["fts2"], "ft/s2"),
    (&["kts"], "kt"),
    (&["kt"], "kt"),
    (&["knots"], "kt"),
    (&["kmh"], "km/h"),
    (&["ft"], "ft"),
    (&["feet"], "ft"),
    (&["m"], "m"),
    (&["gs"], "g"),
    (&["g"], "g"),
    (&["psf"], "lbf/ft2"),
    (&["pa"], "Pa"),
    (&["kpa"], "kPa"),
    (&["hpa"], "hPa"),
    (&["psi"], "psi"),
    (&["lbf"], "lbf"),
    (&["n"], "N"),
    (&["kn"], "kN"),
    (&["slug"], "slug"),
    (&["slugs"], "slug"),
    (&["kg"], "kg"),
    (&["lb"], "lb"),
    (&["lbs"], "lb"),
    (&["in"], "in"),
    (&["inch"], "in"),
    (&["mm"], "mm"),
    (&["cm"], "cm"),
    (&["rpm"], "rpm"),
    (&["pct"], "%"),
    (&["percent"], "%"),
    (&["sec"], "s"),
    (&["s"], "s"),
    (&["ms"], "ms"),
    (&["us"], "us"),
    (&["ns"], "ns"),
];

/// A name without the unit at its end, and that unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Spelling {
    /// Words without the unit.
    pub words: Vec<String>,
    /// Unit that the name states.
    pub unit: Option<Unit>,
    /// `true` if the unit is the end `_m`, which may also mean measured.
    pub may_be_measured: bool,
}

impl Spelling {
    /// Splits a name: `Pitch Rate [deg/s]`, `pitch_rate_deg_s`, `pitchRateDps`.
    #[must_use]
    pub fn of(name: &str) -> Spelling {
        if let Some((head, unit)) = bracketed(name) {
            return Spelling {
                words: words(head),
                unit: Some(unit),
                may_be_measured: false,
            };
        }
        let mut words = words(name);
        let ending = ENDINGS.iter().find(|(ending, _)| {
            words.len() > ending.len()
                && words
                    .iter()
                    .rev()
                    .zip(ending.iter().rev())
                    .all(|(a, b)| a == b)
        });
        let unit = ending.and_then(|(ending, unit)| {
            words.truncate(words.len() - ending.len());
            Unit::parse(unit).ok()
        });
        let may_be_measured = ending.is_some_and(|(ending, _)| *ending == ["m"]);
        Spelling {
            words,
            unit,
            may_be_measured,
        }
    }

    /// All words in one.
    #[must_use]
    pub fn joined(&self) -> String {
        self.words.concat()
    }

    #[must_use]
    pub fn has(&self, word: &str) -> bool {
        self.words.iter().any(|w| w == word)
    }
}

/// Name and unit of a column that has its unit in brackets.
fn bracketed(name: &str) -> Option<(&str, Unit)> {
    let open = name.find(['[', '(', '{'])?;
    let (head, rest) = name.split_at(open);
    let inside = rest.get(1..)?.trim_end_matches([']', ')', '}', ' ']);
    Some((head, Unit::parse(inside).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_split_into_its_words_and_its_unit() {
        for (name, words, unit) in [
            ("Pitch Rate [deg/s]", "pitch rate", Some("deg/s")),
            ("pitch_rate_rad_s", "pitch rate", Some("rad/s")),
            ("pitchRateDps", "pitch rate", Some("deg/s")),
            ("V", "v", None),
            ("VTAS_mps", "vtas", Some("m/s")),
            ("m", "m", None),
            ("x_cg_ft", "x cg", Some("ft")),
            ("IYY (kg m2)", "iyy", Some("kg m2")),
            ("stick_pitch", "stick pitch", None),
        ] {
            let spelling = Spelling::of(name);
            assert_eq!(spelling.words.join(" "), words, "{name}");
            assert_eq!(spelling.unit.map(|u| u.name), unit, "{name}");
        }
    }
}
