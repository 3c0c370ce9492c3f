//! Accelerations that a flight does not record. The likelihood leaves them out, and with them what the
//! maneuver shows through them alone.
//!
//! Normal and side force also turn the flight path, so α and β determine their derivatives without
//! `an` and `ay`. The axial force turns it by its share sin α only, which does not separate axial
//! from normal force. Without `ax` the derivatives of the axial force have the tunnel's values.

use std::collections::{BTreeMap, BTreeSet};

use crate::aero::{Coefficient, Derivative, Output};
use crate::estimate::settings::Hold;
use crate::estimate::task::Task;
use crate::maneuver::{Class, Status};

/// The class without what the maneuver cannot estimate because of outputs that are not recorded, and
/// the reason for each derivative and bias.
pub(in crate::estimate) fn class_of_recorded_outputs(
    task: &Task,
) -> (Class, BTreeMap<String, String>) {
    let reasons = unseen(task);
    let is_held = |name: &String| {
        let is_by_table = task.context.settings.hold == Hold::Table;
        is_by_table && is_axial_force(task, name) && task.tunnel_value(name).is_some()
    };
    let names = reasons.keys().cloned();
    let (held, inactive): (BTreeSet<String>, BTreeSet<String>) = names.partition(is_held);
    let class = task.class.with_status(&held, Status::Held);
    (class.with_status(&inactive, Status::Inactive), reasons)
}

/// Derivatives and biases that the class would estimate and that the maneuver shows through an absent
/// output alone, each with the reason.
fn unseen(task: &Task) -> BTreeMap<String, String> {
    let axis = task.class.axis;
    let derivatives = task.context.aero_model.derivatives_of(axis);
    let of_derivatives = derivatives.map(|d| (&d.name, output_required_by(task, d)));
    let biases = task.context.aero_model.biases_of(axis);
    let biases = biases.filter(|b| task.status(&b.name) == Some(Status::Estimated));
    let of_biases = biases.map(|b| (&b.name, Some(b.output).filter(|o| task.is_absent(*o))));
    of_derivatives
        .chain(of_biases)
        .filter_map(|(name, absent)| Some((name.clone(), reason(absent?))))
        .collect()
}

/// Reason why a derivative or bias is not estimated.
fn reason(absent: Output) -> String {
    format!("`{}` is not recorded", absent.signal())
}

/// Absent output that a derivative needs in order to have the class's status. The axial force needs
/// `ax`; a regressor with the measured α̇ needs `an` or `ax`.
fn output_required_by(task: &Task, derivative: &Derivative) -> Option<Output> {
    let is_free = match task.status(&derivative.name)? {
        Status::Estimated => true,
        Status::Held => task.context.settings.hold == Hold::Evidence,
        Status::Inactive => return None,
    };
    let is_axial = is_free && derivative.coefficient == Coefficient::CA;
    let axial = Some(Output::Ax).filter(|ax| is_axial && task.is_absent(*ax));
    axial.or_else(|| task.absent_of_regressor(derivative))
}

fn is_axial_force(task: &Task, name: &str) -> bool {
    let derivative = task.context.aero_model.derivative(name);
    derivative
        .is_some_and(|d| d.coefficient == Coefficient::CA && task.absent_of_regressor(d).is_none())
}
