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
//! - `recording` (the input), `mach_airspeed` (what stands for an airspeed), `names`, `quantity`, `clock`, `grid` (one step for all columns);
//! - `search`: candidates (`plausible`), `equations`, `signs`, `assignment` (and its cost), `rotation`
//!   and `descent`, `rescaling`, `certainty`;
//! - `controls`: `effects` and `inputs` (surfaces and controls), `steps` (which of them step);
//! - `findings` (the result), `channels` (by name and unit), `inspect` (all of it), `draft` (YAML).

mod names;
mod search;
mod controls;
mod channels;
mod clock;
pub mod draft;
mod findings;
mod grid;
mod inspect;
mod mach_airspeed;
mod quantity;
mod recording;
#[cfg(test)]
mod test_flight;

pub use findings::{Channel, Inspection, Role, Unused};
pub use inspect::inspect;
pub use recording::{Column, Recording};
