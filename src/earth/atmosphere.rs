//! The standard atmosphere (ISA, 1976) to 65,000 ft: ρ = p/(R T) with a linear and then a constant
//! temperature.

use crate::units::M_PER_FT;

/// Density and speed of sound at a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    pub density_slug_ft3: f64,
    pub sound_ft_s: f64,
}

/// kg/m³ in a slug/ft³.
const DENSITY: f64 = 515.378_818_393_2;
/// J/(kg K).
const GAS: f64 = 287.052_87;
const GRAVITY: f64 = 9.806_65;
const TROPOPAUSE_M: f64 = 11_000.0;
/// Of the earth, as the tables have it.
const RADIUS_M: f64 = 6_356_766.0;
const LAPSE: f64 = 0.006_5;

/// Air at a geometric height, ft.
#[must_use]
pub fn air(altitude_ft: f64) -> Air {
    let geometric = altitude_ft * M_PER_FT;
    // The tables' variable is the geopotential height.
    let h = geometric * RADIUS_M / (RADIUS_M + geometric);
    let temperature = 288.15 - LAPSE * h.min(TROPOPAUSE_M);
    let troposphere = 101_325.0 * (temperature / 288.15).powf(GRAVITY / (LAPSE * GAS));
    let above = (h - TROPOPAUSE_M).max(0.0);
    let pressure = troposphere * (-GRAVITY * above / (GAS * temperature)).exp();
    Air {
        density_slug_ft3: pressure / (GAS * temperature) / DENSITY,
        sound_ft_s: (1.4 * GAS * temperature).sqrt() / M_PER_FT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn density_and_sound_are_those_of_the_published_tables() {
        for (altitude_ft, density, sound) in [
            (0.0, 2.3769e-3, 1116.45),
            (25_000.0, 1.0663e-3, 1016.1),
            (45_000.0, 4.6227e-4, 968.08),
        ] {
            assert_relative_eq!(
                air(altitude_ft).density_slug_ft3,
                density,
                max_relative = 3e-4
            );
            assert_relative_eq!(air(altitude_ft).sound_ft_s, sound, max_relative = 2e-4);
        }
    }
}
