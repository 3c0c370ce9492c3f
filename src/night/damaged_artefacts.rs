//! Artefacts of a night that differ from what was written.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::pipeline::IngestedFlight;
use crate::store::{ArtefactName, Digest, InputDigests, Kind, Night, Store};

/// Artefacts of a night that are damaged, missing, or replaced by another artefact. A record has no
/// seal of its own; its digest is in its flight's artefact.
pub fn damaged_artefacts(
    store: &Store,
    contents: &InputDigests,
    night: &Night,
) -> Vec<ArtefactName> {
    let records = records(store, night);
    let is_intact = |(name, bytes): &(&ArtefactName, &u64)| {
        if name.is_of(Kind::Records) {
            let digest = records.get(*name);
            digest.is_some_and(|digest| store.has_record(name, digest, contents))
        } else {
            store.is_intact(name, **bytes)
        }
    };
    let artefacts: Vec<(&ArtefactName, &u64)> = night.artefacts.iter().collect();
    artefacts
        .into_par_iter()
        .filter(|artefact| !is_intact(artefact))
        .map(|(name, _)| name.clone())
        .collect()
}

/// Copies the records of a night that only the object store has into the folder, so that all of their
/// bytes are read. One that cannot be copied stays unread.
pub fn fetch_records(store: &Store, night: &Night) {
    for (name, digest) in records(store, night) {
        // A record that cannot be fetched is reported as damaged.
        let _ = store.fetch(&name, &digest);
    }
}

/// Digests of a night's records.
fn records(store: &Store, night: &Night) -> BTreeMap<ArtefactName, Digest> {
    let flights = night.artefacts.keys().filter(|a| a.is_of(Kind::Ingest));
    flights
        .filter_map(|name| store.load::<IngestedFlight>(name))
        .flat_map(|flight| flight.records().cloned().collect::<Vec<_>>())
        .map(|record| (record.name, record.digest))
        .collect()
}
