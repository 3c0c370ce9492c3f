//! Identifiability: collinearity of the parameters ([`collinearity`]), and the parameters that are
//! better held than estimated ([`holding`]).

pub mod collinearity;
pub mod holding;

pub use collinearity::{
    CollinearGroup, Collinearity, CollinearityLimits, collinearity, correlation, excitation,
};
