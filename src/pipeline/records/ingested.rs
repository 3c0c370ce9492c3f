//! Flights after ingest: their stretches, and the record of each.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Problem, Result};
use crate::flight::{Correction, is_stretch};
use crate::ingest::Assessment;
use crate::maneuver::Event;
use crate::store::record_file::{self, RecordFile, RecordHeader};
use crate::store::{ArtefactName, Digest, Store};

/// A record in the store.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StoredRecord {
    pub name: ArtefactName,
    pub digest: Digest,
}

/// A stretch of a flight without a long gap, as ingest left it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct IngestedStretch {
    /// Id of the stretch: the flight's, with a number if the flight has several.
    pub flight_id: String,
    /// `None` for a rejected stretch.
    pub record: Option<StoredRecord>,
    pub assessment: Assessment,
}

impl IngestedStretch {
    /// A stretch without a record, for this reason.
    pub fn rejected(flight_id: &str, problem: Problem) -> IngestedStretch {
        IngestedStretch {
            flight_id: flight_id.to_owned(),
            record: None,
            assessment: Assessment {
                problems: vec![problem],
                ..Assessment::default()
            },
        }
    }
}

/// Artefact of ingest: the stretches of a flight.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct IngestedFlight {
    /// Problems of the flight as a whole.
    pub problems: Vec<Problem>,
    pub stretches: Vec<IngestedStretch>,
}

impl IngestedFlight {
    /// A flight without any record, for this reason.
    pub fn rejected(flight_id: &str, problem: Problem) -> IngestedFlight {
        IngestedFlight {
            problems: vec![],
            stretches: vec![IngestedStretch::rejected(flight_id, problem)],
        }
    }

    /// Records of the stretches.
    pub fn records(&self) -> impl Iterator<Item = &StoredRecord> {
        self.stretches.iter().filter_map(|s| s.record.as_ref())
    }
}

/// A stretch as an item of the campaign, with the fingerprint of its ingest.
#[derive(Clone, Debug)]
pub struct Flight {
    pub fingerprint: String,
    pub ingested: IngestedStretch,
    /// Corrections of the instruments from all flights together, in place of those from the flight
    /// alone; estimates use them, segmentation does not.
    pub by_all_flights: Option<Vec<Correction>>,
}

impl Flight {
    pub fn id(&self) -> &str {
        &self.ingested.flight_id
    }

    /// `true` for a stretch with a record.
    pub fn is_accepted(&self) -> bool {
        self.ingested.record.is_some()
    }

    /// Opens the record, with its stand-ins and corrections.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn open(&self, store: &Store) -> Result<RecordFile> {
        let record = self.ingested.record.as_ref();
        let own = &self.ingested.assessment.corrections;
        let corrections = self.by_all_flights.as_ref().unwrap_or(own);
        let record =
            record.ok_or_else(|| Error::store(self.id().as_ref(), &"the flight has no record"))?;
        store.fetch(&record.name, &record.digest)?;
        Ok(record_file::open(&store.path(&record.name))?
            .completed(self.ingested.assessment.completion.clone())
            .corrected(corrections.clone()))
    }

    /// `true` for a stretch of the flight of this id, and for the flight itself.
    pub fn is_of(&self, flight_id: &str) -> bool {
        is_stretch(self.id(), flight_id)
    }

    /// Problems as one line: `place: reason; place: reason`.
    pub fn reasons(&self) -> String {
        let problems = self.ingested.assessment.problems.iter();
        problems
            .map(|p| format!("{}: {}", p.place, p.reason))
            .collect::<Vec<_>>()
            .join("; ")
    }

    /// Selects the analyst's events in this stretch: those that name it, and those that name its
    /// flight and lie in its time.
    pub fn events(&self, events: &[Event], header: &RecordHeader) -> Vec<Event> {
        let end_s = header.start_s + header.samples as f64 * header.step_s;
        let is_inside = |e: &Event| e.start_s < end_s && e.end_s > header.start_s;
        let is_own =
            |e: &&Event| e.flight_id == self.id() || (self.is_of(&e.flight_id) && is_inside(e));
        let named = |e: &Event| Event {
            flight_id: self.id().to_owned(),
            ..e.clone()
        };
        events.iter().filter(is_own).map(named).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ProblemStage;

    fn event(flight_id: &str) -> Event {
        Event {
            flight_id: flight_id.to_owned(),
            class: "C".to_owned(),
            start_s: 10.0,
            end_s: 20.0,
        }
    }

    fn header(samples: usize) -> RecordHeader {
        RecordHeader {
            flight_id: "f".to_owned(),
            start_s: 5.0,
            step_s: 0.025,
            samples,
            ..RecordHeader::default()
        }
    }

    fn flight(flight_id: &str) -> Flight {
        let problem = Problem {
            stage: ProblemStage::Ingest,
            flight_id: String::new(),
            place: String::new(),
            reason: String::new(),
        };
        Flight {
            fingerprint: String::new(),
            ingested: IngestedStretch::rejected(flight_id, problem),
            by_all_flights: None,
        }
    }

    #[test]
    fn events_of_a_flight_belong_to_the_stretch_in_whose_time_they_lie() {
        assert!(flight("f").is_of("f") && flight("f.2").is_of("f"));
        assert!(
            !flight("f.nav").is_of("f") && !flight("f2").is_of("f") && !flight("f").is_of("f.2")
        );
        let events = [event("f"), event("f.2")];
        assert_eq!(flight("f").events(&events, &header(4000)).len(), 1);
        assert_eq!(flight("f.2").events(&events, &header(4000)).len(), 2);
        assert_eq!(flight("f.2").events(&events, &header(40)).len(), 1);
    }
}
