//! Export of the flight-updated derivatives for simulators: rows (CSV, Parquet), DAVE-ML, and a JSBSim
//! aerodynamics section. Each value names its source.
//!
//! A derivative's breakpoints are those of the tunnel and of the trend together. Where the tunnel
//! depends on Mach or a third variable, the lowest and highest flown values are breakpoints too:
//! flight's value stands between them, the tunnel's beyond. The constants of sums are exported so
//! that the sums (`CN_ba = CN_0 + CN_alpha α`), which flight determines best, come out as flown.

mod settings;
mod derivative_table;
mod contents;
mod flight_update;
mod xml;
pub mod daveml;
pub mod jsbsim;
#[cfg(test)]
mod tests;

pub use contents::Contents;
pub use derivative_table::rows;
pub use flight_update::tables;
pub use settings::Settings;
