//! The disk: archives of flight records in, artefacts out. No other module opens a file.

pub mod archive;
pub mod record_file;
