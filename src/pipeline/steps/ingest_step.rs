//! Ingest of the campaign: one artefact a flight, with the records of its stretches.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::step::{Companion, ComputedArtefact, LoadedOrMade, Step};
use super::step_runner::StepRunner;
use crate::aircraft::Aircraft;
use crate::error::{Error, Problem, ProblemStage, Result};
use crate::flight::Channel;
use crate::ingest;
use crate::lineage::Stage;
use crate::pipeline::campaign::{Campaign, Failure, MissingArtefact};
use crate::pipeline::problems::problem;
use crate::pipeline::records::flight_contents::FlightContents;
use crate::pipeline::records::ingested::{Flight, IngestedFlight};
use crate::pipeline::records::memory_shares::{MemoryShares, map_with_workers};
use crate::pipeline::records::record_writing::RecordWriting;
use crate::pipeline::records::repeated_rows;
use crate::store::archive::FlightFiles;
use crate::store::{ArtefactName, Kind, object};

/// Everything that decides the records of a flight.
///
/// The flight id comes from the file's name, and is part of the records and of every id in the
/// tables. A renamed file is therefore ingested again.
#[derive(Serialize)]
pub struct IngestKey<'a> {
    flight_id: &'a str,
    content: &'a str,
    channels: &'a BTreeMap<String, Channel>,
    constants: &'a BTreeMap<String, f64>,
    aircraft: &'a Aircraft,
    ingest: &'a ingest::Settings,
}

/// Ingest of one flight.
pub struct IngestStep<'a> {
    runner: &'a StepRunner<'a>,
    shares: MemoryShares,
    files: &'a FlightFiles,
    /// Fingerprint of the files' content.
    content: &'a str,
}

impl<'a> Step for IngestStep<'a> {
    type Key = IngestKey<'a>;
    type Artefact = IngestedFlight;

    const KIND: Kind = Kind::Ingest;
    const VERSION: u32 = 40;

    fn item(&self) -> &str {
        &self.files.flight_id
    }

    fn key(&self) -> IngestKey<'a> {
        let config = self.runner.config;
        IngestKey {
            flight_id: &self.files.flight_id,
            content: self.content,
            channels: &config.channels,
            constants: &config.constants,
            aircraft: &config.aircraft,
            ingest: &config.ingest,
        }
    }

    fn make(&self, name: &ArtefactName) -> Result<ComputedArtefact<IngestedFlight>> {
        let writing = RecordWriting {
            config: self.runner.config,
            store: &self.runner.store,
            shares: self.shares,
            fingerprint: name.fingerprint(),
        };
        let in_work = self.runner.start_flight(self.item());
        let ingested = writing.ingest(self.files)?;
        drop(in_work);
        Ok(match self.passing_fault() {
            None => ComputedArtefact::Final(ingested),
            Some(fault) => {
                ComputedArtefact::Temporary(IngestedFlight::rejected(self.item(), fault))
            }
        })
    }

    fn companions(&self, _: &ArtefactName, flight: &IngestedFlight) -> Vec<Companion> {
        let companion = |record: &crate::pipeline::records::ingested::StoredRecord| Companion {
            name: record.name.clone(),
            digest: Some(record.digest.clone()),
        };
        flight.records().map(companion).collect()
    }
}

impl IngestStep<'_> {
    /// Fault of the network, or of a file that changed while it was read. The bytes that were read
    /// may then differ from the bytes to which the key belongs.
    fn passing_fault(&self) -> Option<Problem> {
        let fault = |place: &std::path::Path, reason: &str| {
            let place = place.display().to_string();
            problem(ProblemStage::Ingest, self.item(), &place, reason)
        };
        let mut files = self.files.files.iter();
        if let Some((file, reason)) = files.find_map(|f| Some((f, object::failed(f)?))) {
            return Some(fault(file, &reason));
        }
        let changed = |file: &&std::path::PathBuf| !self.runner.contents.is_unchanged(file);
        let file = self.files.files.iter().find(changed)?;
        let reason = "changed or vanished while it was read: is it still being copied? The next run will read it";
        Some(fault(file, reason))
    }
}

/// Loads or makes the records of these flights.
///
/// # Errors
/// A fault that stops the run. A fault of one flight is a problem.
pub fn ingest(
    runner: &StepRunner,
    files: &[FlightFiles],
    contents: &FlightContents,
    campaign: &mut Campaign,
) -> Result<()> {
    let config = runner.config;
    let threads = rayon::current_num_threads();
    let shares = MemoryShares::of(config.ingest.memory_mb, config.channels.len(), threads);
    let flights = runner.with_progress("ingest", files.len(), || {
        bring_flights(runner, shares, files, contents)
    });
    campaign.problems.extend_from_slice(&contents.problems);
    for (files, flight) in files.iter().zip(flights) {
        let lost = || Error::store(&config.store, &"a flight was not ingested; run again");
        match flight.ok_or_else(lost)?? {
            Some(flight) => add_flight(campaign, &files.flight_id, flight),
            None => campaign
                .state(Stage::Ingest)
                .missing
                .push(missing(&files.flight_id)),
        }
    }
    repeated_rows::reject_second_ids(campaign);
    repeated_rows::reject_copies(campaign);
    collect_rows(campaign);
    Ok(())
}

