//! Segment of the campaign: one artefact a stretch, with its maneuvers.

use rayon::prelude::*;
use serde::Serialize;

use super::step::{ComputedArtefact, LoadedOrMade, Step};
use super::step_runner::{AbsentArtefacts, StepRunner};
use crate::aero::Axis;
use crate::config::Config;
use crate::error::{ProblemStage, Result};
use crate::lineage::Stage;
use crate::maneuver::{Event, Recognition};
use crate::pipeline::campaign::{Campaign, Failure, MissingArtefact};
use crate::pipeline::problems::problem;
use crate::pipeline::records::ingested::Flight;
use crate::pipeline::records::record_windows::{FoundManeuvers, find_maneuvers};
use crate::pipeline::records::repeated_rows;
use crate::segment;
use crate::store::{ArtefactName, Kind, Store};

/// Everything that decides the maneuvers of a stretch.
#[derive(Serialize)]
pub struct SegmentKey<'a> {
    flight_id: &'a str,
    /// Fingerprint of the flight's ingest.
    ingest: &'a str,
    /// Name, axis and recognition of each class.
    classes: Vec<(&'a str, Axis, &'a Recognition)>,
    segment: &'a segment::Settings,
    events: Vec<Event>,
}

/// Search for the maneuvers of one stretch.
pub struct SegmentStep<'a> {
    config: &'a Config,
    store: &'a Store,
    flight: &'a Flight,
    /// Events of the analyst in this stretch.
    events: Vec<Event>,
}

impl<'a> SegmentStep<'a> {
    /// Prepares the step. The record is opened only if the analyst gives events.
    ///
    /// # Errors
    /// The record cannot be opened.
    pub fn new(
        config: &'a Config,
        store: &'a Store,
        flight: &'a Flight,
    ) -> Result<SegmentStep<'a>> {
        let events = match config.events.as_slice() {
            [] => Vec::new(),
            events => flight.events(events, &flight.open(store)?.header),
        };
        Ok(SegmentStep {
            config,
            store,
            flight,
            events,
        })
    }
}

impl<'a> Step for SegmentStep<'a> {
    type Key = SegmentKey<'a>;
    type Artefact = FoundManeuvers;

    const KIND: Kind = Kind::Segment;
    const VERSION: u32 = 16;

    fn item(&self) -> &str {
        self.flight.id()
    }

    fn key(&self) -> SegmentKey<'a> {
        let classes = self.config.classes.iter();
        SegmentKey {
            flight_id: self.flight.id(),
            ingest: &self.flight.fingerprint,
            classes: classes
                .map(|c| (c.name.as_str(), c.axis, &c.recognition))
                .collect(),
            segment: &self.config.segment,
            events: self.events.clone(),
        }
    }

    fn make(&self, _: &ArtefactName) -> Result<ComputedArtefact<FoundManeuvers>> {
        let record = self.flight.open(self.store)?;
        find_maneuvers(self.config, &record, &self.events).map(ComputedArtefact::Final)
    }
}

/// Loads or makes the maneuvers of all accepted flights.
///
/// # Errors
/// A fault that stops the run.
pub fn segment(runner: &StepRunner, campaign: &mut Campaign) -> Result<()> {
    let flights: Vec<&Flight> = campaign
        .flights
        .iter()
        .filter(|f| f.is_accepted())
        .collect();
    let found =
        runner.with_progress("segment", flights.len(), || bring_flights(runner, &flights))?;
    let ids: Vec<String> = flights.iter().map(|f| f.id().to_owned()).collect();
    for (id, found) in ids.into_iter().zip(found) {
        match found {
            Some(found) => add_maneuvers(campaign, found.artefact),
            None => campaign
                .state(Stage::Segment)
                .missing
                .push(MissingArtefact {
                    item: id.clone(),
                    flight_id: id,
                    class: None,
                }),
        }
    }
    repeated_rows::leave_out_repeated(campaign);
    report_events_without_flight(runner.config, campaign);
    Ok(())
}

fn bring_flights(
    runner: &StepRunner,
    flights: &[&Flight],
) -> Result<Vec<Option<LoadedOrMade<FoundManeuvers>>>> {
    flights
        .par_iter()
        .map(|flight| {
            let found = match SegmentStep::new(runner.config, &runner.store, flight) {
                Ok(step) => runner.load_or_make(&step),
                // A record that cannot be opened will be made again.
                Err(_) if runner.absent == AbsentArtefacts::Report => Ok(None),
                Err(error) => Err(error),
            };
            runner.advance(flight.id());
            found
        })
        .collect()
}

fn add_maneuvers(campaign: &mut Campaign, found: FoundManeuvers) {
    let state = campaign.state(Stage::Segment);
    state.fresh += 1;
    let rejections = found.problems.iter().filter(|p| p.stage.is_rejection());
    state.failed.extend(rejections.map(|p| Failure {
        item: p.flight_id.clone(),
        reason: format!("{}: {}", p.place, p.reason),
    }));
    campaign.maneuvers.extend(found.maneuvers);
    campaign.unknown.extend(found.unknown);
    campaign.events.extend(found.events);
    campaign.problems.extend(found.problems);
}

/// Adds a problem for each event of the analyst whose flight the archive lacks.
fn report_events_without_flight(config: &Config, campaign: &mut Campaign) {
    let has_flight = |event: &Event| campaign.flights.iter().any(|f| f.is_of(&event.flight_id));
    let problems: Vec<_> = config
        .events
        .iter()
        .filter(|event| !has_flight(event))
        .map(|event| {
            let place = format!("event {} at {:.1} s", event.class, event.start_s);
            let reason = "the archive has no such flight; the analyst's list names it";
            problem(ProblemStage::Segment, &event.flight_id, &place, reason)
        })
        .collect();
    campaign.problems.extend(problems);
}
