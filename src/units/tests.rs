//! Factors from the definitions of the units, and what converts into what.

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
        ("arcmin", "theta_deg", 1.0 / 60.0),
        ("mg", "ax_g", 0.001),
        ("klb", "mass_slug", 31.080_95),
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
fn units_agree_with_relations_that_do_not_define_them() {
    for (one, factor_of_one, other, signal) in [
        // The standard atmosphere, and an inch.
        (1.013_25, "bar", (760.0, "mmHg"), "qbar_psf"),
        (1.013_25, "bar", (2_116.216_6, "psf"), "qbar_psf"),
        (1_013.25, "MBAR", (14.695_949, "psia"), "qbar_psf"),
        (25.4, "mmHg", (1.0, "inHg"), "qbar_psf"),
        // Weights of masses in standard gravity.
        (1.0, "kgf", (9.806_65, "kg m/s2"), "thrust_lbf"),
        (1.0, "kgf", (2.204_622_6, "lbf"), "thrust_lbf"),
        (0.980_665, "daN", (1.0, "kp"), "thrust_lbf"),
        (1.0, "lb", (0.453_592_37, "kgf"), "thrust_lbf"),
        (1.0, "klb", (1.0, "klbf"), "thrust_lbf"),
        (1.0, "t", (2_204.622_6, "lb"), "mass_slug"),
        (1.0, "tonne", (68.521_766, "slug"), "mass_slug"),
        (60.0, "mph", (88.0, "ft/s"), "velocity_ft_s"),
        (1.0, "mph", (0.868_976_24, "KTAS"), "velocity_ft_s"),
        (1.852, "km/h", (1.0, "Kt"), "velocity_ft_s"),
        (36.089_239, "kft", (11.0, "km"), "altitude_ft"),
        (
            1_000.0 * std::f64::consts::PI,
            "mrad",
            (180.0, "Grad"),
            "theta_deg",
        ),
        (17.453_292_5, "mrad/s", (1.0, "Grad/s"), "q_deg_s"),
        (9.806_65, "m·s⁻²", (1.0, "G"), "an_g"),
        (1.0, "m⋅s⁻¹", (3.6, "km/h"), "velocity_ft_s"),
        (1.0, "kg·m²", (1.0, "N·m·s²"), "iy_slug_ft2"),
        (1.0, "kg·m⁻³", (1.0, "KG/M3"), "density_slug_ft3"),
        (1.8, "°R", (1.0, "Kelvin"), "air_kelvin"),
        (1.0, "FT/SEC", (0.304_8, "M/S"), "velocity_ft_s"),
        (60.0, "Sek", (1.0, "MIN"), "time_s"),
    ] {
        let (other, factor_of_other) = other;
        let [a, b] = [factor_of_one, factor_of_other].map(|u| factor(u, signal).expect(u));
        assert_relative_eq!(one * a, other * b, max_relative = 1e-6);
    }
}

#[test]
fn what_is_ambiguous_or_unknown_is_refused_with_the_nearest_unit() {
    for (unit, signal, words) in [
        ("KCAS", "velocity_ft_s", "calibrated airspeed"),
        ("KIAS", "velocity_ft_s", "indicated airspeed"),
        ("psig", "qbar_psf", "above the ambient one"),
        ("ton", "mass_slug", "907, 1000 or 1016 kg"),
        ("hPas", "qbar_psf", "did you mean `hPa`?"),
        ("knt", "velocity_ft_s", "did you mean `kt`?"),
        ("furlong", "altitude_ft", "are ft, in, m, cm, mm, km, kft,"),
    ] {
        let what = Unit::parse_for(unit, Unit::of_signal(signal)).unwrap_err();
        assert!(what.contains(words), "{what}");
        assert!(Unit::parse(unit).is_err(), "{unit}");
    }
    for other in ["grad", "T", "N s", "M", "k"] {
        assert!(Unit::parse(other).is_err(), "{other}");
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
    let gas = UnitProduct::parse("m2/s2/K").expect("a product");
    assert_eq!(gas.dimensions, [0, 2, 0, -2, -1, 0]);
    assert_relative_eq!(287.05 * gas.factor / 1.8, 1716.6, max_relative = 1e-4);
    assert_eq!(name_of(gas.dimensions), "ft2 s-2 K-1");
    assert_eq!(name_of([0, -1, 1, -2, 0, 0]), "lbf/ft2");
    assert!(UnitProduct::parse("m2/degC").is_none());
}

#[test]
fn a_product_that_is_a_unit_has_its_name_and_hyphens_multiply() {
    for (text, name) in [
        ("SLUG-FT2", "slug ft2"),
        ("slug-ft^2", "slug ft2"),
        ("C", "degC"),
        ("DEG F", "degF"),
        ("IN HG", "inHg"),
        ("lb/sqft", "lbf/ft2"),
    ] {
        assert_eq!(
            Unit::parse(text).map(|u| u.name).as_deref(),
            Ok(name),
            "{text}"
        );
    }
    assert!(Unit::is_unknown("Altgrad") && !Unit::is_unknown("KCAS") && !Unit::is_unknown("deg"));
}
