//! One maneuver, flown again by each model and judged.

use serde::{Deserialize, Serialize};

use super::aerodynamics::Aerodynamics;
use super::decisive_difference::{DecisiveDifference, PredictedDutchRoll};
use super::dutch_roll::{LateralModes, OwnEstimates};
use super::free_run::{FreeRun, Simulation};
use super::judgement::{self, Judged, Simulated, ToleranceFinding};
use super::maneuver_recording::ManeuverRecording;
use super::mean_run::MeanRun;
use super::outputs::output_index;
use super::repeat_flight::{self, Probabilities, Repeats};
use super::specification::{Specification, Test};
use super::start::{self, MatchedStart};
use crate::aero::{AeroModel, Axis, Coefficient, WindTunnel};
use crate::aircraft::Aircraft;
use crate::flight::Record;
use crate::maneuver::{Maneuver, Means};
use crate::model::LocalPosterior;
use crate::tables::{History, HistoryOutput, MatchRow, MatchVerdict, MatchVerdictRow, ModelSource};

/// Time after the last input until surfaces without feedback are at rest, s: that of an actuator.
const SETTLED_S: f64 = 0.5;

/// Movement by which a surface counts as moved by feedback, deg: beyond noise and resolution.
const MOVED_DEG: f64 = 0.5;

/// Aircraft, models and tolerances of the proof.
#[derive(Clone, Debug)]
pub struct ProofInputs<'a> {
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
    /// Models in the order of the specification.
    pub models: &'a [(ModelSource, WindTunnel)],
    /// Posterior as a database, about which repeat flights are drawn.
    pub posterior: &'a WindTunnel,
    /// Tunnel, constant beyond its ends, for derivatives that a model lacks.
    pub tunnel: &'a WindTunnel,
    pub specification: &'a Specification,
}

/// A maneuver as recorded, with the posterior and the estimates that belong to it.
#[derive(Clone, Copy, Debug)]
pub struct RecordedManeuver<'a> {
    pub record: &'a Record,
    pub maneuver: &'a Maneuver,
    /// Posterior of the maneuver's axis at its condition; without one there are no probabilities.
    pub local: Option<&'a LocalPosterior>,
    /// Means of the record and the maneuver's own estimates, from which the Dutch roll of the
    /// flight follows.
    pub own: Option<(&'a Means, &'a OwnEstimates)>,
}

/// Rows of one maneuver, and its time history flown by the first model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Matched {
    pub rows: Vec<MatchRow>,
    pub verdicts: Vec<MatchVerdictRow>,
    /// Judged quantities measured and computed; `None` if the maneuver was not flown again.
    pub history: Option<History>,
}

impl Matched {
    /// Maneuver; empty without a model.
    #[must_use]
    pub fn maneuver_id(&self) -> &str {
        let first = self.verdicts.first();
        first.map_or("", |row| row.maneuver_id.as_str())
    }

    /// Rows of the first model.
    pub fn first_rows(&self) -> impl Iterator<Item = &MatchRow> {
        let model = self.verdicts.first().map(|row| row.model);
        self.rows.iter().filter(move |row| Some(row.model) == model)
    }
}

/// Flies a maneuver again with each model.
#[must_use]
pub fn fly_again(basis: &ProofInputs, flown: &RecordedManeuver) -> Matched {
    match RepeatableManeuver::new(basis, flown) {
        Ok(flight) => flight.matched(),
        Err(reason) => not_flown(basis, flown.maneuver, &reason),
    }
}

/// Finds the difference that decides whether a repeat flight passes the prediction of the first
/// model.
///
/// # Errors
/// The reason why no such difference exists.
pub fn decisive_difference(
    basis: &ProofInputs,
    flown: &RecordedManeuver,
) -> Result<DecisiveDifference, String> {
    RepeatableManeuver::new(basis, flown)?.decisive_difference()
}

