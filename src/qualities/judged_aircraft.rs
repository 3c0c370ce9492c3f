//! Aircraft and posterior whose flying qualities are judged.

use super::specification::Specification;
use crate::aero::{AeroModel, WindTunnel};
use crate::aircraft::Aircraft;
use crate::model::Model;

/// Aircraft and posterior whose flying qualities are judged, with the specification.
#[derive(Clone, Copy, Debug)]
pub struct JudgedAircraft<'a> {
    pub model: &'a Model,
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
    pub tunnel: &'a WindTunnel,
    pub specification: &'a Specification,
}
