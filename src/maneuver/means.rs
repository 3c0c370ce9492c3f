//! Means of a maneuver that its flight condition lacks: attitude, height of the c.g., inertias, positions of
//! the surfaces.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Means over the samples of a maneuver, in the units of the names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Means {
    pub theta_deg: f64,
    /// Above the reference point.
    pub z_cg_ft: f64,
    pub ix_slug_ft2: f64,
    pub iy_slug_ft2: f64,
    pub iz_slug_ft2: f64,
    pub ixz_slug_ft2: f64,
    /// Mean deflection of each surface and vane of the model, by signal, deg.
    pub surfaces_deg: BTreeMap<String, f64>,
}
