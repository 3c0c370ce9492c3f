//! Units that harvest has: their names, other spellings, and the conversions between them.

use super::constants::{DEG, G0_FT_S2, M_PER_FT};
use super::quantity::{Dimensions, Quantity};

/// A unit as a recorder or an analyst spells it, with its factor to the quantity's base unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    pub name: &'static str,
    /// End of a signal's name that stands for this unit; signals are kept in units that have one.
    pub suffix: Option<&'static str>,
    pub quantity: Quantity,
    /// `true` for a unit in which no channel is recorded by mistake. With all units allowed, some
    /// factor of one channel would explain a usual mistake of another.
    pub is_rare: bool,
    /// Factor from values in this unit to values in the quantity's base unit.
    pub(super) factor: f64,
    /// Value in this unit of the zero of the base unit, with the opposite sign. It is added before
    /// the factor is applied.
    pub(super) offset: f64,
}

/// Unit of a quantity, without a zero of its own.
pub(super) const fn unit(
    name: &'static str,
    suffix: Option<&'static str>,
    quantity: Quantity,
    factor: f64,
) -> Unit {
    Unit {
        name,
        suffix,
        quantity,
        is_rare: false,
        factor,
        offset: 0.0,
    }
}

/// Unit in which no channel is recorded by mistake.
const fn rare(name: &'static str, quantity: Quantity, factor: f64) -> Unit {
    Unit {
        is_rare: true,
        ..unit(name, None, quantity, factor)
    }
}

/// Unit of temperature with a zero of its own.
const fn thermometer(name: &'static str, offset: f64, factor: f64) -> Unit {
    Unit {
        offset,
        ..unit(name, None, Quantity::Temperature, factor)
    }
}

/// Conversion of values: times a factor, plus an offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    pub factor: f64,
    pub offset: f64,
}

impl Conversion {
    /// Converted value.
    #[must_use]
    pub fn of(self, value: f64) -> f64 {
        // The sum with 0 would turn -0 into 0, that with -0 changes nothing.
        let offset = if self.offset == 0.0 {
            -0.0
        } else {
            self.offset
        };
        value * self.factor + offset
    }
}

/// Feet in a metre.
const FT: f64 = 1.0 / M_PER_FT;
/// Pounds-force in a newton (pound of 1959, standard gravity 9.80665 m/s²).
const LBF: f64 = 1.0 / 4.448_221_615_260_5;
/// Slugs in a kilogram.
const SLUG: f64 = 1.0 / 14.593_902_937_206;

/// Pounds-force per square foot in a pascal.
const PSF: f64 = LBF * M_PER_FT * M_PER_FT;
/// Pascals in an inch of mercury (conventional, NIST SP 811).
const INCH_OF_MERCURY_PA: f64 = 3386.389;
/// Pascals in a millimetre of mercury (conventional, NIST SP 811): 13,595.1 kg/m³ times standard
/// gravity times a millimetre.
const MILLIMETRE_OF_MERCURY_PA: f64 = 133.322_387_415;
/// Newtons in a kilogram-force: standard gravity.
const KILOGRAM_FORCE_N: f64 = 9.806_65;

