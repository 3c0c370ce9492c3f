//! Rows that two flights have in common.

use std::collections::BTreeSet;

use super::ingested::{Flight, IngestedStretch};
use crate::error::ProblemStage;
use crate::maneuver::Maneuver;
use crate::pipeline::campaign::{Campaign, RepeatedRows};
use crate::pipeline::problems::problem;

/// Share of common rows from which a flight counts as a copy of another.
const COPY_SHARE: f64 = 0.9;

/// Interval of the signatures, s. The extent of repeated rows is known to this accuracy at either
/// end.
const SIGNATURE_STEP_S: f64 = 10.0;

/// Rejects flights whose id another flight has: `f.2` may be a file and the second stretch of `f`.
pub fn reject_second_ids(campaign: &mut Campaign) {
    let mut ids = BTreeSet::new();
    for flight in &mut campaign.flights {
        let id = flight.id().to_owned();
        if !ids.insert(id.clone()) {
            let reason = "a stretch of another flight has this id already; rename the file";
            let problem = problem(ProblemStage::Ingest, &id, &id, reason);
            flight.ingested = IngestedStretch::rejected(&id, problem);
        }
    }
}

/// Rejects flights that repeat the rows of another, and notes the rows that two flights share.
pub fn reject_copies(campaign: &mut Campaign) {
    for later in 1..campaign.flights.len() {
        let (before, rest) = campaign.flights.split_at_mut(later);
        let Some(flight) = rest.first_mut().filter(|f| f.is_accepted()) else {
            continue;
        };
        for earlier in before.iter().filter(|f| f.is_accepted()) {
            match shared_rows(flight, earlier) {
                Shared::None => {}
                Shared::All => {
                    reject(flight, earlier.id());
                    break;
                }
                Shared::Part(rows) => {
                    note(flight, earlier.id(), &rows);
                    campaign.repeated_rows.push(rows);
                }
            }
        }
    }
}

enum Shared {
    None,
    Part(RepeatedRows),
    All,
}

fn shared_rows(flight: &Flight, earlier: &Flight) -> Shared {
    let signature = &flight.ingested.assessment.signature;
    match signature.overlap(&earlier.ingested.assessment.signature) {
        None => Shared::None,
        Some(overlap) if overlap.share >= COPY_SHARE => Shared::All,
        Some(overlap) => Shared::Part(RepeatedRows {
            flight_id: flight.id().to_owned(),
            start_s: overlap.from_s,
            end_s: overlap.to_s,
        }),
    }
}

fn reject(flight: &mut Flight, earlier: &str) {
    let id = flight.id().to_owned();
    let reason = format!("it holds the rows of flight `{earlier}` again; it is left out");
    flight.ingested =
        IngestedStretch::rejected(&id, problem(ProblemStage::Ingest, &id, &id, &reason));
}

fn note(flight: &mut Flight, earlier: &str, rows: &RepeatedRows) {
    let RepeatedRows { start_s, end_s, .. } = rows;
    let id = flight.id().to_owned();
    let reason = format!(
        "from about {start_s:.0} s to {end_s:.0} s it holds rows that flight `{earlier}` has, too; maneuvers there \
         are taken from that one"
    );
    flight
        .ingested
        .assessment
        .problems
        .push(problem(ProblemStage::Ingest, &id, &id, &reason));
}

/// Leaves out maneuvers in rows that an earlier flight also has.
pub fn leave_out_repeated(campaign: &mut Campaign) {
    let Campaign {
        maneuvers,
        repeated_rows,
        problems,
        ..
    } = campaign;
    let is_repeated = |m: &Maneuver| repeated_rows.iter().any(|rows| lies_in(m, rows));
    for m in maneuvers.iter().filter(|m| is_repeated(m)) {
        let reason = "an earlier flight holds the same rows; it is left out";
        problems.push(problem(
            ProblemStage::Segment,
            &m.flight_id,
            &m.maneuver_id,
            reason,
        ));
    }
    maneuvers.retain(|m| !is_repeated(m));
}

fn lies_in(m: &Maneuver, rows: &RepeatedRows) -> bool {
    rows.flight_id == m.flight_id
        && m.start_s >= rows.start_s - SIGNATURE_STEP_S
        && m.end_s <= rows.end_s + SIGNATURE_STEP_S
}
