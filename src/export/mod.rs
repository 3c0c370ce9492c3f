//! Export of the flight-updated derivatives for simulators: rows (CSV, Parquet), DAVE-ML, and a JSBSim
//! aerodynamics section. Each value names its source.
//!
//! The values are the posterior's, with its breakpoints. Derivatives that the posterior does not have
//! are the tunnel's. The constant of a sum is the sum less the slope's part, so that the sum
//! (`CN_ba = CN_0 + CN_alpha α`), which flight determines best, comes out as flown.

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
