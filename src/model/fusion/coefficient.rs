//! Posterior of one coefficient, in steps: evidence, scales, weights, Gaussian.

use std::collections::{BTreeMap, BTreeSet};

use super::flight_data::{FlightData, Information, Observed};
use super::held_values::{HeldDifferences, TermsPosterior};
use super::observation::Observation;
use super::observed_differences::ObservedDifferences;
use super::open_scales::add_open_scales;
use super::other_flights::OtherFlights;
use super::posterior::{
    Gaussian, WhitenedInformation, gaussian, information, of_differences, reweighted,
};
use super::scales::{LEAST_VARIANCE, centres, most_probable};
use super::self_check::{self, Agreement};
use super::unknowns::Unknowns;
use crate::aero::WindTunnel;
use crate::model::evidence::ManeuverResults;
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::{PosteriorTerm, TermSources};
use crate::numerics::linear_algebra::root::{BlockRoot, EXACT};

/// Number of reweightings: weights follow from scales, and scales from weights.
const REWEIGHTINGS: usize = 2;

/// Posterior of one coefficient, with its evidence and its self-check.
#[derive(Clone, Debug)]
pub struct CoefficientPosterior {
    pub terms: Vec<PosteriorTerm>,
    pub unknowns: Unknowns,
    pub scales: Vec<Scale>,
    /// Scales before the last step, with which the noise of the maneuvers was computed.
    pub noise_scales: Vec<Scale>,
    /// Posterior, including the spread over the scales that the data leave open.
    pub gaussian: Gaussian,
    /// Weight of each maneuver that takes part, by its index in the evidence.
    pub weights: BTreeMap<usize, f64>,
    /// Terms that each maneuver estimates, by its index in the evidence.
    pub estimated: BTreeMap<usize, Vec<usize>>,
    /// Posterior of the held derivatives' differences from the tunnel, computed from the other
    /// flights only. Keyed by maneuver id.
    pub held: BTreeMap<String, HeldDifferences>,
    /// Agreement of each flight with the others.
    pub flights: BTreeMap<String, Agreement>,
    /// Agreement of each class with the others.
    pub classes: BTreeMap<String, Agreement>,
}

impl CoefficientPosterior {
    /// Posterior of a coefficient from its terms; `None` if the evidence is not finite.
    #[must_use]
    pub fn from_terms(
        terms: Vec<PosteriorTerm>,
        evidence: &[ManeuverResults],
        basis: &TermSources,
    ) -> Option<CoefficientPosterior> {
        let mut data = Data::new(&terms, evidence, basis);
        let mut weights = vec![1.0; evidence.len()];
        let mut noise_scales = centres(&terms);
        let mut fit = data.fit(&terms, &weights, &noise_scales)?;
        for _ in 0..REWEIGHTINGS {
            let freedom = basis.settings.degrees_of_freedom;
            let root = data.observed_root(&terms, &fit, EXACT);
            let of_observed = gaussian(&root, &fit.information)?;
            weights = reweighted(&data.flights, &weights, &of_observed, freedom);
            noise_scales = fit.scales;
            fit = data.fit(&terms, &weights, &noise_scales)?;
        }
        let observed_root = data.observed_root(&terms, &fit, LEAST_VARIANCE);
        let Fit {
            observed,
            scales,
            information,
        } = fit;
        let root = data.unknowns.root(&terms, &scales, EXACT);
        let mut gaussian = gaussian(&root, &information)?;
        let terms_posterior = TermsPosterior {
            terms: &terms,
            scales: &scales,
            gaussian: &gaussian,
        };
        let held = data.held(&terms_posterior, &weights, evidence, basis.tunnel);
        let flights = data.agreement_of_flights(&weights, &gaussian);
        let all = WhitenedInformation::new(&observed_root, &information);
        let classes = data.agreement_of_classes(&all, &weights, evidence);
        add_open_scales(&observed, &scales, &mut gaussian);
        Some(CoefficientPosterior {
            terms,
            unknowns: data.unknowns,
            scales,
            noise_scales,
            gaussian,
            weights: data.estimated.keys().map(|&m| (m, weights[m])).collect(),
            estimated: data.estimated,
            held,
            flights,
            classes,
        })
    }
}

/// Most probable scales for some weights, with the evidence that they follow from.
struct Fit {
    observed: ObservedDifferences,
    scales: Vec<Scale>,
    /// Normal equations of all unknowns; the noise of the maneuvers has the scales of the start.
    information: Information,
}

/// Evidence about a coefficient.
pub struct Data {
    pub unknowns: Unknowns,
    /// Flights in the order of their ids.
    pub flights: Vec<FlightData>,
    flight_ids: Vec<String>,
    /// Index of the class, and observation, of each maneuver that estimates a term of this
    /// coefficient.
    observations: Vec<(usize, Observation)>,
    /// Maneuvers of each flight: index in the evidence, and index among the observations.
    places: Vec<Vec<(usize, usize)>>,
    estimated: BTreeMap<usize, Vec<usize>>,
}

impl Data {
    /// Collects the evidence about a coefficient's terms.
    #[must_use]
    pub fn new(terms: &[PosteriorTerm], evidence: &[ManeuverResults], basis: &TermSources) -> Data {
        Data::with_planned(terms, evidence, &[], basis).0
    }

