//! Tests of the flying qualities.

mod a_7a;
mod boeing_747;
mod fixture;
mod judged_quantity;
mod levels;
mod linear;
mod nt_33a;
mod probabilities;
mod reported;
mod trim;
