//! Levels of the repository's specification.

use super::fixture::specification;
use crate::qualities::levels::level;
use crate::qualities::specification::{AirplaneClass, Category, Specification};
use crate::tables::{FlyingQuality, Level};

fn found(specification: &Specification, paragraph: &str, values: &[(FlyingQuality, f64)]) -> Level {
    let mut all = specification.requirements.iter();
    let requirement = all.find(|r| r.paragraph == paragraph).unwrap();
    level(specification, requirement, values)
}

#[test]
fn short_period_damping_has_the_levels_of_table_iv() {
    for (category, damping, expected) in [
        (Category::A, 0.35, Level::One),
        (Category::A, 1.3, Level::One),
        (Category::A, 1.31, Level::Two),
        (Category::A, 0.34, Level::Two),
        (Category::A, 0.24, Level::Three),
        (Category::A, 0.14, Level::Worse),
        (Category::A, 2.1, Level::Three),
        (Category::A, f64::NAN, Level::Worse),
        (Category::B, 0.31, Level::One),
        (Category::B, 0.29, Level::Two),
        (Category::C, 0.31, Level::Two),
    ] {
        let specification = Specification {
            category,
            ..specification()
        };
        let values = [(FlyingQuality::ShortPeriodDamping, damping)];
        assert_eq!(
            found(&specification, "3.2.2.1.2", &values),
            expected,
            "{damping}"
        );
    }
}

#[test]
fn limits_follow_the_class_of_the_aircraft() {
    for (class, constant, expected) in [
        (AirplaneClass::Maneuverable, 0.9, Level::One),
        (AirplaneClass::Maneuverable, 1.2, Level::Two),
        (AirplaneClass::Maneuverable, 2.0, Level::Three),
        (AirplaneClass::Heavy, 1.2, Level::One),
        (AirplaneClass::Heavy, 2.0, Level::Two),
        (AirplaneClass::Maneuverable, f64::INFINITY, Level::Worse),
    ] {
        let specification = Specification {
            class,
            ..specification()
        };
        let values = [(FlyingQuality::RollTimeConstant, constant)];
        assert_eq!(found(&specification, "3.3.1.2", &values), expected);
    }
}

/// Dutch roll of a frequency of 2.5 rad/s.
fn dutch_roll(decay: f64, phi_beta: f64) -> [(FlyingQuality, f64); 4] {
    let frequency = 2.5;
    [
        (FlyingQuality::DutchRollFrequency, frequency),
        (FlyingQuality::DutchRollDamping, decay / frequency),
        (FlyingQuality::DutchRollDecay, decay),
        (
            FlyingQuality::DutchRollBank,
            frequency * frequency * phi_beta,
        ),
    ]
}

#[test]
fn a_dutch_roll_that_rolls_much_needs_more_damping() {
    let specification = specification();
    let level = |decay, phi_beta| {
        let values = dutch_roll(decay, phi_beta);
        found(&specification, "3.3.1.1", &values)
    };
    assert_eq!(level(0.50, 1.0), Level::One);
    // ω²|φ/β| = 50: 0.35 + 0.014 · 30 = 0.77, and 0.05 + 0.009 · 30 = 0.32 at Level 2.
    assert_eq!(level(0.76, 8.0), Level::Two);
    assert_eq!(level(0.78, 8.0), Level::One);
    assert_eq!(level(0.31, 8.0), Level::Three);
    // Level 3 has no minimum of its own and rises from zero: 0.005 · 30 = 0.15.
    assert_eq!(level(0.151, 8.0), Level::Three);
    assert_eq!(level(0.149, 8.0), Level::Worse);
    assert_eq!(level(0.01, 1.0), Level::Three);
    // Damping ratio below 0.19.
    assert_eq!(level(0.40, 1.0), Level::Two);
    assert_eq!(level(-0.1, 1.0), Level::Worse);
}

#[test]
fn a_mode_that_does_not_exist_has_no_limit() {
    let specification = specification();
    assert_eq!(found(&specification, "3.3.1.2", &[]), Level::One);
    let coupled = [(FlyingQuality::RollSpiralDecay, 0.6)];
    assert_eq!(found(&specification, "3.3.1.4", &coupled), Level::Worse);
    let loiter = Specification {
        category: Category::B,
        ..specification
    };
    assert_eq!(found(&loiter, "3.3.1.4", &coupled), Level::One);
}

#[test]
fn a_phugoid_that_diverges_slowly_is_level_3() {
    let specification = specification();
    for (damping, time, expected) in [
        (0.05, f64::INFINITY, Level::One),
        (0.03, f64::INFINITY, Level::Two),
        (-0.01, 60.0, Level::Three),
        (-0.1, 50.0, Level::Worse),
    ] {
        let values = [
            (FlyingQuality::PhugoidDamping, damping),
            (FlyingQuality::PhugoidTimeToDouble, time),
        ];
        assert_eq!(
            found(&specification, "3.2.1.2", &values),
            expected,
            "{damping}"
        );
    }
}
