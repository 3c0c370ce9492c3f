//! harvest turns archives of flight-test records into aerodynamic derivatives.
//!
//! # A sample's way from file to report
//!
//! 1. **File.** [`store::archive::find`] lists an archive as [`store::archive::FlightFiles`]. The
//!    channel map of the [`config::Config`] gives each column as a [`flight::Channel`]: signal,
//!    unit and sign.
//! 2. **Sample.** [`ingest::survey`] reads the time channels and gives every row a sample of a
//!    [`ingest::Clock`]. An [`ingest::ChannelReader`] converts a column to its signal, repairs it,
//!    and flags each sample with a [`flight::Mark`].
//! 3. **Record.** A [`flight::Record`] holds the signals of a flight on one clock.
//!    [`ingest::compatibility`] estimates the errors of its instruments; a [`flight::Correction`]
//!    removes them, and states what remains as [`flight::RemainingErrors`].
//! 4. **Maneuver.** [`segment::maneuvers`] finds each [`maneuver::Maneuver`] in the record and its
//!    [`maneuver::Class`]. The equations of motion give the delays of the surfaces, from all
//!    maneuvers together.
//! 5. **Case.** A [`dynamics::motion::ManeuverSignals`] is the maneuver's part of the record. An
//!    [`output_error::Case`] adds the [`aero::AeroModel`]: regressors, free and held derivatives,
//!    measured outputs.
//! 6. **Estimate.** [`output_error::newton_raphson`] minimises the cost of the case to a
//!    [`output_error::Fit`], and [`output_error::cramer_rao`] bounds it. In moving air
//!    [`filter_error`] replaces output error: a [`filter_error::filter::Filter`] gives the cost of
//!    one maneuver, a [`filter_error::joint_filter::JointFilter`] that of several,
//!    [`filter_error::scoring`] minimises it, and [`filter_error::bounds`] bounds the estimates.
//!    [`estimate::maneuver`] returns the rows [`tables::FitRow`] and [`tables::EstimateRow`].
//! 7. **Model and trend.** [`model::model`] fuses the [`aero::WindTunnel`] and the estimates to the
//!    posterior ([`tables::PosteriorRow`]); [`trend::trends`] fits the estimates of a derivative
//!    across angle of attack ([`tables::TrendRow`]). [`compare::compare_posterior`] sets the
//!    posterior against the tunnel ([`tables::ComparisonRow`]).
//! 8. **Report.** [`report::html`] makes the page of all results, [`pdf::pdf`] its PDF, and
//!    [`night::run`] publishes both with the tables.
//!
//! # Parts of time
//!
//! | word | part |
//! |---|---|
//! | stretch | of a flight, on one clock |
//! | piece | consecutive rows of one file |
//! | run | rows that are consecutive samples |
//! | spell | 16,384 samples for which a channel's character is estimated |
//! | window | over which relations are checked or the motion is reconstructed |
//! | block | short interval whose samples are averaged |
//! | sequence | steps in close succession |
//! | segment | of a sequence, between two cuts |
//! | maneuver | a segment with lead-in (trimmed flight before it) and decay (response after it) |
//! | chunk | points of a maneuver that the kernel computes at a time |
//!
//! # Order
//!
//! [`pipeline`] runs the stages over flights and maneuvers; [`cli`] is the command line.
//!
//! The modules stand in order; a module uses only modules listed above it
//! (`tests/stages/house.rs`). The modules that tests and benchmarks use are public; in the others
//! the compiler finds dead code. `make doc` documents all of them.

// Vocabulary: flights, aircraft, derivatives, tables.
pub mod schema;
mod units;
mod numerics;
pub mod error;
mod settings;
mod earth;
pub mod flight;
mod aircraft;
pub mod aero;
pub mod maneuver;
pub mod tables;
pub mod lineage;

// Physics: how the aircraft moves and what its sensors read.
pub mod dynamics;
mod rigid_body;

// Method: how derivatives follow from motion.
pub mod output_error;
pub mod filter_error;

// A recording that nobody has described yet: which column is which signal.
pub mod inspection;

// Stages: functions of values, each from its predecessor's output.
pub mod ingest;
pub mod segment;
mod recorder;
mod surfaces;
pub mod estimate;
mod model;
mod trend;
mod qualities;
mod proof_of_match;
mod compare;
mod export;
mod drawing_cache;
mod pdf;
mod report;

// Outside: disk and configuration.
pub mod store;
pub mod config;

// Conductor: the stages in order; their results as published nights; campaigns on a cluster.
pub mod memory;
pub mod pipeline;
pub mod night;
mod cluster;

// Laboratory: simulator, study of the bounds, timing. The nightly job needs none of it.
pub mod lab;

// Planning: what to fly next, rehearsed in the laboratory's simulator.
mod flight_plan;

// Command line.
pub mod cli;
