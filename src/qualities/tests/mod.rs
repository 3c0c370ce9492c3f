//! Tests of the flying qualities.

mod boeing_747;
mod fixture;
mod levels;
mod linear;
mod probabilities;
mod trim;
