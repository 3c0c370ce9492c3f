//! Air data from the velocity relative to the air, u v w: V² = u² + v² + w², tan α = w/u,
//! sin β = v/V, q̄ = ρV²/2.

use nalgebra::Vector3;

use crate::earth::air;

/// Limit of |α| and |β|, deg, beyond which the aircraft has departed: the flow comes from behind, and no
/// build-up is valid there.
pub const DEPARTURE_DEG: f64 = 90.0;

/// Air data at the c.g.; angles in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirData {
    pub velocity_ft_s: f64,
    pub alpha: f64,
    pub beta: f64,
    pub mach: f64,
    pub qbar_psf: f64,
}

impl AirData {
    /// Computes the air data of a velocity relative to the air in body axes, ft/s.
    #[must_use]
    pub fn new(relative: &Vector3<f64>, altitude_ft: f64) -> AirData {
        let air = air(altitude_ft);
        let velocity_ft_s = relative.norm().max(1e-6);
        AirData {
            velocity_ft_s,
            alpha: relative.z.atan2(relative.x),
            beta: (relative.y / velocity_ft_s).asin(),
            mach: velocity_ft_s / air.sound_ft_s,
            qbar_psf: 0.5 * air.density_slug_ft3 * velocity_ft_s * velocity_ft_s,
        }
    }

    /// Calibrated airspeed, kt, from Mach number and dynamic pressure in subsonic flight: the speed that
    /// has the same impact pressure at sea level. The static pressure is q̄/(0.7 M²).
    #[must_use]
    pub fn calibrated_kt(mach: f64, qbar_psf: f64) -> f64 {
        const FT_S_PER_KT: f64 = 6_076.115_486 / 3600.0;
        let sea_level = air(0.0);
        let pressure_psf = qbar_psf / (0.7 * mach * mach);
        let impact_psf = pressure_psf * ((1.0 + 0.2 * mach * mach).powf(3.5) - 1.0);
        let ratio = (impact_psf / sea_level.pressure_psf + 1.0).powf(2.0 / 7.0);
        sea_level.sound_ft_s * (5.0 * (ratio - 1.0)).sqrt() / FT_S_PER_KT
    }

    /// α̇, rad/s, of a velocity relative to still air that changes by this rate, both in body axes.
    #[must_use]
    pub fn alpha_rate(relative: &Vector3<f64>, rate: &Vector3<f64>) -> f64 {
        let (u, w) = (relative.x, relative.z);
        (u * rate.z - w * rate.x) / (u * u + w * w).max(f64::MIN_POSITIVE)
    }

    /// α̇, rad/s, of loads that depend on it. `implied` returns the α̇ of the motion under the
    /// loads at a given α̇, and is linear.
    #[must_use]
    pub fn alpha_rate_in_balance(mut implied: impl FnMut(f64) -> f64) -> f64 {
        let at_zero = implied(0.0);
        let slope = implied(1.0) - at_zero;
        at_zero / (1.0 - slope)
    }

    /// Velocity relative to the air in body axes from speed and flow angles, rad.
    #[must_use]
    pub fn velocity(speed_ft_s: f64, alpha: f64, beta: f64) -> Vector3<f64> {
        Vector3::new(
            alpha.cos() * beta.cos(),
            beta.sin(),
            alpha.sin() * beta.cos(),
        ) * speed_ft_s
    }
}
