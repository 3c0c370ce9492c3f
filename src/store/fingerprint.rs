//! A fingerprint is everything that decides a result, in sixteen hexadecimal digits: the artefact
//! of a stage carries it in its name, so an artefact with the right name is up to date by
//! construction.

use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Collects what decides a result. The stage's name and the version of its method come first: a
/// change of code that changes numbers changes the version.
#[derive(Clone, Debug)]
pub struct Fingerprint(blake3::Hasher);

impl Fingerprint {
    #[must_use]
    pub fn of(stage: &str, version: u32) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(format!("{stage}/{version}").as_bytes());
        Fingerprint(hasher)
    }

    /// Adds a value, by its serialised form with its length, so that neighbours cannot run into
    /// each other.
    #[must_use]
    pub fn with(mut self, value: &impl Serialize) -> Self {
        // A value that cannot be serialised would have to be a map with keys that are no strings;
        // there is none, and a fixed text in its place could only make two results look alike that
        // the other parts tell apart.
        let bytes = serde_json::to_vec(value).unwrap_or_default();
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(&bytes);
        self
    }

    #[must_use]
    pub fn finish(self) -> String {
        self.0.finalize().to_hex()[..16].to_owned()
    }
}

/// What a file holds, in a few words: the same digest is the same content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digest {
    pub bytes: u64,
    /// Hexadecimal.
    pub blake3: String,
}

impl Digest {
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn of_file(path: &Path) -> Result<Digest> {
        let mut file = std::fs::File::open(path).map_err(Error::io(path, "cannot open it"))?;
        Digest::of(&mut file).map_err(Error::io(path, "cannot read it"))
    }

    /// Of all that a reader gives.
    ///
    /// # Errors
    /// A disk that says no.
    pub fn of(reader: &mut impl Read) -> std::io::Result<Digest> {
        let mut hasher = blake3::Hasher::new();
        let mut buffer = vec![0; 1 << 20];
        loop {
            let n = reader.read(&mut buffer)?;
            if n == 0 {
                return Ok(Digest::so_far(&hasher));
            }
            hasher.update(&buffer[..n]);
        }
    }

    /// Of what was digested so far.
    pub(super) fn so_far(hasher: &blake3::Hasher) -> Digest {
        Digest {
            bytes: hasher.count(),
            blake3: hasher.finalize().to_hex().to_string(),
        }
    }
}

/// Digits of the fingerprint at the end of a sealed text.
const SEAL: usize = 16;

/// A text with a fingerprint of its bytes in a last line, which tells whether it is as it was
/// written.
pub(super) fn sealed(mut text: Vec<u8>) -> Vec<u8> {
    let seal = seal(&text);
    text.extend_from_slice(seal.as_bytes());
    text
}

/// A sealed text without its seal; none where the seal is not its.
pub(super) fn unsealed(bytes: &[u8]) -> Option<&[u8]> {
    let (text, end) = bytes.split_at_checked(bytes.len().checked_sub(SEAL + 1)?)?;
    (end == seal(text).as_bytes()).then_some(text)
}

fn seal(text: &[u8]) -> String {
    format!("\n{}", &blake3::hash(text).to_hex()[..SEAL])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_and_their_order_count() {
        let key = |a: &str, b: &str| Fingerprint::of("segment", 1).with(&a).with(&b).finish();
        assert_eq!(key("x", "y"), key("x", "y"));
        assert_ne!(key("x", "y"), key("y", "x"));
        assert_ne!(key("xy", ""), key("x", "y"));
        assert_ne!(
            Fingerprint::of("segment", 1).finish(),
            Fingerprint::of("segment", 2).finish()
        );
    }
}
