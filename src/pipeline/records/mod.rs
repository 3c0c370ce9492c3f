//! Flights of the archive and their records: columns and contents, reading within the memory, comparisons
//! between flights.

pub mod archive_columns;
pub mod flight_contents;
pub mod ingested;
pub mod lift_check;
pub mod memory_shares;
pub mod record_windows;
pub mod record_writing;
pub mod repeated_rows;
