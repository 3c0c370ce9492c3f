//! A simulated campaign: test cards, checked against the pipeline of the aircraft that flies them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::cards::Cards;
use super::simulated_recorder::Recorder;
use super::test_cards::TestCards;
use crate::config::{self, Config, Overrides, Source};
use crate::error::{Result, did_you_mean};
use crate::flight::signal;
use crate::lab::simulator::{AIR_TEMPERATURE, Card, FlightCondition, STATIC_PRESSURE, Simulator};
use crate::store::files::{self, TunnelRow};

/// Test cards with their pipeline and simulator, checked.
#[derive(Clone, Debug)]
pub struct SimulatedCampaign {
    pub cards: Cards,
    /// Configuration of the pipeline; its wind tunnel holds the true derivatives.
    pub config: Config,
    /// True derivatives as written.
    pub truth: Vec<TunnelRow>,
    pub simulator: Simulator,
    pub recorder: Recorder,
}

impl SimulatedCampaign {
    /// Reads and checks a file of cards and its pipeline.
    ///
    /// # Errors
    /// [`crate::error::Error`] with file, line and the probable meaning of the first mistake.
    pub fn load(file: &Path) -> Result<SimulatedCampaign> {
        let read = TestCards::read(file)?;
        let (cards, source) = (&read.cards, &read.source);
        let folder = if files::is_folder(&cards.pipeline) {
            cards.pipeline.clone()
        } else {
            PathBuf::from("pipelines").join(&cards.pipeline)
        };
        let truth = cards.truth.clone().ok_or_else(|| {
            source.error(
                "truth",
                "`truth` must name the file of the true derivatives",
            )
        })?;
        let overrides = Overrides {
            wind_tunnel: Some(truth.clone()),
            ..Overrides::default()
        };
        let config = Config::load(&folder, overrides)?;
        let truth = config::tunnel_rows(&truth, &config.aero_model, config.tunnel.settings())?;
        let truth = truth.into_iter().map(|(_, row)| row).collect();
        let simulator = read.simulator(&config, config.tunnel.clone())?;
        let names = signals(cards, &simulator);
        check_channels(&config, &names, source)?;
        check_instruments(cards, &names, source)?;
        let rate_hz = simulator.settings().rate_hz;
        let names: Vec<&str> = names.into_iter().collect();
        let recorder = Recorder::new(&cards.recorder, &config.channels, &names, rate_hz)
            .map_err(|(name, what)| source.error_under("recorder", &name, what))?;
        let names: Vec<&str> = config.classes.iter().map(|c| c.name.as_str()).collect();
        read.check_programs(&names)?;
        check_conditions(cards, source)?;
        Ok(SimulatedCampaign {
            cards: read.cards,
            config,
            truth,
            simulator,
            recorder,
        })
    }

    /// Card of one maneuver as the estimator assumes it, for studies: in still air, with frozen
    /// derivatives. `None` for a class without program.
    #[must_use]
    pub fn card(&self, class: &str, alpha_deg: f64) -> Option<Card> {
        let axis = self.config.class(class)?.axis;
        let conditions = self.cards.flights.values().next()?;
        Some(Card {
            flight_id: format!("{class}_{alpha_deg:02}"),
            class: class.to_owned(),
            axis,
            alpha_deg,
            altitude_ft: conditions.altitude_ft,
            heading_deg: conditions.heading_deg,
            mass_slug: conditions.mass_slug,
            start_s: 0.0,
            condition: FlightCondition::default(),
            seed: self.cards.seed,
            program: self.cards.programs.get(class)?.clone(),
        })
    }
}

/// Checks air and delays of the flights, then those of the study.
fn check_conditions(cards: &Cards, source: &Source) -> Result<()> {
    for (flight, card) in &cards.flights {
        card.condition(cards.derivatives)
            .check()
            .map_err(|what| source.error_under("flights", flight, what))?;
    }
    for condition in &cards.study.conditions {
        condition
            .flown()
            .check()
            .map_err(|what| source.error_under("study", &condition.name, what))?;
    }
    Ok(())
}

/// Signals of the simulator.
fn signals<'a>(cards: &'a Cards, simulator: &'a Simulator) -> BTreeSet<&'a str> {
    let settings = simulator.settings();
    let flags = cards.programs.values().flat_map(|p| p.flags.keys());
    let sticks = settings.laws.values().flat_map(|law| law.gearing.keys());
    let names = flags
        .chain(sticks)
        .chain(settings.surfaces.keys())
        .map(String::as_str);
    names
        .chain(signal::REQUIRED.iter().copied())
        .chain([signal::PSI, signal::TIME, STATIC_PRESSURE, AIR_TEMPERATURE])
        .collect()
}

fn check_channels(config: &Config, signals: &BTreeSet<&str>, source: &Source) -> Result<()> {
    let recorded = config.channels.iter();
    for (column, channel) in recorded.filter(|(_, channel)| channel.formula.is_none()) {
        if !signals.contains(channel.signal.as_str()) {
            let message = format!(
                "channel `{column}`: the simulator has no signal `{}`",
                channel.signal
            );
            return Err(source.error("pipeline", message));
        }
    }
    Ok(())
}

fn check_instruments(cards: &Cards, signals: &BTreeSet<&str>, source: &Source) -> Result<()> {
    for name in cards.instruments.0.keys() {
        if !signals.contains(name.as_str()) {
            let near = did_you_mean(name, signals.iter().copied());
            let message = format!("instruments: there is no signal `{name}`{near}");
            return Err(source.error_under("instruments", name, message));
        }
    }
    Ok(())
}
