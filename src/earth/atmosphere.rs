//! Standard atmosphere (U.S. Standard Atmosphere, 1976) to 65,000 ft: ρ = p/(R T) with a temperature
//! that falls linearly to the tropopause and is constant above.

use crate::units::M_PER_FT;

/// Density and speed of sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    pub density_slug_ft3: f64,
    pub sound_ft_s: f64,
}

/// kg/m³ in a slug/ft³.
const KG_M3_PER_SLUG_FT3: f64 = 515.378_818_393_2;
/// Gas constant of air, J/(kg K).
const GAS: f64 = 287.052_87;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;
/// Geopotential height of the tropopause.
const TROPOPAUSE_M: f64 = 11_000.0;
/// Radius of the earth in the definition of the geopotential height.
const RADIUS_M: f64 = 6_356_766.0;
/// Lapse rate of the troposphere, K/m.
const LAPSE: f64 = 0.006_5;
/// Temperature at sea level, K.
const SEA_LEVEL_K: f64 = 288.15;
/// Pressure at sea level, Pa.
const SEA_LEVEL_PA: f64 = 101_325.0;
/// Ratio of specific heats of air.
const HEAT_RATIO: f64 = 1.4;

/// Air at a geometric height, ft.
#[must_use]
pub fn air(altitude_ft: f64) -> Air {
    let geometric = altitude_ft * M_PER_FT;
    // The layers are defined over geopotential height.
    let h = geometric * RADIUS_M / (RADIUS_M + geometric);
    let temperature = SEA_LEVEL_K - LAPSE * h.min(TROPOPAUSE_M);
    let troposphere = SEA_LEVEL_PA * (temperature / SEA_LEVEL_K).powf(GRAVITY / (LAPSE * GAS));
    let above = (h - TROPOPAUSE_M).max(0.0);
    let pressure = troposphere * (-GRAVITY * above / (GAS * temperature)).exp();
    Air {
        density_slug_ft3: pressure / (GAS * temperature) / KG_M3_PER_SLUG_FT3,
        sound_ft_s: (HEAT_RATIO * GAS * temperature).sqrt() / M_PER_FT,
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