/// Dutch roll of a lateral maneuver by its own estimates.
fn dutch_roll(
    basis: &ProofInputs,
    maneuver: &Maneuver,
    own: Option<(&Means, &OwnEstimates)>,
) -> Option<LateralModes> {
    let (means, estimates) = own.filter(|_| maneuver.axis == Axis::Lateral)?;
    let model = (basis.aircraft, basis.aero_model, basis.tunnel);
    LateralModes::new(model, (maneuver, means), estimates)
}

/// Dutch roll of a model, with that of repeat flights about the posterior's mean.
///
/// # Errors
/// A sentence if the model does not oscillate: no repeat flight passes then.
fn predicted_dutch_roll<'a>(
    modes: &'a LateralModes,
    posterior: &'a Simulation,
    model: &Simulation,
) -> Result<PredictedDutchRoll<'a>, String> {
    let own = modes.of_model(&model.aerodynamics.table);
    Ok(PredictedDutchRoll {
        modes,
        mean: &posterior.aerodynamics.table,
        model: own.ok_or("its Dutch roll does not oscillate")?,
    })
}

/// Rows of a maneuver that cannot be flown again.
#[must_use]
pub fn not_flown(basis: &ProofInputs, maneuver: &Maneuver, reason: &str) -> Matched {
    let row = |model: &ModelSource| MatchVerdictRow {
        reason: reason.to_owned(),
        ..verdict_row(maneuver, *model)
    };
    Matched {
        verdicts: basis.specification.models.iter().map(row).collect(),
        ..Matched::default()
    }
}

/// Verdict row of a maneuver before it is flown again.
fn verdict_row(maneuver: &Maneuver, model: ModelSource) -> MatchVerdictRow {
    MatchVerdictRow {
        maneuver_id: maneuver.maneuver_id.clone(),
        flight_id: maneuver.flight_id.clone(),
        class: maneuver.class.clone(),
        alpha_deg: maneuver.alpha_deg,
        model,
        verdict: MatchVerdict::NotFlown,
        margin: None,
        decided_by: String::new(),
        repeat_pct: None,
        closed_loop: None,
        reason: String::new(),
    }
}

/// A simulation with its matched start.
struct Trimmed<'a> {
    simulation: Simulation<'a>,
    start: MatchedStart,
}

/// A maneuver that can be flown again.
struct RepeatableManeuver<'a> {
    basis: &'a ProofInputs<'a>,
    maneuver: &'a Maneuver,
    local: Option<&'a LocalPosterior>,
    modes: Option<LateralModes>,
    judged: Vec<Judged<'a>>,
    recording: ManeuverRecording,
}

