//! A maneuver of a joint estimation, and the rows of the group.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::Equations;
use crate::estimate::estimated::{Covariance, Estimated};
use crate::estimate::fitting::{StartingPoints, fit_output_error};
use crate::estimate::moving_air::air_motion::needs_filter;
use crate::estimate::moving_air::whiteness::is_white;
use crate::estimate::prepared_case::PreparedCase;
use crate::estimate::rows::RowMaker;
use crate::estimate::task::Task;
use crate::maneuver::Status;
use crate::output_error::{Fit, estimation, mean};
use crate::tables::{EstimateRow, StartingValues};

/// A maneuver with its estimation alone by output error.
pub struct Member<'a, const NX: usize, E: Equations<NX>> {
    pub task: Task<'a>,
    pub prepared: PreparedCase<'a, NX, E>,
    pub starts: StartingPoints,
    pub alone: Fit,
}

impl<'a, const NX: usize, E: Equations<NX>> Member<'a, NX, E> {
    /// Prepares a maneuver and estimates it alone by output error.
    pub fn new(task: Task<'a>) -> Result<Self, String> {
        let prepared = PreparedCase::new(&task, task.class_model()?)?;
        let starts = StartingPoints::new(&task, &prepared.case)?;
        let (mut alone, _) = fit_output_error(&task, &prepared.case, &starts)?;
        estimation::add_bounds(&prepared.case, &mut alone, &task.context.settings.iteration);
        Ok(Member {
            task,
            prepared,
            starts,
            alone,
        })
    }

    /// `true` if filter error is to estimate the maneuver.
    pub fn needs_filter(&self) -> bool {
        let method = self.task.context.settings.method;
        needs_filter(method, &self.prepared.case.measurements, &self.alone)
    }

    /// `true` if the residuals of output error show no motion of the air.
    pub fn is_white(&self) -> bool {
        is_white(&self.prepared.case.measurements, &self.alone)
    }
}

/// Result of a group: rows as for a maneuver, and the cost of each maneuver.
pub struct Fitted {
    pub estimated: Estimated,
    pub costs: Vec<f64>,
}

impl Fitted {
    /// Rows of the shared derivatives. Parameters that each maneuver keeps to itself have none.
    pub fn new<'m, 'a: 'm, const NX: usize, E: Equations<NX> + 'm>(
        task: &Task,
        names: &[String],
        fit: &Fit,
        members: impl ExactSizeIterator<Item = &'m Member<'a, NX, E>>,
        costs: Vec<f64>,
    ) -> Fitted {
        let names = names.to_vec();
        let is_shared =
            |row: &EstimateRow| row.status != Status::Estimated || names.contains(&row.derivative);
        let row_maker = RowMaker::new(task);
        let rows = row_maker.estimate_rows(Some((&names, fit))).into_iter();
        let count = members.len().max(1) as f64;
        let left_out = members.map(|m| m.prepared.left_out).sum::<f64>() / count;
        let estimated = Estimated {
            estimates: rows.filter(is_shared).collect(),
            combined: row_maker.combined_rows(&names, fit),
            correlations: vec![],
            covariance: Covariance::of_fit(&names, fit),
            history: None,
            fit_outputs: vec![],
            noise: None,
            means: None,
            fit: row_maker.fit_row(fit, left_out, StartingValues::SingleEstimates),
        };
        Fitted { estimated, costs }
    }
}

/// `true` for a derivative that each maneuver keeps to itself.
pub fn is_unshared(task: &Task, name: &str) -> bool {
    let joint = task.context.settings.joint.as_ref();
    let share_constants = joint.is_some_and(|settings| settings.share_constants);
    !share_constants && task.is_constant(name)
}

/// Mean of the maneuvers' own derivatives, weighted by their covariances; the plain mean where these
/// do not exist. `shared` has the places of the derivatives in each fit.
pub fn mean_of_own_estimates(alone: &[&Fit], shared: &[usize]) -> Vec<f64> {
    let n = shared.len();
    let values = |fit: &&Fit| DVector::from_iterator(n, shared.iter().map(|&j| fit.values[j]));
    let estimate = |fit: &&Fit| {
        let covariance: &DMatrix<f64> = fit.covariance.as_ref()?;
        Some(mean::Estimate {
            places: (0..n).collect(),
            values: values(fit),
            covariance: DMatrix::from_fn(n, n, |i, j| covariance[(shared[i], shared[j])]),
        })
    };
    let estimates: Vec<mean::Estimate> = alone.iter().filter_map(estimate).collect();
    let plain = || alone.iter().map(values).sum::<DVector<f64>>();
    let mean = mean::weighted(&estimates, n).unwrap_or_else(|| plain() / alone.len().max(1) as f64);
    mean.as_slice().to_vec()
}