/// All units. Signals are kept in the first unit of a quantity.
pub(super) const UNITS: &[Unit] = &[
    unit("deg", Some("_deg"), Quantity::Angle, 1.0),
    unit("rad", None, Quantity::Angle, DEG),
    rare("mrad", Quantity::Angle, 1e-3 * DEG),
    rare("arcmin", Quantity::Angle, 1.0 / 60.0),
    unit("deg/s", Some("_deg_s"), Quantity::AngularRate, 1.0),
    unit("rad/s", None, Quantity::AngularRate, DEG),
    unit(
        "deg/s2",
        Some("_deg_s2"),
        Quantity::AngularAcceleration,
        1.0,
    ),
    unit("rad/s2", None, Quantity::AngularAcceleration, DEG),
    unit("g", Some("_g"), Quantity::Acceleration, 1.0),
    unit("ft/s2", None, Quantity::Acceleration, 1.0 / G0_FT_S2),
    unit("m/s2", None, Quantity::Acceleration, FT / G0_FT_S2),
    rare("mg", Quantity::Acceleration, 1e-3),
    unit("ft/s", Some("_ft_s"), Quantity::Velocity, 1.0),
    unit("m/s", None, Quantity::Velocity, FT),
    unit("kt", None, Quantity::Velocity, 1852.0 / 3600.0 * FT),
    rare("km/h", Quantity::Velocity, FT / 3.6),
    rare("mph", Quantity::Velocity, 5280.0 / 3600.0),
    unit("ft", Some("_ft"), Quantity::Length, 1.0),
    unit("in", Some("_in"), Quantity::Length, 1.0 / 12.0),
    unit("m", None, Quantity::Length, FT),
    rare("cm", Quantity::Length, 0.01 * FT),
    rare("mm", Quantity::Length, 0.001 * FT),
    rare("km", Quantity::Length, 1000.0 * FT),
    rare("kft", Quantity::Length, 1000.0),
    unit("lbf/ft2", Some("_psf"), Quantity::Pressure, 1.0),
    unit("psf", None, Quantity::Pressure, 1.0),
    rare("psi", Quantity::Pressure, 144.0),
    unit("Pa", None, Quantity::Pressure, PSF),
    rare("hPa", Quantity::Pressure, 100.0 * PSF),
    rare("mbar", Quantity::Pressure, 100.0 * PSF),
    rare("bar", Quantity::Pressure, 1e5 * PSF),
    rare("kPa", Quantity::Pressure, 1000.0 * PSF),
    rare("inHg", Quantity::Pressure, INCH_OF_MERCURY_PA * PSF),
    rare("mmHg", Quantity::Pressure, MILLIMETRE_OF_MERCURY_PA * PSF),
    unit("lbf", Some("_lbf"), Quantity::Force, 1.0),
    rare("klbf", Quantity::Force, 1000.0),
    unit("N", None, Quantity::Force, LBF),
    rare("kN", Quantity::Force, 1000.0 * LBF),
    rare("daN", Quantity::Force, 10.0 * LBF),
    rare("kgf", Quantity::Force, KILOGRAM_FORCE_N * LBF),
    unit("slug", Some("_slug"), Quantity::Mass, 1.0),
    unit("lb", None, Quantity::Mass, 1.0 / G0_FT_S2),
    rare("klb", Quantity::Mass, 1000.0 / G0_FT_S2),
    unit("kg", None, Quantity::Mass, SLUG),
    rare("t", Quantity::Mass, 1000.0 * SLUG),
    unit("slug ft2", Some("_slug_ft2"), Quantity::Inertia, 1.0),
    unit("lb ft2", None, Quantity::Inertia, 1.0 / G0_FT_S2),
    unit("kg m2", None, Quantity::Inertia, SLUG * FT * FT),
    unit("slug/ft3", Some("_slug_ft3"), Quantity::Density, 1.0),
    unit("kg/m3", None, Quantity::Density, SLUG / (FT * FT * FT)),
    unit("K", Some("_kelvin"), Quantity::Temperature, 1.0),
    unit("degR", None, Quantity::Temperature, 1.0 / 1.8),
    thermometer("degC", 273.15, 1.0),
    thermometer("degF", 459.67, 1.0 / 1.8),
    unit("rpm", Some("_rpm"), Quantity::RotationalSpeed, 1.0),
    unit("s", Some("_s"), Quantity::Time, 1.0),
    unit("min", None, Quantity::Time, 60.0),
    unit("ms", None, Quantity::Time, 1e-3),
    unit("us", None, Quantity::Time, 1e-6),
    unit("ns", None, Quantity::Time, 1e-9),
    unit("-", None, Quantity::Number, 1.0),
    unit("0/1", None, Quantity::Number, 1.0),
    unit("%", None, Quantity::Number, 0.01),
];

/// Spellings of which the case matters: `grad` may be a gon, `T` a tesla.
const CASED_SPELLINGS: &[(&str, &str)] = &[
    ("G", "g"),
    ("Grad", "deg"),
    ("Grad/s", "deg/s"),
    ("Grad/sec", "deg/s"),
    ("Grad/s2", "deg/s2"),
    ("°R", "degR"),
    ("Kt", "kt"),
    ("KT", "kt"),
    ("C", "degC"),
    ("F", "degF"),
];

/// Units that are other units in another case: `Ns` is an impulse, `Ms` a million seconds.
const CASED: &[&str] = &["ms", "us", "ns"];

