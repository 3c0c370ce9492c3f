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
    Acceleration,
    Velocity,
    Length,
    Pressure,
    Force,
    Mass,
    Inertia,
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
    /// Factor from values in this unit to values in the quantity's base unit.
    factor: f64,
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
        factor,
    }
}

/// Feet in a metre.
const FT: f64 = 1.0 / M_PER_FT;
/// Pounds-force in a newton (pound of 1959, standard gravity 9.80665 m/s²).
const LBF: f64 = 1.0 / 4.448_221_615_260_5;
/// Slugs in a kilogram.
const SLUG: f64 = 1.0 / 14.593_902_937_206;

/// All units. Signals are kept in the first unit of a quantity.
const UNITS: &[Unit] = &[
    unit("deg", Some("_deg"), Quantity::Angle, 1.0),
    unit("rad", None, Quantity::Angle, DEG),
    unit("deg/s", Some("_deg_s"), Quantity::AngularRate, 1.0),
    unit("rad/s", None, Quantity::AngularRate, DEG),
    unit("g", Some("_g"), Quantity::Acceleration, 1.0),
    unit("ft/s2", None, Quantity::Acceleration, 1.0 / G0_FT_S2),
    unit("m/s2", None, Quantity::Acceleration, FT / G0_FT_S2),
    unit("ft/s", Some("_ft_s"), Quantity::Velocity, 1.0),
    unit("m/s", None, Quantity::Velocity, FT),
    unit("kt", None, Quantity::Velocity, 1852.0 / 3600.0 * FT),
    unit("ft", Some("_ft"), Quantity::Length, 1.0),
    unit("in", Some("_in"), Quantity::Length, 1.0 / 12.0),
    unit("m", None, Quantity::Length, FT),
    unit("lbf/ft2", Some("_psf"), Quantity::Pressure, 1.0),
    unit("psf", None, Quantity::Pressure, 1.0),
    unit("Pa", None, Quantity::Pressure, LBF * M_PER_FT * M_PER_FT),
    unit("lbf", Some("_lbf"), Quantity::Force, 1.0),
    unit("N", None, Quantity::Force, LBF),
    unit("slug", Some("_slug"), Quantity::Mass, 1.0),
    unit("lb", None, Quantity::Mass, 1.0 / G0_FT_S2),
    unit("kg", None, Quantity::Mass, SLUG),
    unit("slug ft2", Some("_slug_ft2"), Quantity::Inertia, 1.0),
    unit("lb ft2", None, Quantity::Inertia, 1.0 / G0_FT_S2),
    unit("kg m2", None, Quantity::Inertia, SLUG * FT * FT),
    unit("rpm", Some("_rpm"), Quantity::RotationalSpeed, 1.0),
    unit("s", Some("_s"), Quantity::Time, 1.0),
    unit("ms", None, Quantity::Time, 1e-3),
    unit("us", None, Quantity::Time, 1e-6),
    unit("ns", None, Quantity::Time, 1e-9),
    unit("-", None, Quantity::Number, 1.0),
    unit("0/1", None, Quantity::Number, 1.0),
];

impl Unit {
    /// Parses a unit; spaces, `^`, `*` and a middle dot do not matter.
    ///
    /// # Errors
    /// A message with the names of all units, for an unknown unit.
    pub fn parse(text: &str) -> Result<Unit, String> {
        let plain = |s: &str| {
            s.chars()
                .filter(|c| !matches!(c, ' ' | '^' | '·' | '*'))
                .collect::<String>()
        };
        UNITS
            .iter()
            .find(|u| plain(u.name) == plain(text))
            .copied()
            .ok_or_else(|| {
                let names: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
                format!("unknown unit `{text}`; the units are {}", names.join(", "))
            })
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

    /// Factor from values in this unit to values in `target`; `None` for another quantity.
    #[must_use]
    pub fn factor_to(self, target: Unit) -> Option<f64> {
        (self.quantity == target.quantity).then_some(self.factor / target.factor)
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
        assert!(Unit::parse("degrees").is_err());
    }
}
