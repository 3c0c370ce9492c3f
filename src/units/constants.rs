//! Constants of the units.

/// Degrees in a radian, R in the paper.
pub const DEG: f64 = 180.0 / std::f64::consts::PI;

/// Radians in a degree. Where every sample is converted, a product is faster than a quotient.
pub const RAD: f64 = std::f64::consts::PI / 180.0;

/// Unit g of an accelerometer, ft/s². Gravity at the aircraft is [`crate::earth::gravity_ft_s2`].
pub const G0_FT_S2: f64 = 32.174_049;

/// Metres in a foot, exactly (international foot of 1959).
pub const M_PER_FT: f64 = 0.304_8;
