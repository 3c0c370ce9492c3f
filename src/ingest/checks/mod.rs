//! Units and signs of the channels checked against each other by kinematic relations.

mod agreement;
mod block_means;
mod block_motion;
mod disturbance;
mod engine;
mod fault_isolation;
mod gusts;
mod line_fit;
mod mass_properties;
mod relations;
mod thermometer;
mod time_scale;
mod window_selection;
mod windows;

pub(in crate::ingest) use agreement::{Check, check_relations, confirmed_signals};
pub(in crate::ingest) use block_means::{BlockAverager, BlockMeans};
pub(in crate::ingest) use engine::{ENGINE_SIGNALS, unusable_engine_signal};
pub(in crate::ingest) use fault_isolation::{
    FaultReport, FaultyChannel, find_faulty_channels, report,
};
pub(in crate::ingest) use gusts::Gusts;
pub use mass_properties::LiftPoint;
pub(in crate::ingest) use mass_properties::{
    ImpossibleSignal, impossible_centre, impossible_gyration, impossible_mass, impossible_signals,
    impossible_velocity, lift_curve,
};
pub(in crate::ingest) use thermometer::{impossible_temperature, unusable_temperature};
pub(in crate::ingest) use time_scale::find_time_scale_fault;
