//! `model.yaml` of a draft: constant, flow angle, rates, and each surface that moves.

use std::fmt::Write;

use super::contents::{Draft, short};
use crate::aero::{Axis, Output};
use crate::inspection::findings::Channel;

/// Motion of an axis in its coefficients.
fn motion(axis: Axis) -> &'static [&'static str] {
    match axis {
        Axis::Longitudinal => &["alpha", "q"],
        Axis::Lateral => &["beta", "p", "r"],
    }
}

/// Coefficients of an axis by name.
fn coefficients(axis: Axis) -> [String; 3] {
    axis.coefficients()
        .map(|coefficient| format!("{coefficient:?}"))
}

/// Names of the derivatives of an axis that every maneuver estimates.
pub fn basic(axis: Axis) -> Vec<String> {
    let mut names = Vec::new();
    for coefficient in coefficients(axis) {
        names.push(format!("{coefficient}_0"));
        names.extend(motion(axis).iter().map(|m| format!("{coefficient}_{m}")));
    }
    names
}

/// Names of the derivatives of a surface.
pub fn of_surface(axis: Axis, surface: &Channel) -> [String; 3] {
    coefficients(axis).map(|coefficient| format!("{coefficient}_{}", short(&surface.signal)))
}

/// Outputs whose constant error is estimated with the derivatives: those of accelerometers and gyros.
pub fn biased(axis: Axis) -> impl Iterator<Item = Output> {
    let outputs = axis.outputs().into_iter();
    outputs.filter(|output| {
        matches!(
            output,
            Output::An | Output::Ax | Output::Ay | Output::P | Output::Q | Output::R
        )
    })
}

/// Name of the constant error of an output.
pub fn bias(output: Output) -> String {
    format!("{}_bias", output.name())
}

/// Text of the file.
pub fn text(draft: &Draft) -> String {
    let mut text = "\
# The aerodynamic build-up: one line per derivative. CN normal force (up), CA axial force (aft), CY side force (right); Cm, Cl,
# Cn pitching, rolling, yawing moment. regressor: constant, alpha or beta (per deg), p q r (per rad of p b/2V, q c/2V, r b/2V),
# or a surface's signal (per deg). Surfaces that rest in the recording have no line.
derivatives:
"
    .to_owned();
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let surfaces = draft.surfaces(axis == Axis::Longitudinal);
        for coefficient in coefficients(axis) {
            let mut line = |end: &str, regressor: &str| {
                let name = format!("{coefficient}_{end}");
                let _ = writeln!(
                    text,
                    "  - {{ name: {name}, coefficient: {coefficient}, regressor: {regressor} }}"
                );
            };
            line("0", "constant");
            for m in motion(axis) {
                line(m, m);
            }
            for (surface, _) in &surfaces {
                line(short(&surface.signal), &surface.signal);
            }
        }
    }
    text += "\n# Constant errors of accelerometers and rate gyros, estimated with the derivatives.\nbiases:\n";
    for output in [Axis::Longitudinal, Axis::Lateral]
        .into_iter()
        .flat_map(biased)
    {
        let _ = writeln!(
            text,
            "  - {{ name: {}, output: {} }}",
            bias(output),
            output.name()
        );
    }
    text
}
