//! Names of artefacts: kind, flight or maneuver, and the fingerprint of everything that decides the
//! artefact.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Kind of artefact, with a folder of its own in the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Checks, repairs and problems of a flight.
    Ingest,
    /// Signals of a flight on one clock, Parquet.
    Records,
    /// Maneuvers found in a flight.
    Segment,
    /// Evidence of a flight on the delays and signs of its surfaces.
    Surfaces,
    /// Derivatives of a maneuver.
    Estimate,
    /// Measured and computed outputs of a maneuver, thinned for the report.
    History,
    /// Derivatives of several maneuvers estimated together.
    Joint,
    /// Prediction of a maneuver from others.
    Predict,
    /// Maneuver flown again by simulators.
    Match,
}

impl Kind {
    pub const ALL: [Kind; 9] = [
        Kind::Ingest,
        Kind::Records,
        Kind::Segment,
        Kind::Surfaces,
        Kind::Estimate,
        Kind::History,
        Kind::Joint,
        Kind::Predict,
        Kind::Match,
    ];

    /// Name of the kind's folder, and of the method that makes the artefacts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::Ingest => "ingest",
            Kind::Records => "records",
            Kind::Segment => "segment",
            Kind::Surfaces => "surfaces",
            Kind::Estimate => "estimate",
            Kind::History => "history",
            Kind::Joint => "joint",
            Kind::Predict => "predict",
            Kind::Match => "match",
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Kind::Records => "parquet",
            _ => "json",
        }
    }
}

/// Name of an artefact relative to the store: `estimate/flight_001_t00118-0123456789abcdef.json`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ArtefactName(String);

impl ArtefactName {
    /// Name of the artefact of a flight, maneuver or group. Characters that file systems reserve
    /// are replaced.
    #[must_use]
    pub fn new(kind: Kind, item: &str, fingerprint: &str) -> ArtefactName {
        let is_safe = |c: char| c.is_alphanumeric() || "-_=.".contains(c);
        let item: String = item
            .chars()
            .map(|c| if is_safe(c) { c } else { '_' })
            .collect();
        let (item, folder, extension) = (bounded(item), kind.name(), kind.extension());
        ArtefactName(format!("{folder}/{item}-{fingerprint}.{extension}"))
    }

    /// Name of a file in the folder of a kind.
    #[must_use]
    pub fn of_file(kind: Kind, file_name: &str) -> ArtefactName {
        ArtefactName(format!("{}/{file_name}", kind.name()))
    }

    /// Name of the artefact of another kind with the same item and fingerprint, both JSON.
    #[must_use]
    pub fn sibling(&self, kind: Kind) -> ArtefactName {
        ArtefactName::of_file(kind, self.file_name())
    }

    /// Name without the folder.
    #[must_use]
    pub fn file_name(&self) -> &str {
        self.0.rsplit_once('/').map_or(&self.0, |(_, file)| file)
    }

    /// Fingerprint of the key; empty for a file that is no artefact.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        let stem = self.0.rsplit_once('.').map_or("", |(stem, _)| stem);
        stem.rsplit_once('-')
            .map_or("", |(_, fingerprint)| fingerprint)
    }

    /// `true` for an artefact of this kind.
    #[must_use]
    pub fn is_of(&self, kind: Kind) -> bool {
        self.0.split_once('/').map(|(folder, _)| folder) == Some(kind.name())
    }

    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Largest number of bytes of an item in a name: file systems allow 255 for a whole name.
const LONGEST_ITEM: usize = 160;

/// An item's name; a long one is cut and ends in a hash of the whole.
fn bounded(item: String) -> String {
    if item.len() <= LONGEST_ITEM {
        return item;
    }
    let hash = &blake3::hash(item.as_bytes()).to_hex()[..16];
    let end = (0..LONGEST_ITEM - hash.len())
        .rev()
        .find(|end| item.is_char_boundary(*end));
    format!(
        "{}_{hash}",
        item.get(..end.unwrap_or(0)).unwrap_or_default()
    )
}

impl fmt::Display for ArtefactName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_kind_item_and_fingerprint_without_reserved_characters() {
        let name = ArtefactName::new(Kind::Joint, "joint/OLO/30.00", "0123");
        assert_eq!(name.as_str(), "joint/joint_OLO_30.00-0123.json");
        assert_eq!(name.file_name(), "joint_OLO_30.00-0123.json");
        assert_eq!(name.fingerprint(), "0123");
        assert!(name.is_of(Kind::Joint) && !name.is_of(Kind::Estimate));
    }

    #[test]
    fn a_long_name_is_bounded_and_its_own() {
        let name = |item: &str| ArtefactName::new(Kind::Estimate, item, "0123456789abcdef");
        let long = "ü".repeat(120);
        let (one, other) = (name(&format!("{long}1")), name(&format!("{long}2")));
        assert!(one != other && one.file_name().len() < 200);
        assert_eq!(one.fingerprint(), "0123456789abcdef");
        assert_eq!(
            name("f_t00118").file_name(),
            "f_t00118-0123456789abcdef.json"
        );
    }

    #[test]
    fn a_history_lies_beside_its_estimate() {
        let estimate = ArtefactName::new(Kind::Estimate, "f_t00118", "0123");
        let history = estimate.sibling(Kind::History);
        assert_eq!(history.as_str(), "history/f_t00118-0123.json");
    }
}
