//! Inspection of a recording that nobody has described: which column is which signal, in which unit and
//! of which sign, and a draft of the pipeline for it.
//!
//! Names and stated units propose, the equations of motion decide: attitudes must follow from rates,
//! speeds from accelerations and gravity, climb from the flight path, dynamic pressure and Mach number
//! from speed and altitude. Angular accelerations tell the signs of surfaces and controls. What nothing
//! tells is said to be unsure.
//!
//! In the order of use: `recording` (the input), `words` and `vocabulary` (names), `quantity`, `clock`,
//! `grid` (one step for all columns), `plausible` (candidates), `equations`, `assignment` (the search, over
//! `signs`), `certainty`, `effects` and `inputs` (surfaces and controls), `findings`, and `draft` (YAML).

mod assignment;
mod certainty;
mod clock;
pub mod draft;
mod effects;
mod equations;
mod findings;
mod grid;
mod inputs;
mod plausible;
mod quantity;
mod recording;
mod signs;
mod vocabulary;
mod words;

pub use findings::{Channel, Inspection, Role, Unused, inspect};
pub use recording::{Column, Recording};
