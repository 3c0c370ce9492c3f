//! A maneuver laid out for the estimation.

use super::task::Task;
use crate::aero::Output;
use crate::aircraft::Aircraft;
use crate::dynamics::Equations;
use crate::dynamics::motion::ManeuverSignals;
use crate::maneuver::Maneuver;
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{Case, Model, NoisyInputs, pressure_noise};

/// Everything of a maneuver's estimation that does not depend on the parameters.
pub(super) struct PreparedCase<'a, const NX: usize, E: Equations<NX>> {
    pub model: Model<'a>,
    /// Signals of the surfaces that act.
    pub surfaces: Vec<&'a str>,
    pub signals: ManeuverSignals,
    pub case: Case<NX, E>,
    /// Share of the recorded output samples that the cost leaves out.
    pub left_out: f64,
}

impl<'a, const NX: usize, E: Equations<NX>> PreparedCase<'a, NX, E> {
    /// Cuts the maneuver out of the record and lays it out for a model.
    ///
    /// # Errors
    /// Too many samples are flagged, a signal is missing, or the samples are too few.
    pub fn new(task: &Task<'a>, model: Model<'a>) -> Result<Self, String> {
        let range = task.range();
        let derivatives = model
            .free
            .iter()
            .copied()
            .chain(model.held.iter().map(|(d, _)| *d));
        let surfaces: Vec<&str> = derivatives.flat_map(|d| d.regressor.signals()).collect();
        let settings = task.context.settings;
        check_marked_share(task, &surfaces)?;
        let signals = ManeuverSignals::cut(
            task.context.aircraft,
            task.record,
            range.clone(),
            surfaces.iter().copied(),
            settings.mass_properties,
        )?;
        let measurements = task.measurements(&range)?;
        let mut case = Case::<NX, E>::new(task.context.aircraft, &signals, measurements, &model);
        let counted: usize = case.used().iter().sum();
        let recorded = task.recorded_outputs().count() * case.samples();
        let left_out = 1.0 - counted as f64 / recorded.max(1) as f64;
        if counted <= case.parameters() {
            return Err(format!(
                "{counted} output samples for {} parameters",
                case.parameters()
            ));
        }
        case.noisy_inputs = NoisyInputs {
            surfaces: noisy_surfaces(task.context.aircraft, &signals, &model),
            pressure_variance: pressure_noise::relative_variance(task.record, range),
        };
        Ok(PreparedCase {
            model,
            surfaces,
            signals,
            case,
            left_out,
        })
    }

    /// The case with the held derivatives free as well, for the effect of their errors.
    pub fn with_held_free(&self, aircraft: &Aircraft) -> Case<NX, E> {
        self.case
            .with_model(aircraft, &self.signals, &all_free(&self.model))
    }
}

/// Rejects a maneuver with too large a share of flagged samples. Samples interpolated between
/// those of a slow channel do not count; the cost leaves them out.
fn check_marked_share(task: &Task, surfaces: &[&str]) -> Result<(), String> {
    let Maneuver { start_s, end_s, .. } = *task.maneuver;
    let most = task.context.settings.max_marked_share;
    let outputs = task.recorded_outputs().map(Output::signal);
    let outputs = task.record.marked_share(outputs, start_s, end_s);
    if outputs > most {
        return Err(format!(
            "{:.0}% of its output samples are marked",
            100.0 * outputs
        ));
    }
    for surface in surfaces {
        if !task.record.signals.contains_key(*surface) {
            return Err(format!("`{surface}` is not recorded"));
        }
        let share = task.record.marked_share([*surface], start_s, end_s);
        if share > most {
            return Err(format!(
                "{:.0}% of the samples of `{surface}` are marked",
                100.0 * share
            ));
        }
    }
    Ok(())
}

/// Model with the held derivatives free as well.
pub(super) fn all_free<'a>(model: &Model<'a>) -> Model<'a> {
    let held = model.held.iter().map(|(d, _)| *d);
    Model {
        free: model.free.iter().copied().chain(held).collect(),
        held: vec![],
        ..model.clone()
    }
}
