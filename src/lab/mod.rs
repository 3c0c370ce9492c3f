//! Laboratory: the flight simulator and the campaigns it flies, the study of the bounds, and the
//! timing of the standard case. The nightly job uses nothing of it.

pub(crate) mod simulator;
pub(crate) mod campaign;
pub(crate) mod bounds_study;
pub mod standard_case;
