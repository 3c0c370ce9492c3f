//! Recognition: the maneuvers of a record, their classes, and excitation that fits none.
//!
//! [`detections`] gathers the steps of a record; [`sequences`] (with [`pilot_sequences`]) groups
//! them; [`cuts`] cuts a sequence into maneuvers by [`penalties`]; [`recognise`] classifies each of
//! them. A [`segment`] is matched with a class in [`class_match`] (with [`patterns`]), and
//! [`class_evidence`] weighs the other signals. [`sweeps`] are found by their swings. [`overlaps`] keeps
//! one of several candidates at a time. The remaining excitation is [`unclassified`]. [`windows`] adds
//! lead-in and decay.

mod class_evidence;
mod class_match;
mod cuts;
pub(super) mod detections;
pub(super) mod found;
mod mismatch;
pub(super) mod overlaps;
mod patterns;
mod penalties;
mod pilot_sequences;
pub(super) mod recognise;
mod segment;
mod sequences;
pub(super) mod stand_ins;
mod sweeps;
pub(super) mod unclassified;
pub(super) mod windows;
