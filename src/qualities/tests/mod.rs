//! Tests of the flying qualities.

mod boeing_747;
mod fixture;
mod judged_quantity;
mod levels;
mod linear;
mod probabilities;
mod trim;