impl<'a> RepeatableManeuver<'a> {
    /// A maneuver that can be flown again.
    ///
    /// # Errors
    /// The reason why it cannot.
    fn new(
        basis: &'a ProofInputs,
        flown: &RecordedManeuver<'a>,
    ) -> Result<RepeatableManeuver<'a>, String> {
        let RecordedManeuver {
            record,
            maneuver,
            local,
            own,
        } = *flown;
        let specification = basis.specification;
        let tests: Vec<&Test> = specification
            .tests
            .iter()
            .filter(|test| test.judges(maneuver.axis, &maneuver.class))
            .collect();
        if tests.is_empty() {
            return Err("no test judges its class".to_owned());
        }
        let coefficients = maneuver.axis.coefficients().into_iter();
        let absent = coefficients
            .filter_map(Coefficient::accelerometer)
            .find(|output| record.is_assumed(output.signal()));
        if let Some(output) = absent {
            let signal = output.signal();
            return Err(format!("its trim needs `{signal}`, which is not recorded"));
        }
        let aircraft = (basis.aircraft, basis.aero_model);
        let modes = dutch_roll(basis, maneuver, own);
        Ok(RepeatableManeuver {
            basis,
            maneuver,
            local,
            judged: judgement::judged(&tests, modes.is_some()),
            modes,
            recording: ManeuverRecording::new(record, maneuver, aircraft, specification.trim_s)?,
        })
    }

    /// Difference that decides whether a repeat flight passes the prediction of the first model.
    fn decisive_difference(&self) -> Result<DecisiveDifference, String> {
        let basis = self.basis;
        let (model, database) = basis.models.first().ok_or("no model is given")?;
        let local = self.local.ok_or("the posterior has nothing of its axis")?;
        let posterior = self.trimmed(basis.posterior);
        let about = (&posterior.simulation, &posterior.start);
        let mean = MeanRun::fly(about, local, (basis.aero_model, self.maneuver.axis))
            .ok_or("its start is not determined")?;
        let follows_mean = *model == ModelSource::Posterior;
        let own = (!follows_mean).then(|| self.trimmed(database));
        let Trimmed { simulation, start } = own.as_ref().unwrap_or(&posterior);
        let run = simulation.fly(&start.start, self.recording.samples, mean.stride);
        let predicted = |modes| predicted_dutch_roll(modes, &posterior.simulation, simulation);
        let dutch_roll = self.modes.as_ref().map(predicted).transpose()?;
        let about = (local, basis.aero_model);
        let decisive = mean
            .decisive((&self.recording, &run), dutch_roll, about, &self.judged)
            .ok_or("its simulation departs, or no tolerance can be judged")?;
        let named = decisive.slopes.iter();
        let named = named.map(|(value, slope)| (local.values[*value].clone(), *slope));
        Ok(DecisiveDifference {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            condition: self.maneuver.condition(basis.tunnel),
            quantity: decisive.quantity,
            mean: decisive.mean,
            slopes: named.collect(),
            fixed_deviation: decisive.fixed_deviation,
            follows_mean,
        })
    }

    fn matched(&self) -> Matched {
        let posterior = self.trimmed(self.basis.posterior);
        let mean = self.simulated(&posterior);
        let repeats = self.repeats(&posterior, &mean.run);
        let mut matched = Matched::default();
        for (model, database) in self.basis.models {
            let is_other = *model != ModelSource::Posterior;
            let own = is_other.then(|| self.simulated(&self.trimmed(database)));
            let simulated = own.as_ref().unwrap_or(&mean);
            self.judge(*model, simulated, repeats.as_ref(), &mut matched);
        }
        matched
    }

    /// The maneuver with a model's derivatives, trimmed.
    fn trimmed(&self, database: &WindTunnel) -> Trimmed<'_> {
        let basis = self.basis;
        let condition = self.maneuver.condition(basis.tunnel);
        let simulation = Simulation {
            aircraft: basis.aircraft,
            recording: &self.recording,
            aerodynamics: Aerodynamics::new(
                (basis.aircraft, basis.aero_model),
                (database, basis.tunnel),
                &condition,
            ),
        };
        let start = start::matched(&simulation);
        Trimmed { simulation, start }
    }

    /// Repeat flights about the posterior's mean.
    fn repeats(&self, posterior: &Trimmed, mean: &FreeRun) -> Option<Repeats> {
        let basis = self.basis;
        let model = (basis.aero_model, self.maneuver.axis);
        let flown = (&posterior.simulation, &posterior.start);
        let known = (self.local?, self.modes.as_ref());
        let drawn = (self.judged.as_slice(), basis.specification.draws);
        repeat_flight::repeats(flown, mean, known, model, drawn)
    }

    /// Free run and Dutch roll of a trimmed model.
    fn simulated(&self, trimmed: &Trimmed) -> Simulated {
        let Trimmed { simulation, start } = trimmed;
        let modes = self.modes.as_ref();
        Simulated {
            run: simulation.fly(&start.start, self.recording.samples, 1),
            flight: modes.map(|modes| modes.flight),
            model: modes.and_then(|modes| modes.of_model(&simulation.aerodynamics.table)),
        }
    }

    /// Judges the run of one simulator, and adds its verdict, its row for each tolerance and its
    /// histories to `matched`.
    fn judge(
        &self,
        model: ModelSource,
        simulated: &Simulated,
        repeats: Option<&Repeats>,
        matched: &mut Matched,
    ) {
        let required_pct = self.basis.specification.inside_pct;
        let judged = &self.judged;
        let findings = judgement::judge(&self.recording, simulated, judged, required_pct);
        let repeat =
            repeats.map(|own| own.probabilities(&self.recording, simulated, judged, required_pct));
        let repeat = repeat.as_ref();
        matched
            .verdicts
            .push(self.verdict(model, &findings, repeat));
        let rows = findings.iter().enumerate().map(|(i, finding)| MatchRow {
            repeat_pct: repeat.map(|r| 100.0 * r.tolerances[i]),
            ..self.row(model, finding)
        });
        matched.rows.extend(rows);
        matched
            .history
            .get_or_insert_with(|| self.history(&simulated.run, &findings));
    }

    fn row(&self, model: ModelSource, finding: &ToleranceFinding) -> MatchRow {
        let maneuver = self.maneuver;
        let tolerance = finding.tolerance;
        MatchRow {
            maneuver_id: maneuver.maneuver_id.clone(),
            flight_id: maneuver.flight_id.clone(),
            class: maneuver.class.clone(),
            alpha_deg: maneuver.alpha_deg,
            model,
            test: finding.test.clone(),
            subject: finding.subject.clone(),
            requirement: finding.requirement,
            quantity: tolerance.quantity,
            unit: tolerance.quantity.unit().to_owned(),
            tolerance: tolerance.within,
            tolerance_pct: tolerance.within_pct,
            flight_value: finding.flight_value,
            model_value: finding.model_value,
            samples: finding.samples,
            inside_pct: finding.inside_pct,
            largest_excess: finding.largest_excess.map(|(excess, _)| excess),
            largest_excess_s: finding.largest_excess.map(|(_, time_s)| time_s),
            margin: finite(finding.margin),
            verdict: finding.verdict(),
            repeat_pct: None,
        }
    }

    fn verdict(
        &self,
        model: ModelSource,
        findings: &[ToleranceFinding],
        repeat: Option<&Probabilities>,
    ) -> MatchVerdictRow {
        let decisive = judgement::decisive(findings);
        let margin = decisive.map_or(f64::NEG_INFINITY, |finding| finding.margin);
        let decided_by = decisive.map_or_else(String::new, |finding| {
            format!("{} {}", finding.test, finding.tolerance.quantity.name())
        });
        MatchVerdictRow {
            verdict: judgement::verdict(margin),
            margin: finite(margin),
            decided_by,
            repeat_pct: repeat.map(|r| 100.0 * r.all_requirements),
            closed_loop: self.closed_loop(),
            ..verdict_row(self.maneuver, model)
        }
    }

    /// Returns 1 if a surface moves after the last input, which indicates feedback, else 0. `None`
    /// if the maneuver ends before that can be seen.
    fn closed_loop(&self) -> Option<usize> {
        let settled_s = self.maneuver.recognised.last_input_s? + SETTLED_S;
        let has_moved = self.recording.movement_after(settled_s) > MOVED_DEG;
        (settled_s < self.maneuver.end_s).then_some(usize::from(has_moved))
    }

    /// Judged quantities measured and computed, each once.
    fn history(&self, run: &FreeRun, findings: &[ToleranceFinding]) -> History {
        let recording = &self.recording;
        let times = (0..recording.samples).map(|k| recording.start_s + k as f64 * recording.step_s);
        let mut quantities = Vec::new();
        for finding in findings {
            if !quantities.contains(&finding.tolerance.quantity) {
                quantities.push(finding.tolerance.quantity);
            }
        }
        let output = |quantity: &crate::tables::MatchedQuantity| {
            let output = output_index(*quantity)?;
            let computed = |k: usize| run.outputs.get(k).map_or(f64::NAN, |o| o[output]);
            let samples = 0..recording.samples;
            Some(HistoryOutput {
                label: quantity.name().to_owned(),
                unit: quantity.unit().to_owned(),
                measured: recording.measured.iter().map(|m| m[output]).collect(),
                computed: samples.map(computed).collect(),
                marked: recording.repaired.iter().map(|r| r[output]).collect(),
            })
        };
        History {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.maneuver.class.clone(),
            alpha_deg: self.maneuver.alpha_deg,
            time_s: times.collect(),
            outputs: quantities.iter().filter_map(output).collect(),
            controls: vec![],
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
