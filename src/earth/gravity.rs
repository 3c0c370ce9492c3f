//! Gravity at the aircraft: normal gravity on the WGS 84 ellipsoid (Somigliana) with the free-air
//! term. Constants of NIMA TR 8350.2.

use crate::units::{DEG, M_PER_FT};

/// Normal gravity at the equator.
const EQUATOR_M_S2: f64 = 9.780_325_335_9;

/// Constant k of Somigliana's formula.
const SOMIGLIANA: f64 = 0.001_931_852_652_41;

/// Square of the first eccentricity of the ellipsoid.
const ECCENTRICITY2: f64 = 0.006_694_379_990_14;

/// Semi-major axis of the ellipsoid.
const SEMI_MAJOR_M: f64 = 6_378_137.0;

/// Flattening of the ellipsoid.
const FLATTENING: f64 = 1.0 / 298.257_223_563;

/// Ratio m = ω²a²b/GM of centrifugal and gravitational acceleration.
const ROTATION: f64 = 0.003_449_786_506_84;

/// Gravity in ft/s² at a geodetic latitude and a height above the ellipsoid. It contains the
/// centrifugal part: an accelerometer at rest on the rotating earth measures it.
///
/// At 25,000 ft it is 0.3% under the accelerometers' unit of 32.174 ft/s²: over a maneuver that is
/// 0.2 to 0.4° of θ.
#[must_use]
pub fn gravity_ft_s2(latitude_deg: f64, altitude_ft: f64) -> f64 {
    gravity_at(latitude_deg)(altitude_ft)
}

/// Gravity in ft/s² at a latitude as a function of the height, ft.
pub fn gravity_at(latitude_deg: f64) -> impl Fn(f64) -> f64 {
    let sin2 = (latitude_deg / DEG).sin().powi(2);
    let surface = EQUATOR_M_S2 * (1.0 + SOMIGLIANA * sin2) / (1.0 - ECCENTRICITY2 * sin2).sqrt();
    move |altitude_ft| {
        let h = altitude_ft * M_PER_FT;
        let free_air = 1.0
            - 2.0 / SEMI_MAJOR_M * (1.0 + FLATTENING + ROTATION - 2.0 * FLATTENING * sin2) * h
            + 3.0 * (h / SEMI_MAJOR_M).powi(2);
        surface * free_air / M_PER_FT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn gravity_is_the_ellipsoid_s_at_equator_and_pole() {
        assert_abs_diff_eq!(
            gravity_ft_s2(0.0, 0.0) * M_PER_FT,
            9.780_325_335_9,
            epsilon = 1e-9
        );
        assert_abs_diff_eq!(
            gravity_ft_s2(90.0, 0.0) * M_PER_FT,
            9.832_184_937_9,
            epsilon = 1e-7
        );
    }

    #[test]
    fn gravity_falls_with_the_square_of_the_distance() {
        let radius_ft = 6_371_000.0 / M_PER_FT;
        let ratio = gravity_ft_s2(45.0, 25_000.0) / gravity_ft_s2(45.0, 0.0);
        assert_abs_diff_eq!(
            ratio,
            (radius_ft / (radius_ft + 25_000.0)).powi(2),
            epsilon = 2e-5
        );
    }
}
