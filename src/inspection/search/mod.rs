//! Search for the assignment of columns, units and signs with which the equations of motion hold.

pub mod assignment;
pub mod certainty;
pub mod descent;
pub mod equations;
pub mod plausible;
pub mod rescaling;
pub mod rotation;
pub mod signs;