/// Other spellings of units, in lower case and without signs.
pub(super) const SPELLINGS: &[(&str, &str)] = &[
    ("degree", "deg"),
    ("degrees", "deg"),
    ("°", "deg"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("deg/sec", "deg/s"),
    ("degree/s", "deg/s"),
    ("degrees/s", "deg/s"),
    ("°/s", "deg/s"),
    ("dps", "deg/s"),
    ("rad/sec", "rad/s"),
    ("rps", "rad/s"),
    ("deg/sec2", "deg/s2"),
    ("rad/sec2", "rad/s2"),
    ("g's", "g"),
    ("gs", "g"),
    ("ft/sec", "ft/s"),
    ("fps", "ft/s"),
    ("mps", "m/s"),
    ("m/sec", "m/s"),
    ("ft/sec2", "ft/s2"),
    ("m/sec2", "m/s2"),
    ("kts", "kt"),
    ("ktas", "kt"),
    ("knoten", "kt"),
    ("kn", "kt"),
    ("knot", "kt"),
    ("knots", "kt"),
    ("kmh", "km/h"),
    ("mi/h", "mph"),
    ("kph", "km/h"),
    ("feet", "ft"),
    ("foot", "ft"),
    ("inch", "in"),
    ("inches", "in"),
    ("meter", "m"),
    ("meters", "m"),
    ("metre", "m"),
    ("metres", "m"),
    ("lb/ft2", "lbf/ft2"),
    ("lbs/ft2", "lbf/ft2"),
    ("lb/sqft", "lbf/ft2"),
    ("lbs/sqft", "lbf/ft2"),
    ("lbf/sqft", "lbf/ft2"),
    ("lbf/in2", "psi"),
    ("psia", "psi"),
    ("psid", "psi"),
    ("pascal", "Pa"),
    ("n/m2", "Pa"),
    ("millibar", "mbar"),
    ("mb", "mbar"),
    ("newton", "N"),
    ("kip", "klbf"),
    ("kp", "kgf"),
    ("kilopond", "kgf"),
    ("slugs", "slug"),
    ("lbm", "lb"),
    ("lbs", "lb"),
    ("kilogram", "kg"),
    ("kilograms", "kg"),
    ("tonne", "t"),
    ("tonnes", "t"),
    ("kelvin", "K"),
    ("rankine", "degR"),
    ("inhg", "inHg"),
    ("celsius", "degC"),
    ("degc", "degC"),
    ("°c", "degC"),
    ("fahrenheit", "degF"),
    ("degf", "degF"),
    ("°f", "degF"),
    ("rev/min", "rpm"),
    ("1/min", "rpm"),
    ("sec", "s"),
    ("sek", "s"),
    ("sekunde", "s"),
    ("sekunden", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("msec", "ms"),
    ("µs", "us"),
    ("usec", "us"),
    ("nsec", "ns"),
    ("1", "-"),
    ("nd", "-"),
    ("none", "-"),
    ("unitless", "-"),
    ("bool", "0/1"),
    ("boolean", "0/1"),
    ("u/min", "rpm"),
    ("percent", "%"),
    ("pct", "%"),
];

impl Unit {
    /// Unit of this name or another spelling of it. Capitals do not matter in a name of two letters
    /// or more, unless they make another unit of it.
    pub(super) fn named(text: &str) -> Option<Unit> {
        let written = plain(text);
        let of_name = |name: &str| UNITS.iter().find(|u| plain(u.name) == name).copied();
        let listed = |spellings: &[(&str, &str)], text: &str| {
            let spelling = spellings.iter().find(|(other, _)| *other == text);
            spelling.and_then(|(_, name)| of_name(&plain(name)))
        };
        let lower = written.to_lowercase();
        let is_sign = |c: char| matches!(c, ' ' | '*' | '.') || is_multiplication_dot(c);
        let is_one_word = written.chars().count() > 1 && !text.trim().contains(is_sign);
        let in_capitals = || {
            let is_same = |u: &&Unit| !CASED.contains(&u.name) && u.name.to_lowercase() == lower;
            UNITS.iter().find(is_same).copied()
        };
        of_name(&written)
            .or_else(|| listed(CASED_SPELLINGS, &written))
            .or_else(|| listed(SPELLINGS, &lower))
            .or_else(|| is_one_word.then(in_capitals).flatten())
    }

    /// Exponents of degree, foot, slug, second, kelvin and revolution.
    #[must_use]
    pub fn dimensions(self) -> Dimensions {
        self.quantity.dimensions().0
    }

    /// Conversion from values in this unit to the product of the base units of its dimensions.
    #[must_use]
    pub fn to_base(self) -> Conversion {
        let factor = self.factor * self.quantity.dimensions().1;
        Conversion {
            factor,
            offset: self.offset * factor,
        }
    }

    /// Conversion from the product of the base units of its dimensions to values in this unit.
    #[must_use]
    pub fn of_base(self) -> Conversion {
        Conversion {
            factor: 1.0 / self.to_base().factor,
            offset: -self.offset,
        }
    }

    /// Unit in which the signal of this name is kept: that of the longest suffix that fits; a pure
    /// number without a suffix.
    #[must_use]
    pub fn of_signal(signal: &str) -> Unit {
        let number = unit("-", None, Quantity::Number, 1.0);
        let length = |u: &Unit| u.suffix.map_or(0, str::len);
        UNITS
            .iter()
            .filter(|u| u.suffix.is_some_and(|s| signal.ends_with(s)))
            .max_by_key(|u| length(u))
            .copied()
            .unwrap_or(number)
    }

    /// `true` for the radian.
    #[must_use]
    pub fn is_radian(self) -> bool {
        self.name == "rad"
    }

    /// `true` for a pure number where the other unit is g: a load factor.
    #[must_use]
    pub fn is_load_factor_of(self, other: Unit) -> bool {
        self.name == "-" && other.name == "g"
    }

    /// `true` for the inch.
    #[must_use]
    pub fn is_inch(self) -> bool {
        self.name == "in"
    }

    /// `true` for deg/s, rad/s and other units of an angular rate.
    #[must_use]
    pub fn is_angular_rate(self) -> bool {
        self.quantity == Quantity::AngularRate
    }

    /// All units of the same quantity, this one included.
    pub fn alike(self) -> impl Iterator<Item = Unit> {
        UNITS
            .iter()
            .copied()
            .filter(move |u| u.quantity == self.quantity)
    }

    /// Factor from values in this unit to values in `target`; `None` for another quantity, and for
    /// a unit with another zero.
    #[must_use]
    pub fn factor_to(self, target: Unit) -> Option<f64> {
        let conversion = self.conversion_to(target)?;
        (conversion.offset == 0.0).then_some(conversion.factor)
    }

    /// Conversion from values in this unit to values in `target`; `None` for another quantity. A
    /// pound of a force is a pound-force.
    #[must_use]
    pub fn conversion_to(self, target: Unit) -> Option<Conversion> {
        let own = self.as_force_of(target);
        let factor = own.factor / target.factor;
        (own.quantity == target.quantity).then_some(Conversion {
            factor,
            offset: own.offset * factor - target.offset,
        })
    }

    /// The pound-force for a pound where the target is a force; any other unit as it is.
    fn as_force_of(self, target: Unit) -> Unit {
        match self.name {
            "lb" if target.quantity == Quantity::Force => unit("lb", None, Quantity::Force, 1.0),
            "klb" if target.quantity == Quantity::Force => rare("klb", Quantity::Force, 1000.0),
            _ => self,
        }
    }
}

/// A text without the characters that are ignored in a unit, with its exponents as digits.
pub(super) fn plain(text: &str) -> String {
    let is_sign = |c: &char| matches!(c, ' ' | '^' | '*' | '.') || is_multiplication_dot(*c);
    let text = text.chars().filter(|c| !is_sign(c));
    text.map(|c| superscript(c).unwrap_or(c)).collect()
}

/// `true` for a dot in the middle of the line: of these, ISO 80000 has the first.
pub(super) fn is_multiplication_dot(c: char) -> bool {
    matches!(c, '\u{22c5}' | '\u{b7}' | '\u{2219}' | '\u{2022}')
}

/// Digit or sign that a raised one stands for.
pub(super) fn superscript(c: char) -> Option<char> {
    let place = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺".chars().position(|raised| raised == c)?;
    "0123456789-+".chars().nth(place)
}
