//! U.S. Standard Atmosphere, 1976, to a geopotential height of 32 km (105,000 ft). Its layers have
//! a temperature linear in the height, and the density is ρ = p/(R T).

use crate::units::M_PER_FT;

/// Density, speed of sound, pressure and temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    pub density_slug_ft3: f64,
    pub sound_ft_s: f64,
    pub pressure_psf: f64,
    pub kelvin: f64,
}

impl Air {
    /// Air of the same pressure with a measured temperature: ρ = p/(R T), speed of sound √(γ R T).
    /// An altimeter reads the pressure, so at a pressure altitude the pressure is that of the standard
    /// atmosphere on any day. Without a finite temperature the air stays as it is.
    #[must_use]
    pub fn at_temperature(self, kelvin: f64) -> Air {
        let ratio = kelvin / self.kelvin;
        if !ratio.is_finite() {
            return self;
        }
        Air {
            density_slug_ft3: self.density_slug_ft3 / ratio,
            sound_ft_s: self.sound_ft_s * ratio.sqrt(),
            kelvin,
            ..self
        }
    }
}

/// kg/m³ in a slug/ft³.
const KG_M3_PER_SLUG_FT3: f64 = 515.378_818_393_2;
/// Pascals in a pound-force per square foot: newtons in a pound-force (`LBF` of `units/unit.rs`)
/// over [`M_PER_FT`]². The value is rounded to fourteen digits; the quotient itself would change
/// published bits.
const PA_PER_PSF: f64 = 47.880_258_980_336;
/// Gas constant of air, J/(kg K).
const GAS: f64 = 287.052_87;
/// Standard gravity, m/s²: the unit g of [`crate::units::G0_FT_S2`], 9.80665/0.3048 = 32.174049 ft/s², to its
/// last stated digit.
const GRAVITY: f64 = 9.806_65;
/// Radius of the earth in the definition of the geopotential height.
const RADIUS_M: f64 = 6_356_766.0;
/// Ratio of specific heats of air.
const HEAT_RATIO: f64 = 1.4;
/// Temperature at sea level, K.
const SEA_LEVEL_K: f64 = 288.15;
/// Pressure at sea level, Pa.
const SEA_LEVEL_PA: f64 = 101_325.0;

/// A layer up to a geopotential height.
struct Layer {
    top_m: f64,
    /// Rise of the temperature with the height, K/m.
    gradient: f64,
}

/// Troposphere and lower stratosphere, from sea level up.
const LAYERS: [Layer; 3] = [
    Layer {
        top_m: 11_000.0,
        gradient: -0.006_5,
    },
    Layer {
        top_m: 20_000.0,
        gradient: 0.0,
    },
    Layer {
        top_m: 32_000.0,
        gradient: 0.001,
    },
];

/// Air at a geometric height, ft; NaN above the layers and where the height is NaN.
#[must_use]
pub fn air(altitude_ft: f64) -> Air {
    let geometric = altitude_ft * M_PER_FT;
    // The layers are defined over geopotential height.
    let State {
        temperature,
        pressure,
        ..
    } = state_at(geometric * RADIUS_M / (RADIUS_M + geometric));
    Air {
        density_slug_ft3: pressure / (GAS * temperature) / KG_M3_PER_SLUG_FT3,
        sound_ft_s: (HEAT_RATIO * GAS * temperature).sqrt() / M_PER_FT,
        pressure_psf: pressure / PA_PER_PSF,
        kelvin: temperature,
    }
}

/// Slopes of density and speed of sound over the geometric height, each over the quantity itself, 1/ft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirGradients {
    pub density: f64,
    pub sound: f64,
}

/// Gradients of the air at a geometric height, ft. By the hydrostatic equation p' = −ρ g, and of the ideal
/// gas ρ'/ρ = p'/p − T'/T.
#[must_use]
pub fn air_gradients(altitude_ft: f64) -> AirGradients {
    let geometric = altitude_ft * M_PER_FT;
    let share = RADIUS_M / (RADIUS_M + geometric);
    let State {
        temperature,
        gradient,
        ..
    } = state_at(geometric * share);
    // Geopotential height rises by share² of the geometric one.
    let per_ft = share * share * M_PER_FT / temperature;
    AirGradients {
        density: -(GRAVITY / GAS + gradient) * per_ft,
        sound: 0.5 * gradient * per_ft,
    }
}

/// Temperature, K, with its rise, K/m, and pressure, Pa, at a geopotential height.
struct State {
    temperature: f64,
    gradient: f64,
    pressure: f64,
}

