//! Digests of the archive's files, and the content of each flight.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::{Problem, ProblemStage};
use crate::pipeline::problems::problem;
use crate::pipeline::progress::Progress;
use crate::report::SourceFile;
use crate::store::archive::FlightFiles;
use crate::store::{Digest, Fingerprint, InputDigests};

/// Content of the archive.
#[derive(Clone, Debug, Default)]
pub struct FlightContents {
    /// Fingerprint of each flight's content, or the reason for its absence.
    pub fingerprints: BTreeMap<String, Result<String, String>>,
    /// All files that could be read.
    pub sources: Vec<SourceFile>,
    /// Copies of files, which are left out.
    pub problems: Vec<Problem>,
}

impl FlightContents {
    /// Digests every file of the archive. If several flights have the same bytes, the first one
    /// counts.
    pub fn gather(
        files: &[FlightFiles],
        contents: &InputDigests,
        progress: &dyn Progress,
    ) -> FlightContents {
        progress.begin("contents", files.len());
        let digests: Vec<_> = files
            .par_iter()
            .map(|flight| {
                let digests = flight_digests(flight, contents);
                progress.advance(&flight.flight_id);
                digests
            })
            .collect();
        progress.end();
        let mut gathered = FlightContents::default();
        let mut first_flights: BTreeMap<String, &str> = BTreeMap::new();
        for (flight, digests) in files.iter().zip(digests) {
            let fingerprint = digests
                .and_then(|digests| gathered.add(flight, &digests, contents, &first_flights));
            if let Ok(fingerprint) = &fingerprint {
                first_flights.insert(fingerprint.clone(), &flight.flight_id);
            }
            gathered
                .fingerprints
                .insert(flight.flight_id.clone(), fingerprint);
        }
        gathered
    }

    /// Adds the files of a flight to the sources. Returns the fingerprint of the flight's content,
    /// or the reason to leave the flight out.
    fn add(
        &mut self,
        flight: &FlightFiles,
        digests: &[Digest],
        contents: &InputDigests,
        first_flights: &BTreeMap<String, &str>,
    ) -> Result<String, String> {
        let files = flight.files.iter().zip(digests);
        self.sources
            .extend(files.map(|(file, digest)| source_file(file, digest)));
        let fingerprint = Fingerprint::of("flight", 1).with(&digests).finish();
        if let Some(other) = first_flights.get(&fingerprint) {
            return Err(format!(
                "the same bytes as flight `{other}`, and counted once: remove one of them"
            ));
        }
        self.reject_rivals(flight, contents)?;
        Ok(fingerprint)
    }

    /// Checks the other files that claim to be this flight: copies are left out with a problem.
    ///
    /// # Errors
    /// A file with other bytes: either may be the flight.
    fn reject_rivals(
        &mut self,
        flight: &FlightFiles,
        contents: &InputDigests,
    ) -> Result<(), String> {
        let own: Vec<Digest> = flight
            .files
            .iter()
            .filter_map(|file| contents.of(file).ok())
            .collect();
        for rival in &flight.rivals {
            if !contents.of(rival).is_ok_and(|digest| own.contains(&digest)) {
                return Err(format!(
                    "two records would be flight `{}`: {} is the other; remove or rename one of them",
                    flight.flight_id,
                    rival.display()
                ));
            }
            let reason = format!(
                "a copy of a file of flight `{}`, left out",
                flight.flight_id
            );
            self.problems.push(problem(
                ProblemStage::Ingest,
                &flight.flight_id,
                &rival.display().to_string(),
                &reason,
            ));
        }
        Ok(())
    }

    /// Fingerprint of a flight's content.
    ///
    /// # Errors
    /// The reason for its absence.
    pub fn fingerprint(&self, flight_id: &str) -> Result<&str, &str> {
        match self.fingerprints.get(flight_id) {
            Some(Ok(fingerprint)) => Ok(fingerprint),
            Some(Err(reason)) => Err(reason),
            None => Err("it is not in the archive"),
        }
    }
}

/// Digests of a flight's files, in their order.
fn flight_digests(flight: &FlightFiles, contents: &InputDigests) -> Result<Vec<Digest>, String> {
    // Reasons name no folder: they are part of the lineage.
    let digest = |file: &PathBuf| {
        contents
            .of(file)
            .map_err(|why| format!("the file {} {why}", file_name(file)))
    };
    flight.files.iter().map(digest).collect()
}

fn file_name(file: &Path) -> String {
    file.file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// A file as the report lists it.
pub fn source_file(file: &Path, digest: &Digest) -> SourceFile {
    SourceFile {
        name: file_name(file),
        bytes: digest.bytes,
        blake3: digest.blake3.clone(),
    }
}
