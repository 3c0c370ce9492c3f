//! The checks of a configuration that its types cannot make: names resolve, units fit, nothing is missing.

use std::path::Path;

use super::Config;
use super::source::{Files, Source};
use crate::aero::{Buildup, Output, WindTunnel};
use crate::error::{Error, Result, did_you_mean};
use crate::estimate::Hold;
use crate::flight::signal;
use crate::maneuver::{Class, Event, Status};
use crate::store::files;
use crate::units::Unit;

/// Reads the tunnel's table; units must be those of the model's derivatives.
pub(super) fn tunnel(path: &Path, buildup: &Buildup) -> Result<WindTunnel> {
    let plain = |name: &str| name.replace('_', "");
    let mut tunnel = WindTunnel::default();
    for (line, row) in files::tunnel_rows(path)? {
        let error = |what: String| Err(Error::config(path, Some(line), what));
        let derivative = buildup.derivatives.iter().find(|d| plain(&d.name) == plain(&row.derivative));
        if let Some(unit) = derivative.map(|d| d.unit().name()).filter(|unit| *unit != row.unit) {
            return error(format!("`{}` is in `{}`, the model's unit is `{unit}`", row.derivative, row.unit));
        }
        if !(row.alpha_deg.is_finite() && row.value.is_finite()) {
            return error(format!("`{}` has a value that is no number", row.derivative));
        }
        tunnel.insert(&row.derivative, row.point());
    }
    Ok(tunnel)
}

/// Reads the analyst's events, where there are any.
pub(super) fn events(path: Option<&Path>, classes: &[Class]) -> Result<Vec<Event>> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let mut events = Vec::new();
    for (line, event) in files::events(path)? {
        let known = classes.iter().map(|c| c.name.as_str());
        if !known.clone().any(|name| name == event.class) {
            let what = format!("unknown class `{}`{}", event.class, did_you_mean(&event.class, known));
            return Err(Error::config(path, Some(line), what));
        }
        // Also refuses times that are no numbers.
        if event.end_s.partial_cmp(&event.start_s) != Some(std::cmp::Ordering::Greater) {
            return Err(Error::config(path, Some(line), "the event ends before it starts"));
        }
        events.push(event);
    }
    Ok(events)
}

/// Checks everything against everything.
pub(super) fn whole(config: &Config, files: &Files) -> Result<()> {
    aircraft(config, &files.aircraft)?;
    channels(config, &files.aircraft)?;
    model(config, &files.model)?;
    for (class, source) in config.classes.iter().zip(&files.classes) {
        statuses(config, class, source)?;
        weights(class, source)?;
        recognition(config, class, source)?;
    }
    stages(config, &files.pipeline)
}

fn aircraft(config: &Config, source: &Source) -> Result<()> {
    let a = &config.aircraft;
    let positive = [
        ("aircraft", "wing_area_ft2", a.wing_area_ft2),
        ("aircraft", "span_ft", a.span_ft),
        ("aircraft", "chord_ft", a.chord_ft),
        ("alpha_vane", "factor", a.sensors.alpha_vane.factor),
        ("beta_vane", "factor", a.sensors.beta_vane.factor),
    ];
    for (key, name, value) in positive {
        if !(value.is_finite() && value > 0.0) {
            return Err(source.error_under(key, name, format!("`{name}` must be greater than zero, not {value}")));
        }
    }
    if !(-90.0..=90.0).contains(&a.latitude_deg) {
        return Err(source.error("latitude_deg", "`latitude_deg` must lie between -90 and 90"));
    }
    Ok(())
}

