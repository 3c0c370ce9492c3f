//! Physical quantities and their dimensions.

use super::constants::G0_FT_S2;

/// Exponents of degree, foot, slug, second, kelvin and revolution.
pub type Dimensions = [i32; 6];

/// Names of the units whose exponents are [`Dimensions`].
pub(super) const BASE_NAMES: [&str; 6] = ["deg", "ft", "slug", "s", "K", "rev"];

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

impl Quantity {
    /// Dimensions, and the factor from the base unit of the quantity to the product of degree, foot, slug,
    /// second, kelvin and revolution.
    pub(super) fn dimensions(self) -> (Dimensions, f64) {
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
