//! Aircraft and posterior whose flying qualities are judged.

use super::specification::Specification;
use crate::aero::{Buildup, WindTunnel};
use crate::aircraft::Aircraft;
use crate::model::Model;

/// Aircraft and posterior whose flying qualities are judged, with the specification.
#[derive(Clone, Copy, Debug)]
pub struct JudgedAircraft<'a> {
    pub model: &'a Model,
    pub aircraft: &'a Aircraft,
    pub buildup: &'a Buildup,
    pub tunnel: &'a WindTunnel,
    pub specification: &'a Specification,
}
