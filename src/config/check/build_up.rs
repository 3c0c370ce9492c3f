//! Checks of `model.yaml`: names are unique and resolve, and the kernel has room for the products.

use super::names::{is_given, known_signal, spelt_signal};
use crate::aero::{Axis, Regressor};
use crate::config::checked::Config;
use crate::config::source::Source;
use crate::error::{Result, did_you_mean};
use crate::flight::signal;
use crate::output_error::MOST_PRODUCTS;

/// Checks the derivatives, biases and sums of the model.
pub(super) fn aero_model(config: &Config, source: &Source) -> Result<()> {
    let aero_model = &config.aero_model;
    let derivatives = aero_model.derivatives.iter().map(|d| &d.name);
    let mut names: Vec<&String> = derivatives
        .chain(aero_model.biases.iter().map(|b| &b.name))
        .collect();
    names.extend(aero_model.combined.iter().map(|c| &c.name));
    names.sort();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(source.error(twice[0], format!("`{}` is defined twice", twice[0])));
    }
    for derivative in &aero_model.derivatives {
        for name in derivative.regressor.signals() {
            if let Some(meant) = of_the_flow(name).filter(|_| !is_given(config, name)) {
                let what = format!(
                    "{}: no channel gives the signal `{name}`; did you mean `{meant}`?",
                    derivative.name
                );
                return Err(source.error(&derivative.name, what));
            }
            if signal::is_own(name) {
                known_signal(config, source, name, &derivative.name)?;
            }
            spelt_signal(config, source, name, &derivative.name)?;
        }
    }
    few_products(config, source)?;
    for combined in &aero_model.combined {
        for part in [&combined.constant, &combined.slope] {
            if aero_model.derivative(part).is_none() {
                let near =
                    did_you_mean(part, aero_model.derivatives.iter().map(|d| d.name.as_str()));
                return Err(source.error(
                    part,
                    format!("{}: unknown derivative `{part}`{near}", combined.name),
                ));
            }
        }
    }
    Ok(())
}

/// Signal of the airspeed or the Mach number that a symbol stands for.
fn of_the_flow(symbol: &str) -> Option<&'static str> {
    match symbol {
        "V" | "v" | "TAS" | "tas" | "airspeed" | "velocity" => Some(signal::VELOCITY),
        "M" | "Ma" | "Mach" => Some(signal::MACH),
        _ => None,
    }
}

/// Checks that the kernel has room for the products that contain states.
fn few_products(config: &Config, source: &Source) -> Result<()> {
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let mut products: Vec<&Regressor> = Vec::new();
        for derivative in config.aero_model.derivatives_of(axis) {
            let regressor = &derivative.regressor;
            let is_composed = matches!(regressor, Regressor::Product(_) | Regressor::Magnitude(_));
            if is_composed && !products.contains(&regressor) {
                products.push(regressor);
            }
            if products.len() > MOST_PRODUCTS {
                let what = format!(
                    "{}: the {axis} axis has more than {MOST_PRODUCTS} products and magnitudes as regressors",
                    derivative.name
                );
                return Err(source.error(&derivative.name, what));
            }
        }
    }
    Ok(())
}