fn missing(flight_id: &str) -> MissingArtefact {
    MissingArtefact {
        item: flight_id.to_owned(),
        flight_id: flight_id.to_owned(),
        class: None,
    }
}

/// Flight with its records; `None` if it is missing and nothing is made.
type BroughtFlight = Option<LoadedOrMade<IngestedFlight>>;

/// Loads the records of flights by all threads, and makes the missing ones, as many at once as the memory
/// allows. `None` for a flight whose thread panicked.
fn bring_flights(
    runner: &StepRunner,
    shares: MemoryShares,
    files: &[FlightFiles],
    contents: &FlightContents,
) -> Vec<Option<Result<BroughtFlight>>> {
    let load = |files: &FlightFiles| {
        let loaded = runner.load(&IngestStep {
            runner,
            shares,
            files,
            content: contents.fingerprint(&files.flight_id).ok()?,
        })?;
        runner.advance(&files.flight_id);
        Some(loaded)
    };
    let loaded: Vec<BroughtFlight> = files.par_iter().map(load).collect();
    let both = files.iter().zip(&loaded);
    let missing: Vec<&FlightFiles> = both.filter(|(_, l)| l.is_none()).map(|(f, _)| f).collect();
    let make = |files: &&FlightFiles| {
        let made = make_flight(runner, shares, files, contents);
        runner.advance(&files.flight_id);
        made
    };
    let mut made = map_with_workers(shares.flights, &missing, make).into_iter();
    let all = loaded.into_iter();
    all.map(|loaded| match loaded {
        Some(loaded) => Some(Ok(Some(loaded))),
        None => made.next().flatten(),
    })
    .collect()
}

/// Makes the records of a flight. A flight whose files cannot be read is rejected, but the rejection is
/// not saved.
fn make_flight(
    runner: &StepRunner,
    shares: MemoryShares,
    files: &FlightFiles,
    contents: &FlightContents,
) -> Result<BroughtFlight> {
    let id = &files.flight_id;
    match contents.fingerprint(id) {
        Ok(content) => runner.make_missing(&IngestStep {
            runner,
            shares,
            files,
            content,
        }),
        Err(reason) => {
            let problem = problem(ProblemStage::Ingest, id, &first_file(files), reason);
            Ok(Some(LoadedOrMade {
                name: ArtefactName::new(Kind::Ingest, id, "unread"),
                artefact: IngestedFlight::rejected(id, problem),
                is_stored: false,
            }))
        }
    }
}

/// File of a flight that a problem of the whole flight names.
fn first_file(flight: &FlightFiles) -> String {
    let first = flight.files.first();
    first.map_or_else(String::new, |file| file.display().to_string())
}

fn add_flight(campaign: &mut Campaign, flight_id: &str, flight: LoadedOrMade<IngestedFlight>) {
    let IngestedFlight {
        problems,
        stretches,
    } = flight.artefact;
    if flight.is_stored {
        campaign.state(Stage::Ingest).fresh += 1;
    } else {
        let reasons = stretches.iter().flat_map(|s| &s.assessment.problems);
        let reasons: Vec<&str> = reasons.map(|p| p.reason.as_str()).collect();
        let reasons = reasons.join("; ");
        campaign.unread.insert(flight_id.to_owned(), reasons);
    }
    campaign.problems.extend(problems);
    let fingerprint = flight.name.fingerprint();
    campaign
        .flights
        .extend(stretches.into_iter().map(|ingested| Flight {
            fingerprint: fingerprint.to_owned(),
            ingested,
            by_all_flights: None,
        }));
}

/// Collects the rows of all flights, and the rejected flights.
fn collect_rows(campaign: &mut Campaign) {
    let mut failed = Vec::new();
    for flight in &campaign.flights {
        let found = &flight.ingested.assessment;
        campaign.flight_rows.extend(found.flight.clone());
        campaign.channels.extend_from_slice(&found.channels);
        campaign.checks.extend_from_slice(&found.checks);
        campaign.instruments.extend_from_slice(&found.instruments);
        campaign.problems.extend_from_slice(&found.problems);
        if !flight.is_accepted() {
            failed.push(Failure {
                item: flight.id().to_owned(),
                reason: flight.reasons(),
            });
        }
    }
    campaign.state(Stage::Ingest).failed = failed;
}
