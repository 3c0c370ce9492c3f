//! Fingerprints: sixteen hexadecimal digits of everything that decides a result. An artefact
//! carries the fingerprint in its name, so an artefact of the right name is up to date by
//! construction.

use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::regular;
use crate::error::{Error, Result};

/// Hash over everything that decides a result. Name and version of the method come first: a change
/// of code that changes numbers changes the version.
#[derive(Clone, Debug)]
pub struct Fingerprint(blake3::Hasher);

impl Fingerprint {
    #[must_use]
    pub fn of(stage: &str, version: u32) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(format!("{stage}/{version}").as_bytes());
        Fingerprint(hasher)
    }

    /// Adds a value in serialised form, preceded by its length so that neighbours stay apart.
    #[must_use]
    pub fn with(mut self, value: &impl Serialize) -> Self {
        // Only a map whose keys are no strings fails; no key has one.
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

/// Digest of a file's content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digest {
    pub bytes: u64,
    /// BLAKE3, hexadecimal.
    pub blake3: String,
}

impl Digest {
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn of_file(path: &Path) -> Result<Digest> {
        let mut file = regular::open(path).map_err(Error::io(path, "cannot open it"))?;
        Digest::of(&mut file).map_err(Error::io(path, "cannot read it"))
    }

    /// Digests everything that a reader yields.
    ///
    /// # Errors
    /// The reader fails.
    pub fn of(reader: &mut impl Read) -> std::io::Result<Digest> {
        let mut hasher = blake3::Hasher::new();
        let mut buffer = vec![0; 1 << 16];
        loop {
            let n = reader.read(&mut buffer)?;
            if n == 0 {
                return Ok(Digest::so_far(&hasher));
            }
            hasher.update(&buffer[..n]);
        }
    }

    /// Digest of the bytes so far.
    pub(super) fn so_far(hasher: &blake3::Hasher) -> Digest {
        Digest {
            bytes: hasher.count(),
            blake3: hasher.finalize().to_hex().to_string(),
        }
    }
}

/// Digits of the fingerprint that ends a sealed text.
const SEAL: usize = 16;

/// Seals a text under a name: appends a fingerprint of both as a last line. It reveals damage, and
/// a text stored under another name.
pub(super) fn sealed(name: &str, mut text: Vec<u8>) -> Vec<u8> {
    let seal = seal(name, &text);
    text.extend_from_slice(seal.as_bytes());
    text
}

/// Text of a sealed text; `None` if the seal does not fit name and text.
pub(super) fn unsealed<'a>(name: &str, bytes: &'a [u8]) -> Option<&'a [u8]> {
    let (text, end) = bytes.split_at_checked(bytes.len().checked_sub(SEAL + 1)?)?;
    (end == seal(name, text).as_bytes()).then_some(text)
}

fn seal(name: &str, text: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(name.len() as u64).to_le_bytes());
    hasher.update(name.as_bytes());
    hasher.update(text);
    format!("\n{}", &hasher.finalize().to_hex()[..SEAL])
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
