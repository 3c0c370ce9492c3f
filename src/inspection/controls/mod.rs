//! Surfaces and pilot controls of a recording: effects, signs, and which of them step.

pub mod effects;
pub mod inputs;
pub mod steps;