fn channels(config: &Config, source: &Source) -> Result<()> {
    let mut signals: Vec<&str> = config.constants.keys().map(String::as_str).collect();
    for (column, channel) in &config.channels {
        let error = |what: String| Err(source.error_under("channels", column, what));
        let unit = match Unit::parse(&channel.unit) {
            Ok(unit) => unit,
            Err(what) => return error(format!("channel `{column}`: {what}")),
        };
        let target = Unit::of_signal(&channel.signal);
        if unit.factor_to(target).is_none() {
            let (unit, target, signal) = (unit.name, target.name, &channel.signal);
            return error(format!("channel `{column}`: `{unit}` cannot become {target} of `{signal}`"));
        }
        if ![1.0, -1.0].contains(&channel.sign) {
            return error(format!("channel `{column}`: sign is 1 or -1, not {}", channel.sign));
        }
        if !(channel.scale.is_finite() && channel.scale > 0.0) {
            return error(format!("channel `{column}`: scale must be greater than zero; a sign is `sign`"));
        }
        if signals.contains(&channel.signal.as_str()) {
            return error(format!("signal `{}` has two sources", channel.signal));
        }
        signals.push(&channel.signal);
    }
    for required in std::iter::once(&"time_s").chain(signal::REQUIRED) {
        if !signals.contains(required) {
            let near = did_you_mean(required, signals.iter().copied());
            return Err(source.error("channels", format!("no channel or constant gives the signal `{required}`{near}")));
        }
    }
    Ok(())
}

/// The names of all signals of the channel map and the constants.
fn signals(config: &Config) -> impl Iterator<Item = &str> + Clone {
    config.channels.values().map(|c| c.signal.as_str()).chain(config.constants.keys().map(String::as_str))
}

fn known_signal(config: &Config, source: &Source, name: &str, user: &str) -> Result<()> {
    if signals(config).any(|s| s == name) {
        return Ok(());
    }
    let near = did_you_mean(name, signals(config));
    Err(source.error(name, format!("{user}: no channel gives the signal `{name}`{near}")))
}

fn model(config: &Config, source: &Source) -> Result<()> {
    let buildup = &config.buildup;
    let derivatives = buildup.derivatives.iter().map(|d| &d.name);
    let mut names: Vec<&String> = derivatives.chain(buildup.biases.iter().map(|b| &b.name)).collect();
    names.extend(buildup.combined.iter().map(|c| &c.name));
    names.sort();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(source.error(twice[0], format!("`{}` is defined twice", twice[0])));
    }
    for derivative in &buildup.derivatives {
        if let Some(surface) = derivative.regressor.surface() {
            known_signal(config, source, surface, &derivative.name)?;
        }
    }
    for combined in &buildup.combined {
        for part in [&combined.constant, &combined.slope] {
            if buildup.derivative(part).is_none() {
                let near = did_you_mean(part, buildup.derivatives.iter().map(|d| d.name.as_str()));
                return Err(source.error(part, format!("{}: unknown derivative `{part}`{near}", combined.name)));
            }
        }
    }
    Ok(())
}

fn statuses(config: &Config, class: &Class, source: &Source) -> Result<()> {
    let derivatives = config.buildup.derivatives_of(class.axis).map(|d| d.name.as_str());
    let biases: Vec<&str> = config.buildup.biases_of(class.axis).map(|b| b.name.as_str()).collect();
    let known: Vec<&str> = derivatives.chain(biases.iter().copied()).collect();
    let given = class.statuses.keys().chain(class.overrides.iter().flat_map(|o| o.statuses.keys()));
    for name in given {
        if !known.contains(&name.as_str()) {
            let near = did_you_mean(name, known.iter().copied());
            let what = format!("class {}: no {} derivative `{name}` in the model{near}", class.name, class.axis.name());
            return Err(source.error(name, what));
        }
    }
    for name in &known {
        if !class.statuses.contains_key(*name) {
            let what = format!("class {}: `{name}` is neither estimated, held nor inactive", class.name);
            return Err(source.error("class", what));
        }
    }
    let all = class.statuses.iter().chain(class.overrides.iter().flat_map(|o| &o.statuses));
    for (name, _) in all.filter(|(_, status)| **status == Status::Held) {
        if biases.contains(&name.as_str()) {
            return Err(source.error(name, format!("class {}: a bias is estimated or inactive, not held", class.name)));
        }
        if !config.tunnel.has(name) {
            let table = config.wind_tunnel.display();
            let what = format!("class {}: `{name}` is held, and {table} has no value to hold it at", class.name);
            return Err(source.error(name, what));
        }
    }
    Ok(())
}

