//! The archive: Parquet files of flights in a folder, under a glob, or in a hive-partitioned tree.
//! An object store has objects under the same names.
//!
//! Only the columns of the channel map are read, one at a time, page by page, into numbers. A tall
//! file (time, name, value) is first written with one column a name. A fault of a file is a problem
//! of its flight, never a panic.

mod file_rules;
mod flight_files;
mod glob_paths;
mod guard;
mod in_memory;
mod numbers;
mod opened;
mod remote;
#[cfg(test)]
mod tests;
mod walk;

pub use flight_files::{FlightFiles, find};
pub(super) use guard::guarded;
pub use in_memory::read;
pub use opened::{Opened, mapped_columns, open};
