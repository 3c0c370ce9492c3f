//! Mean of the derivatives of other maneuvers, weighted by their covariances.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::aero::Derivative;
use crate::estimate::estimated::Estimated;
use crate::estimate::task::Task;
use crate::maneuver::Status;
use crate::output_error::mean;
use crate::tables::EstimateRow;

/// Mean over the others of the derivatives that are free in the predicted maneuver; the tunnel's
/// value of a derivative that none of them estimates.
pub fn mean_derivatives(
    task: &Task,
    free: &[&Derivative],
    others: &[&Estimated],
) -> Result<Vec<f64>, String> {
    let covered = |d: &&&Derivative| others.iter().any(|o| estimated_value(o, &d.name).is_some());
    let wanted: Vec<&str> = free
        .iter()
        .filter(covered)
        .map(|d| d.name.as_str())
        .collect();
    let estimates: Vec<mean::Estimate> = others
        .iter()
        .filter_map(|o| estimate_of_wanted(o, &wanted))
        .collect();
    if estimates.is_empty() {
        return Err("no other maneuver of its class and angle of attack".into());
    }
    let mean = mean::weighted(&estimates, wanted.len())
        .ok_or("the others' covariances have no inverse")?;
    let mean: BTreeMap<&str, f64> = wanted.into_iter().zip(mean.iter().copied()).collect();
    let value = |d: &&Derivative| {
        mean.get(d.name.as_str())
            .copied()
            .or_else(|| task.tunnel_value(&d.name))
    };
    free.iter()
        .map(|d| value(d).ok_or_else(|| format!("none of the others estimates {}", d.name)))
        .collect()
}

/// Estimate of a derivative; `None` if the maneuver holds it or has no fit.
fn estimated_value(estimated: &Estimated, name: &str) -> Option<f64> {
    let of_it = |row: &&EstimateRow| row.derivative == name && row.status == Status::Estimated;
    estimated.estimates.iter().find(of_it)?.value
}

/// Estimates of the wanted derivatives by one maneuver, with their part of its covariance.
fn estimate_of_wanted(estimated: &Estimated, wanted: &[&str]) -> Option<mean::Estimate> {
    let covariance = estimated.covariance.as_ref()?;
    let (mut places, mut at, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for (place, name) in wanted.iter().enumerate() {
        let index_and_value = covariance
            .names
            .iter()
            .position(|n| n == name)
            .zip(estimated_value(estimated, name));
        if let Some((i, value)) = index_and_value {
            places.push(place);
            at.push(i);
            values.push(value);
        }
    }
    let n = covariance.names.len();
    let element = |i: usize, j: usize| {
        covariance
            .corrected
            .get(at[i] * n + at[j])
            .copied()
            .unwrap_or(0.0)
    };
    let covariance = DMatrix::from_fn(at.len(), at.len(), element);
    (!places.is_empty()).then(|| mean::Estimate {
        places,
        values: DVector::from_vec(values),
        covariance,
    })
}