    /// Collects the evidence as [`Data::new`] does, and the observation that each planned maneuver
    /// will make. The errors of the planned maneuvers' classes, and the delays that they share with
    /// the campaign, are among the unknowns. The planned maneuvers themselves are not evidence.
    #[must_use]
    pub fn with_planned(
        terms: &[PosteriorTerm],
        evidence: &[ManeuverResults],
        planned: &[ManeuverResults],
        basis: &TermSources,
    ) -> (Data, Vec<Option<(usize, Observation)>>) {
        let mut classes: BTreeMap<String, usize> = BTreeMap::new();
        let mut observe = |results: &ManeuverResults| {
            let observation = results.about(terms, basis.tunnel)?;
            let next = classes.len();
            let class = classes
                .entry(results.maneuver.class.clone())
                .or_insert(next);
            Some((*class, observation))
        };
        let mut observations: Vec<(usize, Observation)> = vec![];
        let mut places: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
        let mut estimated = BTreeMap::new();
        for (place, results) in evidence.iter().enumerate() {
            let Some((class, observation)) = observe(results) else {
                continue;
            };
            let of_flight = places.entry(&results.maneuver.flight_id).or_default();
            of_flight.push((place, observations.len()));
            estimated.insert(place, observation.terms.clone());
            observations.push((class, observation));
        }
        let planned: Vec<_> = planned.iter().map(observe).collect();
        let all = observations.iter().chain(planned.iter().flatten());
        let unknowns = Unknowns::new(terms, all, basis.settings.class_error);
        let mut data = Data {
            unknowns,
            flights: vec![],
            flight_ids: places.keys().map(|id| (*id).to_owned()).collect(),
            observations,
            places: places.into_values().collect(),
            estimated,
        };
        let flights = data.places.iter().map(|places| {
            FlightData::new(&observed(places, &data.observations), terms, &data.unknowns)
        });
        data.flights = flights.collect();
        (data, planned)
    }

    /// Sets each maneuver's whole noise, for these scales.
    pub fn set_noise(&mut self, terms: &[PosteriorTerm], scales: &[Scale]) {
        for (flight, places) in self.flights.iter_mut().zip(&self.places) {
            flight.set_noise(&observed(places, &self.observations), terms, scales);
        }
    }

    /// Finds the most probable scales from a start.
    fn fit(&mut self, terms: &[PosteriorTerm], weights: &[f64], start: &[Scale]) -> Option<Fit> {
        self.set_noise(terms, start);
        let information = information(&self.flights, weights, self.unknowns.count);
        let information_on_differences = of_differences(&information, &self.unknowns)?;
        let observed = ObservedDifferences::new(terms, &self.unknowns, &information_on_differences);
        let scales = most_probable(&observed, start);
        Some(Fit {
            observed,
            scales,
            information,
        })
    }

    /// Root of the prior covariance of the unknowns on which the data depend.
    fn observed_root(&self, terms: &[PosteriorTerm], fit: &Fit, least: f64) -> BlockRoot {
        let is_observed = |unknown| fit.information.is_about(unknown);
        let unknowns = &self.unknowns;
        unknowns.root_of_observed(terms, &fit.scales, least, is_observed)
    }

    /// Differences from the tunnel of the values that each maneuver holds, by the posterior of the
    /// other flights.
    fn held(
        &self,
        posterior: &TermsPosterior,
        weights: &[f64],
        evidence: &[ManeuverResults],
        tunnel: &WindTunnel,
    ) -> BTreeMap<String, HeldDifferences> {
        let mut held = BTreeMap::new();
        for of_flight in evidence.chunk_by(|a, b| a.maneuver.flight_id == b.maneuver.flight_id) {
            let place = self
                .flight_ids
                .binary_search(&of_flight[0].maneuver.flight_id);
            let flight = place.ok().map(|i| &self.flights[i]);
            let Some(others) = OtherFlights::new(posterior.gaussian, flight, weights) else {
                continue;
            };
            held.extend(of_flight.iter().filter_map(|e| {
                let differences = e.held_differences(posterior, &self.unknowns, &others, tunnel)?;
                Some((e.maneuver.maneuver_id.clone(), differences))
            }));
        }
        held
    }

    /// Agreement of each flight with the others.
    fn agreement_of_flights(
        &self,
        weights: &[f64],
        all_flights: &Gaussian,
    ) -> BTreeMap<String, Agreement> {
        let flights = self.flight_ids.iter().zip(&self.flights);
        let agreement = flights.filter_map(|(id, flight)| {
            Some((
                id.clone(),
                self_check::flight(flight, weights, all_flights)?,
            ))
        });
        agreement.collect()
    }

    /// Agreement of each class with the others; `all` is the information of all flights.
    fn agreement_of_classes(
        &self,
        all: &WhitenedInformation,
        weights: &[f64],
        evidence: &[ManeuverResults],
    ) -> BTreeMap<String, Agreement> {
        let class = |place: &usize| evidence[*place].maneuver.class.as_str();
        let names: BTreeSet<&str> = self.estimated.keys().map(class).collect();
        let agreement = names.into_iter().filter_map(|name| {
            let is_of_class = |m: usize| evidence[m].maneuver.class == name;
            let (all, count) = (all.clone(), self.unknowns.count);
            let agreement = self_check::maneuvers(&self.flights, weights, all, count, is_of_class)?;
            Some((name.to_owned(), agreement))
        });
        agreement.collect()
    }
}

/// Maneuvers of a flight, from their indices in the evidence and among the observations.
fn observed<'o>(
    places: &[(usize, usize)],
    observations: &'o [(usize, Observation)],
) -> Vec<Observed<'o>> {
    let maneuvers = places.iter().map(|&(place, i)| {
        let (class, observation) = &observations[i];
        (place, *class, observation)
    });
    maneuvers.collect()
}
