//! Tests of the flight plan.

mod choice;
mod decision;
mod experience;
mod limits;
mod world;
mod promise;
mod minutes;
mod flown_qualities;
