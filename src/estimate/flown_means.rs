//! Means of a maneuver's record: attitude, height of the c.g., inertias, positions of the surfaces.

use crate::aero::AeroModel;
use crate::flight::{Record, signal};
use crate::maneuver::{Maneuver, Means};
use crate::numerics::statistics::mean::finite_mean;

/// Means over a maneuver's finite samples; `None` if a signal of the equations has none.
#[must_use]
pub fn means(record: &Record, maneuver: &Maneuver, aero_model: &AeroModel) -> Option<Means> {
    let first = record.sample_at(maneuver.start_s);
    let last = record.sample_at(maneuver.end_s);
    let mean = |name: &str| finite_mean(record.values(name)?.get(first..=last)?.iter().copied());
    let surfaces = aero_model.derivatives.iter();
    let surfaces = surfaces.flat_map(|d| d.regressor.signals());
    Some(Means {
        theta_deg: mean(signal::THETA)?,
        z_cg_ft: mean(signal::Z_CG)?,
        ix_slug_ft2: mean(signal::IX)?,
        iy_slug_ft2: mean(signal::IY)?,
        iz_slug_ft2: mean(signal::IZ)?,
        ixz_slug_ft2: mean(signal::IXZ)?,
        surfaces_deg: surfaces
            .filter_map(|name| Some((name.to_owned(), mean(name)?)))
            .collect(),
    })
}
