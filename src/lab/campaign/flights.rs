//! Flights of a simulated campaign: the cards of each, flown one after another.

use super::cards::FlightCard;
use super::simulated_campaign::SimulatedCampaign;
use super::test_point::TestPoint;
use crate::error::Problem;
use crate::flight::Record;
use crate::lab::simulator::{Card, FlownManeuver, Instruments};
use crate::numerics::statistics::random::derived_seed;

/// Record time of a flight's first sample.
const FIRST_S: f64 = 100.0;

/// Recorder off time between two cards.
const OFF_S: f64 = 30.0;

/// A flight after its cards: maneuvers, instruments, and cards that could not be flown.
#[derive(Clone, Debug, Default)]
pub struct FlownFlight {
    pub flight_id: String,
    pub flown: Vec<FlownManeuver>,
    pub instruments: Instruments,
    pub problems: Vec<Problem>,
    /// Records of the cards, with the errors of the instruments.
    pub(super) records: Vec<Record>,
}

/// Flies the cards of one flight.
pub fn fly(campaign: &SimulatedCampaign, flight_id: &str, flight_card: &FlightCard) -> FlownFlight {
    let seed = derived_seed(campaign.cards.seed, flight_id);
    let surfaces = &campaign.simulator.settings().surface_names;
    let instruments = campaign.cards.instruments.drawn(seed);
    let instruments = instruments.late(surfaces, flight_card.surface_delay_s);
    let mut flight = FlownFlight {
        flight_id: flight_id.to_owned(),
        instruments,
        ..FlownFlight::default()
    };
    let mut start_s = FIRST_S;
    for (k, card) in cards(campaign, flight_id, flight_card, seed)
        .into_iter()
        .enumerate()
    {
        let card = Card { start_s, ..card };
        match campaign.simulator.fly(&card) {
            Ok(flown) => {
                let record_seed = derived_seed(seed, &format!("card {k}"));
                flight
                    .records
                    .push(flown.recorded(&flight.instruments, record_seed));
                flight.flown.push(flown);
            }
            Err(problem) => flight.problems.push(problem),
        }
        start_s += card.program.duration_s + OFF_S;
    }
    flight
}

/// Cards of a flight: its test points in order, each lighter by the fuel burnt.
fn cards(
    campaign: &SimulatedCampaign,
    flight_id: &str,
    flight: &FlightCard,
    seed: u64,
) -> Vec<Card> {
    let points = flight
        .points
        .iter()
        .flat_map(|p| p.alpha_deg.iter().map(move |alpha| (p, *alpha)));
    let card = |(k, (point, alpha_deg)): (usize, (&TestPoint, f64))| {
        Some(Card {
            flight_id: flight_id.to_owned(),
            class: point.class.clone(),
            axis: campaign.config.class(&point.class)?.axis,
            alpha_deg,
            altitude_ft: flight.altitude_ft,
            heading_deg: flight.heading_deg,
            mass_slug: flight.mass_slug - flight.burnt_slug * k as f64,
            start_s: 0.0,
            condition: flight.condition(campaign.cards.derivatives),
            seed: derived_seed(seed, &format!("air {k}")),
            program: campaign
                .cards
                .programs
                .get(&point.class)?
                .scaled(point.scale),
        })
    };
    points.enumerate().filter_map(card).collect()
}
