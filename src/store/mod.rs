//! Everything that touches the disk: the archive, the store of artefacts, published tables and
//! nights, small text files.

pub mod archive;
mod artefact_name;
mod artefacts;
pub mod atomic;
mod clock_column;
mod encoding;
pub mod input_digests;
pub mod files;
pub mod fingerprint;
pub mod import;
mod in_work;
pub mod lock;
pub mod log;
mod night_links;
mod night_manifest;
mod nights;
pub mod object;
pub mod record_file;
pub mod recorder;
pub mod unmapped_recording;
mod regular;
mod shared;
pub mod table;
pub mod tunnel;
mod visible_text;

pub use artefact_name::{ArtefactName, Kind};
pub use artefacts::Store;
pub use fingerprint::{Digest, Fingerprint};
pub use in_work::{InWork, InWorkEntry, in_work};
pub use input_digests::InputDigests;
pub use log::Log;
pub use night_manifest::{Night, Summary};
pub use nights::Nights;
