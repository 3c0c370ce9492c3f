//! Estimation of a maneuver's derivatives, by filter error or output error on its axis's equations.
//!
//! [`maneuver`] estimates one maneuver. [`joint`] estimates several that share their derivatives,
//! and [`prediction`] predicts one from the others.

mod holding;
mod slopes;
mod moving_air;
mod assessment;
mod settings;
mod context;
mod estimated;
mod task;
mod prepared_case;
mod fitting;
mod rows;
mod calibration_effect;
mod flown_means;
mod single;
pub mod joint;
pub mod prediction;
#[cfg(test)]
mod tests;

pub use context::Context;
pub use estimated::{Covariance, Estimated};
pub use flown_means::means;
pub use settings::{
    Doubtful, HeldValues, Hold, InactiveSurfaces, JointSettings, Method, PredictionSettings,
    Settings, Start,
};
pub use single::maneuver;
