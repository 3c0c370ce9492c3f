//! Records as Parquet files: for each signal a column of values and one of flags, the clock in the
//! file's key-value metadata.
//!
//! A record is written row group by row group, the signals of a group in parallel. It is read by
//! signals and intervals of time. No whole record is ever in memory. Reading back returns every
//! bit. The bytes depend on the record alone: not on time, host, or the pieces in which it was
//! written.

mod columns;
mod header;
mod layout;
mod outline;
mod page_file;
mod reading;
mod writing;
#[cfg(test)]
mod tests;

pub use header::RecordHeader;
pub use layout::GROUP;
pub use reading::{RecordFile, open};
pub use writing::{SignalChunk, SignalWriter, Writer};
