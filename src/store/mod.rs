//! Everything that touches the disk: the archive, the store of artefacts, the published tables, small text files.

pub mod archive;
pub mod artefacts;
pub mod atomic;
pub mod files;
pub mod fingerprint;
pub mod record_file;
pub mod recorder;
pub mod table;
pub mod tunnel;

pub use artefacts::Store;
pub use fingerprint::{Digest, Fingerprint};
