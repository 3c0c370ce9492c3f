//! Export of the flight-updated derivatives for simulators: rows (CSV, Parquet), DAVE-ML, and a JSBSim
//! aerodynamics section. Each value names its source.
//!
//! The values are the posterior's, with its breakpoints. Derivatives that the posterior does not
//! have are the tunnel's. The constant of a sum (`CN_ba = CN_0 + CN_alpha α`) is the sum less the
//! slope's part. Flight determines the sum best, and the exported sum is thus the flown one.

mod settings;
mod export_table;
mod export_contents;
mod flight_update;
mod xml;
pub mod daveml;
pub mod jsbsim;
#[cfg(test)]
mod tests;

pub use export_contents::ExportContents;
pub use export_table::{draw_rows, rows};
pub use flight_update::tables;
pub use settings::Settings;
