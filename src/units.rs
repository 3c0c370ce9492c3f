//! Units of channels, signals and table columns, and the factors between them.
//!
//! Inside the equations angles are radians and everything else is foot, slug, second, pound-force.
//! A signal's unit is the end of its name (`alpha_vane_deg`, `qbar_psf`). A channel's unit is stated
//! in the channel map.

/// Degrees in a radian, R in the paper.
pub const DEG: f64 = 180.0 / std::f64::consts::PI;

/// Radians in a degree. Where every sample is converted, a product is faster than a quotient.
pub const RAD: f64 = std::f64::consts::PI / 180.0;

/// Unit g of an accelerometer, ft/s². Gravity at the aircraft is [`crate::earth::gravity_ft_s2`].
pub const G0_FT_S2: f64 = 32.174_049;

/// Metres in a foot, exactly (international foot of 1959).
pub const M_PER_FT: f64 = 0.304_8;

/// Physical quantity of a unit. Units of one quantity convert into each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    Angle,
    AngularRate,
    AngularAcceleration,
    Acceleration,
    Velocity,
    Length,
    Pressure,
    Force,
    Mass,
    Inertia,
    Density,
    Temperature,
    RotationalSpeed,
    Time,
    Number,
}

/// A unit as a recorder or an analyst spells it, with its factor to the quantity's base unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    pub name: &'static str,
    /// End of a signal's name that stands for this unit; signals are kept in units that have one.
    pub suffix: Option<&'static str>,
    pub quantity: Quantity,
    /// No channel is taken to be recorded in it by mistake: with every unit there is, some factor of one channel
    /// explains what another channel's usual mistake does.
    pub is_rare: bool,
    /// Factor from values in this unit to values in the quantity's base unit.
    factor: f64,
    /// Value in this unit of the zero of the base unit, with the opposite sign. It is added before
    /// the factor is applied.
    offset: f64,
}

