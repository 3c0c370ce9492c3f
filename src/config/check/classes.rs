//! Checks of a maneuver class: statuses, weights, and the description that recognises it.

use super::names::{known_signal, spelt_signal};
use crate::aero::Output;
use crate::config::checked::Config;
use crate::config::source::Source;
use crate::error::{Result, did_you_mean};
use crate::maneuver::{Class, Status};

/// Checks a class against model, tunnel and channel map.
pub(super) fn class(config: &Config, class: &Class, source: &Source) -> Result<()> {
    statuses(config, class, source)?;
    weights(class, source)?;
    recognition(config, class, source)
}

/// Message about a class.
fn of_class(class: &Class, what: &str) -> String {
    format!("class {}: {what}", class.name)
}

/// Checks the status of each derivative and bias in a class and its overrides.
fn statuses(config: &Config, class: &Class, source: &Source) -> Result<()> {
    let derivatives = config.aero_model.derivatives_of(class.axis);
    let biases = config.aero_model.biases_of(class.axis);
    let known: Vec<&str> = derivatives
        .map(|d| d.name.as_str())
        .chain(biases.map(|b| b.name.as_str()))
        .collect();
    for (name, _) in all_statuses(class) {
        if !known.contains(&name.as_str()) {
            let near = did_you_mean(name, known.iter().copied());
            let axis = class.axis.name();
            let what = format!("no {axis} derivative `{name}` in the model{near}");
            return Err(source.error(name, of_class(class, &what)));
        }
    }
    for name in known {
        if !class.statuses.contains_key(name) {
            let what = format!("`{name}` is neither estimated, held nor inactive");
            return Err(source.error("class", of_class(class, &what)));
        }
    }
    let named = |status: Status| {
        let all = all_statuses(class).filter(move |(_, own)| **own == status);
        all.map(|(name, _)| name)
    };
    let estimated = named(Status::Estimated).map(|name| (name, not_estimable(name, config)));
    let held = named(Status::Held).map(|name| (name, not_held(name, class, config)));
    let mut mistakes = estimated.chain(held);
    match mistakes.find_map(|(name, what)| Some((name, what?))) {
        None => Ok(()),
        Some((name, what)) => Err(source.error(name, of_class(class, &what))),
    }
}

/// Statuses of a class and of its overrides, by name.
fn all_statuses(class: &Class) -> impl Iterator<Item = (&String, &Status)> {
    let of_overrides = class.overrides.iter().flat_map(|o| &o.statuses);
    class.statuses.iter().chain(of_overrides)
}

/// Reason for which a derivative cannot be estimated.
fn not_estimable(name: &str, config: &Config) -> Option<String> {
    let derivative = config.aero_model.derivative(name)?;
    derivative.regressor.has_alpha_rate().then(|| {
        format!(
            "`{name}` is estimated; a derivative along `alpha_dot` is held or inactive, since its rate is the measured one, and \
             only noise separates it from the damping in pitch (docs/method.md, terms of the model)"
        )
    })
}

/// Reason for which a derivative or bias cannot be held: a bias has no prior value, and the tunnel
/// may lack the derivative.
fn not_held(name: &str, class: &Class, config: &Config) -> Option<String> {
    let mut biases = config.aero_model.biases_of(class.axis);
    if biases.any(|bias| bias.name == name) {
        return Some("a bias is estimated or inactive, not held".to_owned());
    }
    (!config.tunnel.has(name)).then(|| {
        let table = config.tunnel_name();
        format!("`{name}` is held, and {table} has no value to hold it at")
    })
}

