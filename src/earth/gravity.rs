//! Gravity at the aircraft: normal gravity on the WGS 84 ellipsoid (Somigliana) with the free-air
//! term.

use crate::units::{DEG, M_PER_FT};

/// Gravity in ft/s² at a geodetic latitude and a height above the ellipsoid; it contains the
/// centrifugal part, so it is what a body at rest on the rotating earth feels.
///
/// At 25,000 ft it is 0.3% under the accelerometers' unit of 32.174 ft/s²: over a maneuver that is
/// 0.2 to 0.4° of θ.
#[must_use]
pub fn gravity_ft_s2(latitude_deg: f64, altitude_ft: f64) -> f64 {
    gravity_at(latitude_deg)(altitude_ft)
}

/// Gravity at a latitude as a function of the height.
pub fn gravity_at(latitude_deg: f64) -> impl Fn(f64) -> f64 {
    let sin2 = (latitude_deg / DEG).sin().powi(2);
    let surface = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * sin2)
        / (1.0 - 0.006_694_379_990_14 * sin2).sqrt();
    let (semi_major, flattening, m) = (6_378_137.0, 1.0 / 298.257_223_563, 0.003_449_786_506_84);
    move |altitude_ft| {
        let h = altitude_ft * M_PER_FT;
        let free_air = 1.0
            - 2.0 / semi_major * (1.0 + flattening + m - 2.0 * flattening * sin2) * h
            + 3.0 * (h / semi_major).powi(2);
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
