//! Tests of the flight plan.

mod choice;
mod decision;
mod experience;
mod limits;
mod promise;
