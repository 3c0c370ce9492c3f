//! Standard atmosphere of the checks, over geometric altitude taken for geopotential.

use crate::units::M_PER_FT;

/// Density (slug/ft³) and speed of sound (ft/s) of the standard atmosphere up to 20 km; NaN where
/// it has none.
pub fn atmosphere(altitude_ft: f64) -> (f64, f64) {
    const KG_M3: f64 = 515.378_818;
    const GAS: f64 = 287.052_87;
    let h = altitude_ft * M_PER_FT;
    let temperature = (288.15 - 0.006_5 * h).max(216.65);
    let pressure = if h < 11_000.0 {
        101_325.0 * (temperature / 288.15).powf(5.255_88)
    } else {
        22_632.06 * (-(h - 11_000.0) / 6_341.62).exp()
    };
    (
        pressure / (GAS * temperature) / KG_M3,
        (1.4 * GAS * temperature).sqrt() / M_PER_FT,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_atmosphere_is_the_standard_one() {
        for (altitude, density, sound) in [
            (0.0, 2.376_9e-3, 1116.45),
            (25_000.0, 1.065_5e-3, 1016.1),
            (45_000.0, 4.622_7e-4, 968.08),
        ] {
            let (rho, a) = atmosphere(altitude);
            // The tables are over geometric altitude, the formula takes it for geopotential.
            assert_relative_eq!(rho, density, max_relative = 5e-3);
            assert_relative_eq!(a, sound, max_relative = 1e-3);
        }
    }
}
