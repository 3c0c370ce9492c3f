//! Recordings of one maneuver under one condition, and the estimate from each. Each has fresh
//! noise; if the air is random, each is from a flight of its own.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{Output, WindTunnel};
use crate::error::Problem;
use crate::estimate::{self, Context, Estimated};
use crate::lab::campaign::{RecordNoise, SimulatedCampaign, StudyCondition};
use crate::lab::simulator::{Card, FlownManeuver, Instrument, Instruments, TrueDerivative};
use crate::maneuver::Class;
use crate::numerics::statistics::random::derived_seed;

/// A test point of the study under one condition.
#[derive(Clone, Debug)]
pub struct StudyManeuver<'a> {
    campaign: &'a SimulatedCampaign,
    pub class: &'a Class,
    card: Card,
    noise: RecordNoise,
    /// Time by which surfaces are recorded late.
    surface_delay_s: f64,
    /// Settings of the estimates.
    pub settings: estimate::Settings,
    /// Flight of all records; `None` if each record has its own.
    common_flight: Option<FlownManeuver>,
}

/// Estimate from one record, with the derivatives that were true in it.
#[derive(Clone, Debug)]
pub struct Realisation {
    pub estimated: Estimated,
    pub alpha_deg: f64,
    pub truth: Vec<TrueDerivative>,
}

/// Tunnel tables that hold given derivatives at every angle of attack.
#[must_use]
pub fn true_tables(derivatives: &[TrueDerivative]) -> WindTunnel {
    let mut tables = WindTunnel::default();
    for truth in derivatives {
        for alpha_deg in [-180.0, 180.0] {
            let point = TunnelPoint::new(alpha_deg, truth.value);
            tables.insert(&truth.derivative, point);
        }
    }
    tables
}

/// Settings of the estimates under a condition: the campaign's without uncertainty of held values and
/// instruments, which the study does not vary.
fn settings(campaign: &SimulatedCampaign, condition: &StudyCondition) -> estimate::Settings {
    let own = &campaign.config.estimate;
    estimate::Settings {
        held_uncertainty_pct: 0.0,
        calibration: BTreeMap::new(),
        weights: condition.weights.unwrap_or(own.weights),
        ..own.clone()
    }
}

impl<'a> StudyManeuver<'a> {
    /// Prepares a card under a condition, and flies it unless the air is random.
    ///
    /// # Errors
    /// The card cannot be flown.
    pub fn new(
        campaign: &'a SimulatedCampaign,
        class: &'a Class,
        card: &Card,
        condition: &StudyCondition,
    ) -> Result<StudyManeuver<'a>, Problem> {
        let card = Card {
            condition: condition.flown(),
            ..card.clone()
        };
        let common_flight = if card.condition.is_random() {
            None
        } else {
            Some(campaign.simulator.fly(&card)?)
        };
        Ok(StudyManeuver {
            campaign,
            class,
            card,
            noise: condition.noise,
            surface_delay_s: condition.surface_delay_s,
            settings: settings(campaign, condition),
            common_flight,
        })
    }

    /// Flies the maneuver once, records and estimates it.
    ///
    /// # Errors
    /// The aircraft departs in the air of this seed.
    pub fn realise(&self, seed: u64) -> Result<Realisation, Problem> {
        let flown = self.flown(seed)?;
        let truth = true_tables(&flown.truth);
        Ok(Realisation {
            estimated: self.estimate(&flown, &truth, seed),
            alpha_deg: flown.maneuver.alpha_deg,
            truth: flown.truth.clone(),
        })
    }

    /// Flight of a record.
    ///
    /// # Errors
    /// The aircraft departs in the air of this seed.
    pub fn flown(&self, seed: u64) -> Result<Cow<'_, FlownManeuver>, Problem> {
        if let Some(flown) = &self.common_flight {
            return Ok(Cow::Borrowed(flown));
        }
        let card = Card {
            seed: derived_seed(seed, "air"),
            ..self.card.clone()
        };
        self.campaign.simulator.fly(&card).map(Cow::Owned)
    }

    /// Records a flight once and estimates it from starting values; held values are true.
    pub fn estimate(&self, flown: &FlownManeuver, start: &WindTunnel, seed: u64) -> Estimated {
        let config = &self.campaign.config;
        let record = flown.recorded(&self.noise_only(), seed);
        let truth = true_tables(&flown.truth);
        let context = Context {
            start,
            ..Context::new(&config.aircraft, &config.aero_model, &truth, &self.settings)
        };
        estimate::maneuver(&record, &flown.maneuver, self.class, &context)
    }

    /// Instruments with the condition's noise and delay of the surfaces, and no other errors.
    fn noise_only(&self) -> Instruments {
        let outputs = self.class.axis.outputs().map(Output::signal);
        let coloured_time_s = self.campaign.cards.study.coloured_time_s;
        let noise_only = |(signal, instrument): (&String, &Instrument)| {
            let is_output = outputs.contains(&signal.as_str());
            let noise = instrument.noise;
            let perfect = Instrument::default();
            let instrument = match self.noise {
                RecordNoise::Coloured if is_output => Instrument {
                    coloured: noise,
                    coloured_time_s,
                    ..perfect
                },
                RecordNoise::White if is_output => Instrument { noise, ..perfect },
                RecordNoise::EveryChannel => Instrument { noise, ..perfect },
                RecordNoise::White | RecordNoise::Coloured => perfect,
            };
            (signal.clone(), instrument)
        };
        let instruments = self.campaign.cards.instruments.0.iter();
        let surfaces = &self.campaign.simulator.settings().surface_names;
        Instruments(instruments.map(noise_only).collect()).late(surfaces, self.surface_delay_s)
    }
}
