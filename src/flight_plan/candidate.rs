//! Candidates: the cards that the next flight may fly.

use crate::config::Config;
use crate::lab::campaign::{Cards, FlightCard, TestPoint};
use crate::lab::simulator::{Card, FlightCondition};
use crate::numerics::statistics::random::derived_seed;

/// Name of the flight of all candidates, so that their random numbers differ from those of
/// simulated campaigns.
const FLIGHT: &str = "next";

/// A card that the next flight may fly.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateCard {
    pub card: Card,
    /// Scale of the inputs of the class's program.
    pub scale: f64,
    /// Time of the card with its trim and recovery.
    pub minutes: f64,
}

/// Candidates of a file of cards: each class, angle of attack and scale once.
#[must_use]
pub fn candidates(cards: &Cards, config: &Config) -> Vec<CandidateCard> {
    let mut found: Vec<CandidateCard> = vec![];
    for (flight, point) in test_points(cards) {
        for &alpha_deg in &point.alpha_deg {
            let is_known = found.iter().any(|c| {
                let same_angle = c.card.alpha_deg.total_cmp(&alpha_deg).is_eq();
                same_angle && c.card.class == point.class && c.scale.total_cmp(&point.scale).is_eq()
            });
            if !is_known {
                found.extend(candidate(cards, config, flight, point, alpha_deg));
            }
        }
    }
    found
}

/// Lowest and highest angle of attack of candidates.
pub fn reach_deg<'a>(candidates: impl Iterator<Item = &'a CandidateCard>) -> (f64, f64) {
    let alphas = candidates.map(|candidate| candidate.card.alpha_deg);
    alphas.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), alpha| {
        (low.min(alpha), high.max(alpha))
    })
}

/// Test points with the flight that gives their altitude and mass: the candidates as written, or
/// else the points of all flights.
fn test_points(cards: &Cards) -> Vec<(&FlightCard, &TestPoint)> {
    let first = cards.flights.values().next();
    if cards.next.candidates.is_empty() {
        let flights = cards.flights.values();
        let points = flights.flat_map(|f| f.points.iter().map(move |p| (f, p)));
        points.collect()
    } else {
        let points = cards.next.candidates.iter();
        points.filter_map(|p| Some((first?, p))).collect()
    }
}

fn candidate(
    cards: &Cards,
    config: &Config,
    flight: &FlightCard,
    point: &TestPoint,
    alpha_deg: f64,
) -> Option<CandidateCard> {
    let next = &cards.next;
    let program = cards.programs.get(&point.class)?.scaled(point.scale);
    let name = format!("{} {alpha_deg} {}", point.class, point.scale);
    let minutes = (program.duration_s + next.settle_s) / 60.0;
    let card = Card {
        flight_id: FLIGHT.to_owned(),
        class: point.class.clone(),
        axis: config.class(&point.class)?.axis,
        alpha_deg,
        altitude_ft: next.altitude_ft.unwrap_or(flight.altitude_ft),
        heading_deg: flight.heading_deg,
        mass_slug: next.mass_slug.unwrap_or(flight.mass_slug),
        start_s: 0.0,
        condition: FlightCondition::default(),
        seed: derived_seed(cards.seed, &name),
        program,
    };
    Some(CandidateCard {
        card,
        scale: point.scale,
        minutes,
    })
}