fn state_at(height_m: f64) -> State {
    let (mut base_m, mut temperature, mut pressure) = (0.0, SEA_LEVEL_K, SEA_LEVEL_PA);
    for layer in LAYERS {
        let rise_m = height_m.min(layer.top_m) - base_m;
        (temperature, pressure) = layer.climb(temperature, pressure, rise_m);
        if height_m <= layer.top_m {
            return State {
                temperature,
                gradient: layer.gradient,
                pressure,
            };
        }
        base_m = layer.top_m;
    }
    State {
        temperature: f64::NAN,
        gradient: f64::NAN,
        pressure: f64::NAN,
    }
}

impl Layer {
    /// Temperature and pressure `rise_m` higher in the layer: dp/dh = −ρ g.
    fn climb(&self, temperature: f64, pressure: f64, rise_m: f64) -> (f64, f64) {
        if self.gradient == 0.0 {
            let decay = (-GRAVITY * rise_m / (GAS * temperature)).exp();
            return (temperature, pressure * decay);
        }
        let above = temperature + self.gradient * rise_m;
        let exponent = -GRAVITY / (self.gradient * GAS);
        (above, pressure * (above / temperature).powf(exponent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn density_and_sound_are_those_of_the_published_tables() {
        // U.S. Standard Atmosphere, 1976, Table I, over geometric height: kg/m³ and m/s.
        for (altitude_m, density, sound) in [
            (-1000.0, 1.347_0, 344.11),
            (0.0, 1.225_0, 340.29),
            (5000.0, 7.364_3e-1, 320.55),
            (10_000.0, 4.135_1e-1, 299.53),
            (15_000.0, 1.947_6e-1, 295.07),
            (20_000.0, 8.891_0e-2, 295.07),
            (25_000.0, 4.008_4e-2, 298.39),
            (30_000.0, 1.841_0e-2, 301.71),
        ] {
            let air = air(altitude_m / M_PER_FT);
            assert_relative_eq!(
                air.density_slug_ft3 * KG_M3_PER_SLUG_FT3,
                density,
                max_relative = 6e-5
            );
            assert_relative_eq!(air.sound_ft_s * M_PER_FT, sound, max_relative = 3e-5);
        }
    }

    #[test]
    fn pressure_and_temperature_at_sea_level_are_the_defined_ones() {
        let air = air(0.0);
        // 101,325 Pa are 2116.22 lbf/ft2.
        assert_relative_eq!(air.pressure_psf, 2116.22, max_relative = 3e-6);
        assert_relative_eq!(air.kelvin, 288.15);
    }

    #[test]
    fn pressures_at_the_layers_limits_are_the_defined_ones() {
        // Table 4 of the standard, mbar over geopotential height.
        for (height_m, pressure_mbar) in [
            (11_000.0, 226.320_6),
            (20_000.0, 54.748_89),
            (32_000.0, 8.680_187),
        ] {
            let pressure = state_at(height_m).pressure;
            assert_relative_eq!(pressure / 100.0, pressure_mbar, max_relative = 5e-6);
        }
    }

    #[test]
    fn gradients_are_those_of_differences() {
        const STEP_FT: f64 = 1.0;
        for altitude_ft in [0.0, 25_000.0, 50_000.0, 80_000.0] {
            let (above, below) = (air(altitude_ft + STEP_FT), air(altitude_ft - STEP_FT));
            let relative = |above: f64, below: f64| (above / below).ln() / (2.0 * STEP_FT);
            let own = air_gradients(altitude_ft);
            let density = relative(above.density_slug_ft3, below.density_slug_ft3);
            let sound = relative(above.sound_ft_s, below.sound_ft_s);
            assert_relative_eq!(own.density, density, max_relative = 1e-7);
            assert_relative_eq!(own.sound, sound, max_relative = 1e-7, epsilon = 1e-15);
        }
    }

    #[test]
    fn there_is_no_air_above_the_layers_nor_at_no_height() {
        let top_ft = 32_000.0 * RADIUS_M / (RADIUS_M - 32_000.0) / M_PER_FT;
        assert!(air(top_ft - 1.0).density_slug_ft3 > 0.0);
        for altitude_ft in [top_ft + 1.0, f64::INFINITY, f64::NAN] {
            let air = air(altitude_ft);
            assert!(air.density_slug_ft3.is_nan() && air.sound_ft_s.is_nan());
        }
    }
}
