//! Loadings: mass, c.g. and inertias at several fuel states, interpolated linearly in mass.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::aircraft::Position;

/// Mass properties at one fuel state. Inertias about the c.g. in body axes; `ixz` = +∫xz dm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Loading {
    pub mass_slug: f64,
    pub x_cg_ft: f64,
    #[serde(default)]
    pub y_cg_ft: f64,
    pub z_cg_ft: f64,
    pub ix_slug_ft2: f64,
    pub iy_slug_ft2: f64,
    pub iz_slug_ft2: f64,
    pub ixz_slug_ft2: f64,
}

/// Mass and inertias about the c.g. as the equations of motion use them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    pub mass_slug: f64,
    pub inertia: Matrix3<f64>,
    pub inverse_inertia: Matrix3<f64>,
}

impl Loading {
    /// Interpolates the loadings at a mass; extrapolates along the line through the two nearest.
    /// All zero for an empty list, which [`super::Settings`] refuses.
    #[must_use]
    pub fn at_mass(loadings: &[Loading], mass_slug: f64) -> Loading {
        let upper = loadings
            .partition_point(|l| l.mass_slug < mass_slug)
            .clamp(1, loadings.len().max(2) - 1);
        let (Some(a), Some(b)) = (loadings.get(upper - 1), loadings.get(upper)) else {
            return Loading {
                mass_slug,
                ..loadings.first().copied().unwrap_or_default()
            };
        };
        let f = (mass_slug - a.mass_slug) / (b.mass_slug - a.mass_slug);
        let mix = |x: f64, y: f64| x + f * (y - x);
        Loading {
            mass_slug,
            x_cg_ft: mix(a.x_cg_ft, b.x_cg_ft),
            y_cg_ft: mix(a.y_cg_ft, b.y_cg_ft),
            z_cg_ft: mix(a.z_cg_ft, b.z_cg_ft),
            ix_slug_ft2: mix(a.ix_slug_ft2, b.ix_slug_ft2),
            iy_slug_ft2: mix(a.iy_slug_ft2, b.iy_slug_ft2),
            iz_slug_ft2: mix(a.iz_slug_ft2, b.iz_slug_ft2),
            ixz_slug_ft2: mix(a.ixz_slug_ft2, b.ixz_slug_ft2),
        }
    }

    #[must_use]
    pub fn cg(&self) -> Position {
        Position {
            x_ft: self.x_cg_ft,
            y_ft: self.y_cg_ft,
            z_ft: self.z_cg_ft,
        }
    }

    /// Inertia matrix of an airframe that is symmetric about its xz plane.
    #[must_use]
    pub fn inertia(&self) -> Matrix3<f64> {
        let product = -self.ixz_slug_ft2;
        Matrix3::new(
            self.ix_slug_ft2,
            0.0,
            product,
            0.0,
            self.iy_slug_ft2,
            0.0,
            product,
            0.0,
            self.iz_slug_ft2,
        )
    }

    #[must_use]
    pub fn mass(&self) -> Mass {
        let inertia = self.inertia();
        Mass {
            mass_slug: self.mass_slug,
            inertia,
            // `Settings` refuses singular matrices; zeros avoid a panic.
            inverse_inertia: inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const LIGHT: Loading = Loading {
        mass_slug: 980.0,
        x_cg_ft: 38.4,
        y_cg_ft: 0.0,
        z_cg_ft: 8.6,
        ix_slug_ft2: 22_163.0,
        iy_slug_ft2: 172_237.0,
        iz_slug_ft2: 186_823.0,
        ixz_slug_ft2: -2043.0,
    };

    #[test]
    fn mass_properties_are_linear_in_mass() {
        let heavy = Loading {
            mass_slug: 1080.0,
            iy_slug_ft2: 182_237.0,
            x_cg_ft: 38.0,
            ..LIGHT
        };
        let between = Loading::at_mass(&[LIGHT, heavy], 1005.0);
        assert_relative_eq!(between.iy_slug_ft2, 174_737.0);
        assert_relative_eq!(between.x_cg_ft, 38.3);
        assert_relative_eq!(
            Loading::at_mass(&[LIGHT, heavy], 960.0).iy_slug_ft2,
            170_237.0
        );
        assert_relative_eq!(Loading::at_mass(&[LIGHT], 1005.0).mass_slug, 1005.0);
    }
}
