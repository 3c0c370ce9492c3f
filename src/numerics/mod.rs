//! Numerical methods that several stages share.

pub mod trig;