fn weights(class: &Class, source: &Source) -> Result<()> {
    let outputs = class.axis.outputs();
    for output in outputs {
        if !class.weights.contains_key(&output) {
            let what = format!("class {}: `weights` lacks {}", class.name, word(output));
            return Err(source.error("weights", what));
        }
    }
    let all = class.weights.iter().chain(class.overrides.iter().flat_map(|o| &o.weights));
    for (output, weight) in all {
        if !outputs.contains(output) {
            let outputs = outputs.map(word).join(", ");
            let what = format!(
                "class {}: {} is no {} output; they are {outputs}",
                class.name,
                word(*output),
                class.axis.name()
            );
            return Err(source.error_under("weights", output.name(), what));
        }
        if !(weight.is_finite() && *weight > 0.0) {
            let what = format!("class {}: the weight of {} must be greater than zero", class.name, word(*output));
            return Err(source.error_under("weights", output.name(), what));
        }
    }
    Ok(())
}

fn word(output: Output) -> String {
    format!("`{}`", output.name())
}

fn recognition(config: &Config, class: &Class, source: &Source) -> Result<()> {
    let rule = &class.recognition;
    for name in rule.flags.keys().chain(rule.steps.keys()) {
        known_signal(config, source, name, &format!("class {}", class.name))?;
    }
    for (name, count) in &rule.steps {
        if count.at_least > count.at_most {
            return Err(source.error(name, format!("class {}: `{name}` steps at least more than at most", class.name)));
        }
        if !config.segment.steps.contains_key(name) {
            let what =
                format!("class {}: `segment: steps:` of pipeline.yaml says no size for steps of `{name}`", class.name);
            return Err(source.error(name, what));
        }
    }
    for (name, time_s) in [("lead_in_s", rule.lead_in_s), ("decay_s", rule.decay_s)] {
        if !(time_s.is_finite() && time_s >= 0.0) {
            return Err(
                source.error(name, format!("class {}: `{name}` must not be negative, not {time_s}", class.name))
            );
        }
    }
    Ok(())
}

fn calibration(config: &Config, source: &Source) -> Result<()> {
    for (name, left) in &config.estimate.calibration {
        known_signal(config, source, name, "calibration")?;
        let sizes = [("bias", left.bias), ("scale_pct", left.scale_pct)];
        if let Some((what, size)) = sizes.into_iter().find(|(_, size)| !(size.is_finite() && *size >= 0.0)) {
            let what = format!("calibration of `{name}`: `{what}` is a standard deviation, not {size}");
            return Err(source.error_under("calibration", name, what));
        }
    }
    Ok(())
}

fn stages(config: &Config, source: &Source) -> Result<()> {
    if config.estimate.joint.is_some() && config.estimate.hold == Hold::Evidence {
        let what = "`joint` needs `hold: table`: by evidence each maneuver chooses for itself what to hold, and \
                    maneuvers that share derivatives must hold the same";
        return Err(source.error_under("estimate", "joint", what));
    }
    calibration(config, source)?;
    let segment = std::iter::once(&config.segment.excitation_flag).chain(config.segment.steps.keys());
    for name in segment {
        known_signal(config, source, name, "segment")?;
    }
    let angles = config.estimate.joint.iter().map(|j| ("alpha_bin_deg", j.alpha_bin_deg));
    let distances = config.estimate.prediction.iter().map(|p| ("alpha_distance_deg", p.alpha_distance_deg));
    for (name, angle_deg) in angles.chain(distances) {
        if !(angle_deg.is_finite() && angle_deg > 0.0) {
            return Err(source.error(name, format!("`{name}` must be greater than zero, not {angle_deg}")));
        }
    }
    let names = config.derivative_names();
    let known = names.iter().map(String::as_str);
    let in_groups = config.trend.groups.iter().flat_map(|g| &g.derivatives);
    for name in in_groups.chain(&config.compare.not_comparable) {
        if !names.contains(name) {
            let near = did_you_mean(name, known.clone());
            return Err(source.error(name, format!("unknown derivative `{name}`{near}")));
        }
    }
    for name in config.trend.groups.iter().flat_map(|g| &g.classes) {
        if config.class(name).is_none() {
            let near = did_you_mean(name, config.classes.iter().map(|c| c.name.as_str()));
            return Err(source.error(name, format!("unknown class `{name}`{near}")));
        }
    }
    Ok(())
}