const fn unit(
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
        // The sum with zero would turn -0 into 0.
        if self.offset == 0.0 {
            value * self.factor
        } else {
            value * self.factor + self.offset
        }
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

/// All units. Signals are kept in the first unit of a quantity.
const UNITS: &[Unit] = &[
    unit("deg", Some("_deg"), Quantity::Angle, 1.0),
    unit("rad", None, Quantity::Angle, DEG),
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
    unit("ft/s", Some("_ft_s"), Quantity::Velocity, 1.0),
    unit("m/s", None, Quantity::Velocity, FT),
    unit("kt", None, Quantity::Velocity, 1852.0 / 3600.0 * FT),
    rare("km/h", Quantity::Velocity, FT / 3.6),
    unit("ft", Some("_ft"), Quantity::Length, 1.0),
    unit("in", Some("_in"), Quantity::Length, 1.0 / 12.0),
    unit("m", None, Quantity::Length, FT),
    rare("cm", Quantity::Length, 0.01 * FT),
    rare("mm", Quantity::Length, 0.001 * FT),
    rare("km", Quantity::Length, 1000.0 * FT),
    unit("lbf/ft2", Some("_psf"), Quantity::Pressure, 1.0),
    unit("psf", None, Quantity::Pressure, 1.0),
    rare("psi", Quantity::Pressure, 144.0),
    unit("Pa", None, Quantity::Pressure, PSF),
    rare("hPa", Quantity::Pressure, 100.0 * PSF),
    rare("mbar", Quantity::Pressure, 100.0 * PSF),
    rare("kPa", Quantity::Pressure, 1000.0 * PSF),
    rare("inHg", Quantity::Pressure, INCH_OF_MERCURY_PA * PSF),
    unit("lbf", Some("_lbf"), Quantity::Force, 1.0),
    rare("klbf", Quantity::Force, 1000.0),
    unit("N", None, Quantity::Force, LBF),
    rare("kN", Quantity::Force, 1000.0 * LBF),
    unit("slug", Some("_slug"), Quantity::Mass, 1.0),
    unit("lb", None, Quantity::Mass, 1.0 / G0_FT_S2),
    unit("kg", None, Quantity::Mass, SLUG),
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

/// Other spellings of units, in lower case and without signs.
const SPELLINGS: &[(&str, &str)] = &[
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
    ("kn", "kt"),
    ("knot", "kt"),
    ("knots", "kt"),
    ("kmh", "km/h"),
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
    ("lbf/in2", "psi"),
    ("pascal", "Pa"),
    ("n/m2", "Pa"),
    ("millibar", "mbar"),
    ("mb", "mbar"),
    ("newton", "N"),
    ("kip", "klbf"),
    ("slugs", "slug"),
    ("lbm", "lb"),
    ("lbs", "lb"),
    ("kilogram", "kg"),
    ("kelvin", "K"),
    ("rankine", "degR"),
    ("celsius", "degC"),
    ("°c", "degC"),
    ("fahrenheit", "degF"),
    ("°f", "degF"),
    ("rev/min", "rpm"),
    ("1/min", "rpm"),
    ("sec", "s"),
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
    ("percent", "%"),
    ("pct", "%"),
];

/// Exponents of degree, foot, slug, second, kelvin and revolution.
pub type Dimensions = [i32; 6];

/// Names of the units whose exponents are [`Dimensions`].
const BASE_NAMES: [&str; 6] = ["deg", "ft", "slug", "s", "K", "rev"];

/// Product of units with exponents: its dimensions, and the factor to the product of the base units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Product {
    pub dimensions: Dimensions,
    pub factor: f64,
}

impl Product {
    /// Parses a product of units, also one of a quantity that no signal has. What stands behind a
    /// slash divides.
    #[must_use]
    pub fn parse(text: &str) -> Option<Product> {
        let (mut dimensions, mut factor) = ([0; 6], 1.0);
        for (n, part) in text.split('/').enumerate() {
            let side = if n == 0 { 1 } else { -1 };
            let words = part.split([' ', '*', '·', '.', '(', ')']);
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
        Some(Product { dimensions, factor })
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

impl Quantity {
    /// Dimensions, and the factor from the base unit of the quantity to the product of degree, foot, slug,
    /// second, kelvin and revolution.
    fn dimensions(self) -> (Dimensions, f64) {
        match self {
            Quantity::Angle => ([1, 0, 0, 0, 0, 0], 1.0),
            Quantity::AngularRate => ([1, 0, 0, -1, 0, 0], 1.0),
            Quantity::AngularAcceleration => ([1, 0, 0, -2, 0, 0], 1.0),
            Quantity::Acceleration => ([0, 1, 0, -2, 0, 0], G0_FT_S2),
            Quantity::Velocity => ([0, 1, 0, -1, 0, 0], 1.0),
            Quantity::Length => ([0, 1, 0, 0, 0, 0], 1.0),
            Quantity::Pressure => ([0, -1, 1, -2, 0, 0], 1.0),
            Quantity::Force => ([0, 1, 1, -2, 0, 0], 1.0),
            Quantity::Mass => ([0, 0, 1, 0, 0, 0], 1.0),
            Quantity::Inertia => ([0, 2, 1, 0, 0, 0], 1.0),
            Quantity::Density => ([0, -3, 1, 0, 0, 0], 1.0),
            Quantity::Temperature => ([0, 0, 0, 0, 1, 0], 1.0),
            Quantity::RotationalSpeed => ([0, 0, 0, -1, 0, 1], 1.0 / 60.0),
            Quantity::Time => ([0, 0, 0, 1, 0, 0], 1.0),
            Quantity::Number => ([0; 6], 1.0),
        }
    }
}

/// A text without the signs that do not matter in a unit.
fn plain(text: &str) -> String {
    let is_sign = |c: &char| matches!(c, ' ' | '^' | '·' | '*' | '.');
    let digit = |c: char| match c {
        '²' => '2',
        '³' => '3',
        c => c,
    };
    text.chars().filter(|c| !is_sign(c)).map(digit).collect()
}

/// A unit and its exponent: `s2`, `s^-2`.
fn power(word: &str) -> Option<(Unit, i32)> {
    if word == "1" {
        return Some((Unit::of_signal(""), 1));
    }
    let end = word
        .find(|c: char| c.is_ascii_digit() || "^-+²³".contains(c))
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

impl Unit {
    /// Parses a unit, another spelling of one, or a product of units of a quantity that harvest has:
    /// `N m-1 s`. Spaces, `^`, `*` and a middle dot do not matter otherwise.
    ///
    /// # Errors
    /// A message with the names of all units, for an unknown unit.
    pub fn parse(text: &str) -> Result<Unit, String> {
        Unit::named(text)
            .or_else(|| Unit::product(text))
            .ok_or_else(|| {
                let names: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
                format!(
                    "unknown unit `{text}`; the units are {}, and products of them",
                    names.join(", ")
                )
            })
    }

    fn named(text: &str) -> Option<Unit> {
        let written = plain(text);
        let of_name = |name: &str| UNITS.iter().find(|u| plain(u.name) == name).copied();
        let spelling = || {
            let lower = written.to_lowercase();
            let spelling = SPELLINGS.iter().find(|(other, _)| *other == lower);
            spelling.and_then(|(_, name)| of_name(&plain(name)))
        };
        of_name(&written).or_else(spelling)
    }

    /// Product of units of a quantity that signals have.
    fn product(text: &str) -> Option<Unit> {
        let product = Product::parse(text)?;
        let kept = UNITS
            .iter()
            .find(|u| u.dimensions() == product.dimensions)?;
        let factor = product.factor / kept.quantity.dimensions().1;
        Some(unit("a product of units", None, kept.quantity, factor))
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

    /// Unit in which the signal of this name is kept: that of the longest suffix that fits, a pure
    /// number without one.
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

    /// All units of the same quantity, this one among them.
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

    /// Conversion from values in this unit to values in `target`; `None` for another quantity.
    #[must_use]
    pub fn conversion_to(self, target: Unit) -> Option<Conversion> {
        let factor = self.factor / target.factor;
        (self.quantity == target.quantity).then_some(Conversion {
            factor,
            offset: self.offset * factor - target.offset,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn factor(from: &str, signal: &str) -> Option<f64> {
        Unit::parse(from)
            .expect("a known unit")
            .factor_to(Unit::of_signal(signal))
    }

    #[test]
    fn factors_are_those_of_the_definitions() {
        for (from, signal, expected) in [
            ("rad", "alpha_vane_deg", 57.295_779_513_082_32),
            ("rad/s", "q_deg_s", 57.295_779_513_082_32),
            ("m/s", "velocity_ft_s", 3.280_839_895_013_123),
            ("kt", "velocity_ft_s", 1.687_809_857_101_196),
            ("m/s2", "an_g", 1.0 / 9.806_650_135_2),
            ("Pa", "qbar_psf", 0.020_885_434_233_1),
            ("N", "thrust_lbf", 0.224_808_943_099_7),
            ("kg", "mass_slug", 0.068_521_765_85),
            ("kg m2", "iy_slug_ft2", 0.737_562_149_3),
            ("lb", "mass_slug", 0.031_080_95),
            ("in", "stick_pitch_in", 1.0),
            ("deg", "alpha_vane_deg", 1.0),
            ("km/h", "velocity_ft_s", 0.911_344_415_281_423),
            ("hPa", "qbar_psf", 2.088_543_423_315_0),
            ("inHg", "qbar_psf", 70.726_201),
            ("psi", "qbar_psf", 144.0),
            ("kg/m3", "density_slug_ft3", 0.001_940_320_331_980),
            ("klbf", "thrust_lbf", 1000.0),
            ("rad/s2", "qdot_deg_s2", 57.295_779_513_082_32),
            ("degR", "air_kelvin", 5.0 / 9.0),
            ("%", "lever", 0.01),
            ("Degrees", "alpha_vane_deg", 1.0),
            ("knots", "velocity_ft_s", 1.687_809_857_101_196),
            ("ft/sec^2", "an_g", 1.0 / 32.174_049),
            // Products: N s²/m is kg, lbf s²/ft is slug, N m s² is kg m².
            ("N s2/m", "mass_slug", 0.068_521_765_85),
            ("lbf s^2/ft", "mass_slug", 1.0),
            ("N m s2", "iy_slug_ft2", 0.737_562_149_3),
            ("kN/m2", "qbar_psf", 20.885_434_233_1),
            ("m min-1", "velocity_ft_s", 3.280_839_895_013_123 / 60.0),
        ] {
            assert_relative_eq!(
                factor(from, signal).expect(from),
                expected,
                max_relative = 1e-7
            );
        }
    }

    #[test]
    fn the_longest_suffix_names_the_unit() {
        assert_eq!(Unit::of_signal("q_deg_s").name, "deg/s");
        assert_eq!(Unit::of_signal("velocity_ft_s").name, "ft/s");
        assert_eq!(Unit::of_signal("ixz_slug_ft2").name, "slug ft2");
        assert_eq!(Unit::of_signal("mach").name, "-");
    }

    #[test]
    fn quantities_do_not_convert_into_each_other() {
        assert_eq!(factor("deg/s", "alpha_vane_deg"), None);
        // A torque is a product of units, but of a quantity that no signal has.
        for unknown in ["furlong", "N m", "deg//s", "", "m^9", "J/kg/degC"] {
            assert!(Unit::parse(unknown).is_err(), "{unknown}");
        }
    }

    #[test]
    fn thermometers_have_zeros_of_their_own() {
        let kelvin = |unit: &str, value: f64| {
            let unit = Unit::parse(unit).expect("a known unit");
            let into = unit.conversion_to(Unit::of_signal("air_kelvin"));
            into.expect("a temperature").of(value)
        };
        // Boiling water, 373.15 K; the scales of Celsius and Fahrenheit meet at -40.
        assert_relative_eq!(kelvin("degC", 100.0), 373.15);
        assert_relative_eq!(kelvin("°F", 212.0), 373.15, max_relative = 1e-12);
        assert_relative_eq!(
            kelvin("Celsius", -40.0),
            kelvin("degF", -40.0),
            max_relative = 1e-12
        );
        assert_eq!(factor("degC", "air_kelvin"), None);
        let [celsius, fahrenheit] =
            ["degC", "degF"].map(|name| Unit::parse(name).expect("a known unit"));
        for unit in [celsius, fahrenheit] {
            assert_eq!(unit.factor_to(unit), Some(1.0));
            let there = unit.to_base().of(15.0);
            assert_relative_eq!(unit.of_base().of(there), 15.0, max_relative = 1e-12);
        }
        let celsius = fahrenheit.conversion_to(celsius).expect("a temperature");
        assert_relative_eq!(celsius.of(59.0), 15.0, max_relative = 1e-12);
    }

    #[test]
    fn a_product_of_no_quantity_has_its_dimensions() {
        // The gas constant of air, 287.05 J/(kg K), is 1716.6 ft lbf/(slug degR).
        let gas = Product::parse("m2/s2/K").expect("a product");
        assert_eq!(gas.dimensions, [0, 2, 0, -2, -1, 0]);
        assert_relative_eq!(287.05 * gas.factor / 1.8, 1716.6, max_relative = 1e-4);
        assert_eq!(name_of(gas.dimensions), "ft2 s-2 K-1");
        assert_eq!(name_of([0, -1, 1, -2, 0, 0]), "lbf/ft2");
        assert!(Product::parse("m2/degC").is_none());
    }
}
