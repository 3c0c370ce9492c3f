//! Inspection of a recording without a description: the signal, unit and sign of each column, and a
//! draft of the pipeline.
//!
//! Names and stated units propose an assignment; the equations of motion confirm it. Attitudes must
//! follow from rates, speeds from accelerations and gravity, and climb from the flight path.
//! Dynamic pressure and Mach number must follow from speed and altitude. Angular accelerations
//! determine the signs of surfaces and controls. A finding that no equation confirms is marked as
//! unsure.
//!
//! In the order of use:
//!
//! - `recording` (the input), `words` and `vocabulary` (names), `mirror_images`, `quantity`, `clock`,
//!   `grid` (one step for all columns), `plausible` (candidates);
//! - `equations`, `signs`, `assignment` (and its cost), `rotation` and `descent` (the search),
//!   `rescaling`, `certainty`;
//! - `effects` and `inputs` (surfaces and controls), `steps` (which of them step);
//! - `findings` (the result), `channels` (by name and unit), `inspect` (all of it), `draft` (YAML).

mod assignment;
mod certainty;
mod channels;
mod clock;
mod descent;
pub mod draft;
mod effects;
mod equations;
mod findings;
mod grid;
mod inputs;
mod inspect;
mod mirror_images;
mod plausible;
mod quantity;
mod recording;
mod rescaling;
mod rotation;
mod signs;
mod steps;
#[cfg(test)]
mod test_flight;
mod vocabulary;
mod words;

pub use findings::{Channel, Inspection, Role, Unused};
pub use inspect::inspect;
pub use recording::{Column, Recording};
