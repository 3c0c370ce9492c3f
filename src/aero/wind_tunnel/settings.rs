//! Settings of the wind-tunnel database: how its tables are read.

use serde::{Deserialize, Serialize};

use crate::aero::interpolation::Interpolation;
use crate::settings::{settings, single_values};

settings! {
    /// Reading of the wind-tunnel tables.
    pub struct Settings {
        /// Interpolation between the tabulated points: `linear`, or `monotone_cubic` (Fritsch and
        /// Carlson), which is smooth and does not overshoot. It changes every value read between
        /// points.
        pub interpolation: Interpolation = Interpolation::default(),
        /// Reading beyond the ends of a table: `clamp` takes the value at the end, `refuse` gives no
        /// value. With `refuse` maneuvers that hold a derivative there are rejected.
        pub extrapolation: Extrapolation = Extrapolation::default(),
        /// Variable of the tables besides alpha and Mach number, where they have one.
        pub third: Option<Third> = None,
    }
}

/// Reading of a table beyond its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extrapolation {
    /// The value at the end.
    #[default]
    Clamp,
    /// No value.
    Refuse,
}

single_values!(Interpolation, Extrapolation);

settings! {
    /// Third variable of the tables.
    pub struct Third {
        /// Its column in CSV and Parquet, its variable in DAVE-ML. A mean flight condition of the
        /// maneuvers (`altitude_ft`, `qbar_psf`, `velocity_ft_s`, `mass_slug`, `x_cg_ft`) is read at
        /// each maneuver's own value.
        pub name: String,
        /// Value at which the tables are read where the maneuver has none, in the variable's unit.
        pub at: f64,
    }
}