/// Checks that each output of the class's axis has a weight, greater than zero, and no other has one.
fn weights(class: &Class, source: &Source) -> Result<()> {
    let outputs = class.axis.outputs();
    for output in outputs {
        if !class.weights.contains_key(&output) {
            let what = format!("`weights` lacks {}", word(output));
            return Err(source.error("weights", of_class(class, &what)));
        }
    }
    let all = class
        .weights
        .iter()
        .chain(class.overrides.iter().flat_map(|o| &o.weights));
    for (output, weight) in all {
        let own = word(*output);
        let what = if !outputs.contains(output) {
            let (axis, outputs) = (class.axis.name(), outputs.map(word).join(", "));
            format!("{own} is no {axis} output; they are {outputs}")
        } else if !(weight.is_finite() && *weight > 0.0) {
            format!("the weight of {own} must be greater than zero")
        } else {
            continue;
        };
        return Err(source.error_under("weights", output.name(), of_class(class, &what)));
    }
    Ok(())
}

fn word(output: Output) -> String {
    format!("`{}`", output.name())
}

/// Checks the description by which maneuvers of the class are recognised.
fn recognition(config: &Config, class: &Class, source: &Source) -> Result<()> {
    let rule = &class.recognition;
    signals_of_recognition(config, class, source)?;
    let error =
        |name: &str, what: &str| Err(source.error_under("recognise", name, of_class(class, what)));
    for (name, count) in &rule.steps {
        if count.at_least > count.at_most {
            return error(
                name,
                &format!("`{name}` has an `at_least` above its `at_most`"),
            );
        }
    }
    for name in rule.counted() {
        if !config.segment.steps.contains_key(name) {
            let what =
                format!("`segment: steps:` of pipeline.yaml gives no size for steps of `{name}`");
            return error(name, &what);
        }
    }
    if rule.inputs().is_empty() {
        let what = "nothing makes this maneuver; `steps` with `at_least`, `pulses` or `sweep` name its inputs";
        return error("recognise", what);
    }
    patterns(class, source)?;
    for (name, time_s) in [("lead_in_s", rule.lead_in_s), ("decay_s", rule.decay_s)] {
        if !(time_s.is_finite() && time_s >= 0.0) {
            return error(
                name,
                &format!("`{name}` must not be negative, not {time_s}"),
            );
        }
    }
    Ok(())
}

/// Checks the names of the signals by which maneuvers of the class are recognised.
fn signals_of_recognition(config: &Config, class: &Class, source: &Source) -> Result<()> {
    let rule = &class.recognition;
    let user = format!("class {}", class.name);
    for name in rule.flags.keys() {
        spelt_signal(config, source, name, &user)?;
    }
    for name in rule.counted() {
        // A signal without a size of its steps is none that the recorder merely lacks.
        if config.segment.steps.contains_key(name) {
            spelt_signal(config, source, name, &user)?;
        } else {
            known_signal(config, source, name, &user)?;
        }
    }
    Ok(())
}

/// Checks pulses and sweeps of a class.
fn patterns(class: &Class, source: &Source) -> Result<()> {
    let error =
        |name: &str, what: &str| Err(source.error_under("recognise", name, of_class(class, what)));
    for pulses in class.recognition.pulses.values() {
        if pulses.widths.len() < 2 || !pulses.widths.iter().all(|w| w.is_finite() && *w > 0.0) {
            return error(
                "widths",
                "`widths` are the lengths of two pulses or more, all greater than zero",
            );
        }
        if !(pulses.unit_s.0 >= 0.0 && pulses.unit_s.1 > pulses.unit_s.0) {
            return error(
                "unit_s",
                "`unit_s` is the shortest unit and the longest, in s: [0.2, 2]",
            );
        }
        if !(pulses.tolerance > 0.0 && pulses.tolerance.is_finite()) {
            return error("tolerance", "`tolerance` must be greater than zero");
        }
    }
    for sweep in class.recognition.sweep.values() {
        if sweep.at_least < 4 {
            return error("at_least", "a sweep has at least 4 swings");
        }
        if !(sweep.ratio > 1.0 && sweep.ratio.is_finite()) {
            return error(
                "ratio",
                "the frequency of a sweep rises: `ratio` must be greater than 1",
            );
        }
    }
    Ok(())
}
