//! Cross-validation: a maneuver is predicted with derivatives estimated from the others of its class
//! and angle of attack.
//!
//! The derivatives of the other maneuvers are averaged, weighted by their covariances, and fixed.
//! Biases and initial states of the predicted maneuver are fitted by output error with its weights.
//! So are its constants (`CN_0`) unless `share_constants` is set, because they absorb the zero
//! errors of the flight's vanes and surfaces. The remaining difference between measured and
//! computed outputs is due to the derivatives; Theil's coefficient and R² measure it.
//!
//! Where filter error estimated the maneuver, it also fits what the prediction leaves free, with
//! the noise of the maneuver's own fit. A prediction from one sample to the next follows any
//! motion. The computed outputs are therefore those along the air's angle, as in the maneuver's
//! fit, so that the two can be compared.

mod mean_of_others;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use self::mean_of_others::mean_derivatives;
use super::context::Context;
use super::estimated::Estimated;
use super::holding::maneuver_class::class_of_maneuver;
use super::moving_air::maneuver_filter::new_filter;
use super::prepared_case::PreparedCase;
use super::rows::RowMaker;
use super::settings::Hold;
use super::settings::PredictionSettings;
use super::task::Task;
use crate::aero::{Axis, Derivative};
use crate::dynamics::{
    Equations, InGusts, Lateral, LateralInGusts, Longitudinal, LongitudinalInGusts, OUTPUTS,
};
use crate::filter_error::joint_filter::JointFilter;
use crate::filter_error::noise::Noise;
use crate::filter_error::scoring::minimise;
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};
use crate::output_error::sharing::SharedParameters;
use crate::output_error::theil::{self, OutputAgreement};
use crate::output_error::{Case, Fit, Model, Outcome, cost, estimation};
use crate::tables::{AgreementRow, FitRow, PredictedRow, PredictionStatus};

/// Prediction of a maneuver: its columns of `fits`, and a row for each output.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Predicted {
    pub summary: PredictedRow,
    pub outputs: Vec<AgreementRow>,
}

impl Predicted {
    /// A maneuver that is not predicted, with the reason.
    #[must_use]
    pub fn not_predicted(reason: impl Into<String>, others: usize) -> Predicted {
        let predicted_from = (others > 0).then_some(others);
        let summary = PredictedRow {
            prediction: Some(PredictionStatus::NotPredicted(reason.into())),
            predicted_from,
            ..PredictedRow::default()
        };
        Predicted {
            summary,
            outputs: vec![],
        }
    }
}

/// Finds for each maneuver the others of its class and angle of attack whose fits converged; `None`
/// for a maneuver whose own fit did not.
#[must_use]
pub fn predicting_maneuvers(
    maneuvers: &[Maneuver],
    fits: &[FitRow],
    settings: &PredictionSettings,
) -> Vec<Option<Vec<usize>>> {
    let converged: Vec<bool> = fits
        .iter()
        .map(|f| f.outcome == Outcome::Converged)
        .collect();
    let is_sound = |i: usize| converged.get(i).copied().unwrap_or(false);
    let near = |a: &Maneuver, b: &Maneuver| {
        (a.alpha_deg - b.alpha_deg).abs() <= settings.alpha_distance_deg
    };
    let others_of = |(i, m): (usize, &Maneuver)| {
        let is_other = |&(j, o): &(usize, &Maneuver)| {
            j != i && o.class == m.class && near(m, o) && is_sound(j)
        };
        is_sound(i).then(|| {
            maneuvers
                .iter()
                .enumerate()
                .filter(is_other)
                .map(|(j, _)| j)
                .collect()
        })
    };
    maneuvers.iter().enumerate().map(others_of).collect()
}

/// Predicts one maneuver from others. `own` is its own estimate. A failure is reported in the
/// column `prediction`.
#[must_use]
pub fn maneuver(
    record: &Record,
    maneuver: &Maneuver,
    class: &Class,
    context: &Context,
    own: &Estimated,
    others: &[&Estimated],
) -> Predicted {
    let task = Task {
        record,
        maneuver,
        class,
        context,
    };
    let (class, _) = class_of_maneuver(&task);
    let task = Task {
        class: &class,
        ..task
    };
    let predicted = match class.axis {
        Axis::Longitudinal => {
            predict::<3, Longitudinal, 4, LongitudinalInGusts>(&task, own, others)
        }
        Axis::Lateral => predict::<4, Lateral, 6, LateralInGusts>(&task, own, others),
    };
    predicted.unwrap_or_else(|reason| Predicted::not_predicted(reason, others.len()))
}

/// Predicts a maneuver with the means of the others' derivatives.
fn predict<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    task: &Task,
    own: &Estimated,
    others: &[&Estimated],
) -> Result<Predicted, String> {
    let settings = task.context.settings;
    // By evidence the others may estimate a derivative that the class's table holds.
    let model = match settings.hold {
        Hold::Table => task.class_model()?,
        Hold::Evidence => task.model_without_held()?,
    };
    let values: BTreeMap<&str, f64> = model
        .free
        .iter()
        .map(|d| d.name.as_str())
        .zip(mean_derivatives(task, &model.free, others)?)
        .collect();
    let value = |name: &str| values.get(name).copied().unwrap_or(0.0);
    let prepared = PreparedCase::<NX, E>::new(task, with_others_held(task, &model, value))?;
    let start = prepared.case.starting_values(value);
    let by_output_error = predict_by_output_error(task, &prepared.case, &start)?;
    let prediction = match own.noise {
        Some(noise) => {
            predict_in_gusts::<NX, E, NG, G>(task, &prepared, &noise, by_output_error, start)?
        }
        None => by_output_error.converged()?,
    };
    Ok(prediction_rows(
        task,
        &prepared.case,
        &prediction,
        others.len(),
    ))
}

