//! Motion of the air at the aircraft.

use nalgebra::Vector3;

/// Straight path at a constant airspeed, with the instants at which gusts are drawn: multiples of `step_s`
/// from zero on.
#[derive(Clone, Copy, Debug)]
pub struct GustPath {
    pub speed_ft_s: f64,
    /// Span of the aircraft, over which gusts of roll are averaged.
    pub span_ft: f64,
    pub step_s: f64,
    pub count: usize,
}

/// Velocity and rotation of the air over the ground in body axes. The aerodynamics depend on the
/// velocities and rates of the aircraft less these; gyros and attitudes do not.
///
/// The air near the c.g. rotates like a rigid body with the gust gradients: `p_g` = ∂w/∂y, `q_g` =
/// −∂w/∂x, `r_g` = ∂v/∂x (x forward, y right, w down).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gust {
    /// u, v, w, ft/s.
    pub velocity: Vector3<f64>,
    /// `p_g`, `q_g`, `r_g`, rad/s.
    pub rates: Vector3<f64>,
}

impl Gust {
    /// Sum of two gusts.
    #[must_use]
    pub fn plus(&self, other: &Gust) -> Gust {
        Gust {
            velocity: self.velocity + other.velocity,
            rates: self.rates + other.rates,
        }
    }

    /// Interpolates linearly between this gust (0) and another (1).
    #[must_use]
    pub fn interpolated(&self, end: &Gust, fraction: f64) -> Gust {
        Gust {
            velocity: self.velocity.lerp(&end.velocity, fraction),
            rates: self.rates.lerp(&end.rates, fraction),
        }
    }
}
