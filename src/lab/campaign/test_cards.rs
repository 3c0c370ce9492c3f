//! A file of test cards, with the checks that need no recorder.

use std::path::Path;

use super::card_conditions;
use super::cards::Cards;
use crate::aero::WindTunnel;
use crate::config::{Config, Source, cards_in_range};
use crate::error::{Result, did_you_mean};
use crate::flight::signal;
use crate::lab::simulator::{Program, Simulator};

/// A file of test cards.
#[derive(Clone, Debug)]
pub struct TestCards {
    pub cards: Cards,
    pub(crate) source: Source,
}

impl TestCards {
    /// Reads a file of cards.
    ///
    /// # Errors
    /// [`crate::error::Error`] with file, line and the probable meaning of the first mistake.
    pub fn read(file: &Path) -> Result<TestCards> {
        let source = Source::read(file.to_owned())?;
        let cards = source.parse()?;
        cards_in_range(&source)?;
        Ok(TestCards { cards, source })
    }

    /// The aircraft of the cards with a pipeline's geometry and build-up, flown with these
    /// derivatives.
    ///
    /// # Errors
    /// [`crate::error::Error`] naming the file: contradictory settings, or a derivative without
    /// value.
    pub fn simulator(&self, config: &Config, derivatives: WindTunnel) -> Result<Simulator> {
        let settings = self.cards.aircraft.clone();
        Simulator::new(&config.aircraft, &config.aero_model, derivatives, settings)
            .map_err(|message| self.source.error("aircraft", message))
    }

    /// Checks the programs and the test points against the classes of a pipeline.
    ///
    /// # Errors
    /// [`crate::error::Error`] with file, line and the probable meaning of the first mistake.
    pub fn check_programs(&self, classes: &[&str]) -> Result<()> {
        for (class, program) in &self.cards.programs {
            if !classes.contains(&class.as_str()) {
                let near = did_you_mean(class, classes.iter().copied());
                let message = format!("unknown class `{class}`{near}");
                return Err(self.source.error_under("programs", class, message));
            }
            self.check_program(class, program)?;
        }
        self.check_points()?;
        card_conditions::check(&self.cards, &self.source)
    }

    fn check_program(&self, class: &str, program: &Program) -> Result<()> {
        let error = |name: &str, message: String| {
            let message = format!("{class}: {message}");
            Err(self.source.error_under("programs", name, message))
        };
        let settings = &self.cards.aircraft;
        let Some(law) = settings.laws.get(&program.law) else {
            let near = did_you_mean(&program.law, settings.laws.keys().map(String::as_str));
            return error(&program.law, format!("no law `{}`{near}", program.law));
        };
        let (from_s, to_s) = program.maneuver_s;
        if !(0.0 <= from_s && from_s < to_s && to_s <= program.duration_s) {
            return error(
                class,
                "`maneuver_s` must be a start and a later end between 0 and `duration_s`".into(),
            );
        }
        let movable: Vec<&str> = law
            .gearing
            .keys()
            .chain(settings.surfaces.keys())
            .map(String::as_str)
            .chain([signal::THRUST])
            .collect();
        for input in &program.inputs {
            if !movable.contains(&input.signal.as_str()) {
                let near = did_you_mean(&input.signal, movable.iter().copied());
                let message = format!("law `{}` moves no `{}`{near}", program.law, input.signal);
                return error(&input.signal, message);
            }
        }
        Ok(())
    }

    fn check_points(&self) -> Result<()> {
        let flights = self.cards.flights.iter();
        let of_flights = flights
            .map(|(name, card)| ("flights", format!("flight {name}"), card.points.as_slice()));
        let candidates = self.cards.next.candidates.as_slice();
        let all = of_flights.chain([("next", "candidates".to_owned(), candidates)]);
        for (section, place, points) in all {
            for point in points {
                if !self.cards.programs.contains_key(&point.class) {
                    let known = self.cards.programs.keys().map(String::as_str);
                    let near = did_you_mean(&point.class, known);
                    let message = format!("{place}: no program `{}`{near}", point.class);
                    return Err(self.source.error_under(section, &point.class, message));
                }
            }
        }
        Ok(())
    }
}