/// Model with the derivatives fixed at the values predicted from the other maneuvers. Constants
/// stay free unless `share_constants` is set.
fn with_others_held<'a>(task: &Task, model: &Model<'a>, value: impl Fn(&str) -> f64) -> Model<'a> {
    let prediction = task.context.settings.prediction.as_ref();
    let share_constants = prediction.is_some_and(|settings| settings.share_constants);
    let is_kept = |d: &Derivative| !share_constants && task.is_constant(&d.name);
    let mut fixed = model.clone();
    fixed.free.retain(|d| is_kept(d));
    let others = model.free.iter().filter(|d| !is_kept(d));
    fixed.held.extend(others.map(|d| (*d, value(&d.name))));
    fixed
}

/// Computed outputs of a prediction.
struct Prediction {
    /// Weights of the outputs in Theil's coefficient.
    weights: [f64; OUTPUTS],
    outputs: Vec<[f64; OUTPUTS]>,
    /// Own constants, biases and initial states.
    values: Vec<f64>,
    /// Cost of output error; the reason where it does not converge.
    cost: Result<f64, String>,
}

impl Prediction {
    /// Prediction of output error that converged.
    fn converged(self) -> Result<Prediction, String> {
        match &self.cost {
            Ok(_) => Ok(self),
            Err(reason) => Err(reason.clone()),
        }
    }
}

/// Fits what the prediction leaves free by output error, and computes the outputs.
fn predict_by_output_error<const NX: usize, E: Equations<NX>>(
    task: &Task,
    case: &Case<NX, E>,
    start: &[f64],
) -> Result<Prediction, String> {
    let (settings, weights) = (task.context.settings, task.weights()?);
    if case.parameters() == 0 {
        let mut response = case.response();
        let diverged = case.respond(&[], &mut response).is_err();
        let cost = cost::sums(&response, &weights).cost();
        return Ok(Prediction {
            weights,
            outputs: response.outputs,
            values: vec![],
            cost: if diverged {
                Err("the integration diverges".into())
            } else {
                Ok(cost)
            },
        });
    }
    let fit: Fit = estimation::estimate_values(
        case,
        start.to_vec(),
        weights,
        settings.weights,
        task.resolution(),
        &settings.iteration,
    );
    Ok(Prediction {
        cost: match (fit.outcome, fit.final_cost) {
            // Collinear biases do not change the response.
            (Outcome::Converged | Outcome::Unidentifiable, Some(cost)) => Ok(cost),
            _ => Err(fit.reason),
        },
        weights: fit.weights,
        outputs: fit.response.outputs,
        values: fit.values,
    })
}

/// Fits the maneuver's constants, biases and initial states by filter error with known noise.
/// Starts from the output-error values if output error converged, otherwise from `start`.
fn predict_in_gusts<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    task: &Task,
    prepared: &PreparedCase<NX, E>,
    noise: &Noise,
    by_output_error: Prediction,
    start: Vec<f64>,
) -> Result<Prediction, String> {
    let filter = new_filter::<NX, E, NG, G>(task, prepared, &prepared.signals, &prepared.model);
    let sharing = SharedParameters::of_one(filter.names());
    let joint = JointFilter::new(std::slice::from_ref(&filter), &sharing).with_known_noise();
    let start = if by_output_error.cost.is_ok() {
        by_output_error.values.clone()
    } else {
        start
    };
    let start = joint.with_noise(&start, std::slice::from_ref(noise));
    let floors = vec![f64::NEG_INFINITY; start.len()];
    let scored = minimise(&joint, start, &floors, &task.context.settings.filter);
    let scored = scored.ok_or("filter error diverges")?;
    if !scored.converged {
        return Err(format!("filter error: {}", scored.reason));
    }
    let outputs = filter.outputs_along_air(&scored.parameters);
    Ok(Prediction {
        outputs: outputs.map_err(|_| "its equations diverge along the maneuver")?,
        ..by_output_error
    })
}

/// Columns of `fits`, and the rows of the outputs.
fn prediction_rows<const NX: usize, E: Equations<NX>>(
    task: &Task,
    case: &Case<NX, E>,
    prediction: &Prediction,
    others: usize,
) -> Predicted {
    let agreements = OutputAgreement::of_outputs(&case.measurements, &prediction.outputs);
    let weighted: Vec<(OutputAgreement, f64)> =
        agreements.iter().copied().zip(prediction.weights).collect();
    let named = || task.class.axis.outputs().into_iter().zip(&agreements);
    let whole = theil::theil(&weighted);
    let summary = PredictedRow {
        prediction: Some(PredictionStatus::Predicted),
        predicted_from: Some(others),
        predicted_cost: prediction.cost.as_ref().ok().copied(),
        theil: whole.map(|t| t.coefficient),
        theil_bias: whole.map(|t| t.bias),
        theil_variance: whole.map(|t| t.variance),
        theil_covariance: whole.map(|t| t.covariance),
        theil_of: named()
            .filter_map(|(o, a)| Some((o, a.theil()?.coefficient)))
            .collect(),
        r_squared_of: named()
            .filter_map(|(o, a)| Some((o, a.r_squared()?)))
            .collect(),
    };
    Predicted {
        summary,
        outputs: RowMaker::new(task).agreement_rows(&agreements),
    }
}
