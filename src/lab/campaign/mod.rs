//! Simulated campaigns: flies test cards, flight by flight in parallel, and writes archive,
//! wind-tunnel database and truth.
//!
//! The recorder is off between two cards of a flight. The random numbers of a flight follow from the
//! seed and its name: the same cards give the same bytes for any number of threads.

mod study_condition;
mod test_point;
mod next_flight;
mod cards;
mod card_conditions;
mod test_cards;
mod simulated_recorder;
mod simulated_campaign;
mod flights;
mod tunnel;
mod truth;

use std::path::Path;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::pipeline::Progress;
use crate::store::{atomic, files};

pub use cards::{Cards, FlightCard};
pub use flights::FlownFlight;
pub use next_flight::{FlightLimits, NextFlight};
pub use simulated_campaign::SimulatedCampaign;
pub use study_condition::{RecordNoise, StudyCondition};
pub use test_cards::TestCards;
pub use test_point::TestPoint;
#[cfg(test)]
pub use tunnel::rows as tunnel_rows;

/// Flies all cards and writes the campaign into a folder.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file. A card that cannot be flown is a problem of its
/// flight.
pub fn run(
    campaign: &SimulatedCampaign,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Vec<FlownFlight>> {
    let cards = &campaign.cards.flights;
    progress.begin("simulate", cards.len());
    let flights = cards
        .par_iter()
        .map(|(flight_id, card)| {
            let flight = flights::fly(campaign, flight_id, card);
            write_flight(campaign, out, &flight)?;
            progress.advance(flight_id);
            Ok(flight)
        })
        .collect::<Result<Vec<FlownFlight>>>()?;
    progress.end();
    files::place_rows(&out.join("wind_tunnel.csv"), &tunnel::rows(campaign))?;
    truth::write(campaign, &out.join("truth"), &flights)?;
    Ok(flights)
}

/// Writes the recording of a flight of which at least one card was flown.
fn write_flight(campaign: &SimulatedCampaign, out: &Path, flight: &FlownFlight) -> Result<()> {
    if flight.records.is_empty() {
        return Ok(());
    }
    let path = out
        .join("flights")
        .join(format!("{}.parquet", flight.flight_id));
    let recorded = campaign.recorder.bytes(&flight.records);
    let bytes = recorded.map_err(|what| Error::store(&path, &what))?;
    atomic::place(&path, &bytes)?;
    Ok(())
}
