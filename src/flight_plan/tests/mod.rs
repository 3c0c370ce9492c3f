//! Tests of the flight plan.

mod choice;
mod experience;
mod limits;
mod promise;
