//! Estimation of a maneuver's derivatives, by filter error or output error on its axis's equations.
//!
//! [`maneuver`] estimates one maneuver. [`joint`] estimates several that share their derivatives,
//! and [`prediction`] predicts one from the others.

mod settings;
mod context;
mod estimated;
mod task;
mod tunnel_change;
mod absent_outputs;
mod prepared_case;
mod fitting;
mod resting_surfaces;
mod maneuver_class;
mod rows;
mod calibration_effect;
mod diagnostics;
mod held_by_evidence;
mod second_opinion;
mod alpha_slopes;
mod whiteness;
mod filter_minimum;
mod held_slopes;
mod maneuver_filter;
mod group_member;
mod filter_group;
mod sensor_noise;
mod gust_size;
mod air_motion;
mod credibility;
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
