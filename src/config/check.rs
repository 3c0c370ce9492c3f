//! Checks of a configuration beyond its types: names resolve, units fit, nothing is missing.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::checked::Config;
use super::instruments::Instrument;
use super::source::{Files, Source};
use crate::aero::{Axis, Buildup, DerivativeUnit, Output, Regressor, WindTunnel, wind_tunnel};
use crate::aircraft::ThrustLine;
use crate::error::{Error, Result, did_you_mean, similarity};
use crate::estimate::Hold;
use crate::flight::{StandIn, signal};
use crate::ingest;
use crate::maneuver::{Class, Event, Status};
use crate::output_error::MOST_PRODUCTS;
use crate::store;
use crate::store::files::{self, TunnelRow};
use crate::units::Unit;

/// Reads the tunnel's tables, in the units of the model's derivatives.
pub(super) fn tunnel(
    path: &Path,
    buildup: &Buildup,
    settings: &wind_tunnel::Settings,
) -> Result<WindTunnel> {
    let mut tunnel = WindTunnel::new(settings.clone());
    let mut read = TunnelRows::default();
    for (line, mut row) in tunnel_rows(path, buildup, settings)? {
        let error = |what: String| Err(Error::config(path, Some(line), what));
        let numbers = [
            Some(row.alpha_deg),
            Some(row.value),
            row.mach,
            row.uncertainty,
            row.third,
        ];
        if numbers.iter().flatten().any(|v| !v.is_finite()) {
            return error(format!(
                "`{}` has a value that is no number",
                row.derivative
            ));
        }
        if row.alpha_deg.abs() > 180.0 {
            return error(format!(
                "`{}` has the angle of attack {} deg; it lies between -180 and 180",
                row.derivative, row.alpha_deg
            ));
        }
        if let Some(uncertainty) = row.uncertainty.filter(|u| *u < 0.0) {
            return error(format!(
                "`{}` has the uncertainty {uncertainty}; none is negative",
                row.derivative
            ));
        }
        if let Some(derivative) = buildup
            .derivatives
            .iter()
            .find(|d| wind_tunnel::key(&d.name) == wind_tunnel::key(&row.derivative))
        {
            let unit = derivative.unit();
            let Some(factor) = unit.factor_from(&row.unit) else {
                let of_vane = [DerivativeUnit::LbfPerDeg, DerivativeUnit::FtLbfPerDeg];
                let is_of_vane = of_vane.iter().any(|u| u.factor_from(&row.unit).is_some());
                let hint = if unit == DerivativeUnit::PerDeg && is_of_vane {
                    "; a thrust-vectoring vane has `vane: true` in model.yaml"
                } else {
                    ""
                };
                let (name, written, unit) = (&row.derivative, &row.unit, unit.name());
                return error(format!(
                    "`{name}` is in `{written}`, which cannot become the model's `{unit}`{hint}"
                ));
            };
            row.value *= factor;
            row.uncertainty = row.uncertainty.map(|u| u * factor);
        }
        read.add(line, &row)
            .map_err(|what| Error::config(path, Some(line), what))?;
        tunnel.insert_at(&row.derivative, row.third, row.point());
    }
    misspelt(&read, buildup).map_or(Ok(()), |(line, what)| {
        Err(Error::config(path, Some(line), what))
    })?;
    if let Some(third) = settings.third.as_ref().filter(|_| !read.third) {
        let what = format!(
            "no table depends on `{}`, which pipeline.yaml names (tunnel: third:)",
            third.name
        );
        return Err(Error::config(path, None, what));
    }
    Ok(tunnel)
}

/// Similarity, from 0 to 1, from which a name of the tunnel counts as a misspelt one of the model: a
/// letter too many or two exchanged, in names of five letters.
const MISSPELT: f64 = 0.93;

/// Line and message for a name of the tunnel that the model lacks, while the tunnel lacks a very similar
/// one of the model.
fn misspelt(read: &TunnelRows, buildup: &Buildup) -> Option<(usize, String)> {
    let derivatives = buildup.derivatives.iter().map(|d| &d.name);
    let names = derivatives.chain(buildup.combined.iter().map(|c| &c.name));
    let (found, lacking): (Vec<&String>, Vec<&String>) =
        names.partition(|name| read.lines.contains_key(&wind_tunnel::key(name)));
    let found: BTreeSet<String> = found
        .into_iter()
        .map(|name| wind_tunnel::key(name))
        .collect();
    let unknown = read.lines.iter().filter(|(name, _)| !found.contains(*name));
    unknown
        .filter_map(|(_, (line, written))| {
            let near = lacking
                .iter()
                .find(|name| similarity(written, name) >= MISSPELT)?;
            let what = format!(
                "the model has no derivative `{written}`; did you mean `{near}`, which has no rows?"
            );
            Some((*line, what))
        })
        .min()
}

/// Rows of the tunnel's tables as written; of a DAVE-ML file those of the model's derivatives and
/// sums.
pub(crate) fn tunnel_rows(
    path: &Path,
    buildup: &Buildup,
    settings: &wind_tunnel::Settings,
) -> Result<Vec<(usize, TunnelRow)>> {
    let derivatives = buildup.derivatives.iter().map(|d| &d.name);
    let names: Vec<String> = derivatives
        .chain(buildup.combined.iter().map(|c| &c.name))
        .map(|name| wind_tunnel::key(name))
        .collect();
    let third = settings.third.as_ref().map(|third| third.name.as_str());
    store::tunnel::rows(path, third, |variable| {
        names.contains(&wind_tunnel::key(variable))
    })
}

/// Rows of the tunnel read so far. Each point stands once, and all rows of a derivative have the same
/// variables.
#[derive(Default)]
struct TunnelRows {
    points: BTreeSet<(String, [Option<u64>; 3])>,
    variables: BTreeMap<String, (bool, bool)>,
    third: bool,
    /// First line of each derivative, and its name as written there.
    lines: BTreeMap<String, (usize, String)>,
}

impl TunnelRows {
    fn add(&mut self, line: usize, row: &TunnelRow) -> std::result::Result<(), String> {
        let name = wind_tunnel::key(&row.derivative);
        let written = || (line, row.derivative.clone());
        self.lines.entry(name.clone()).or_insert_with(written);
        let given = (row.mach.is_some(), row.third.is_some());
        self.third |= given.1;
        if *self.variables.entry(name.clone()).or_insert(given) != given {
            let what = "has Mach number or third variable in some rows and not in others: give it in all or in none";
            return Err(format!("`{}` {what}", row.derivative));
        }
        // Adding zero makes one of the two zeros.
        let bits = |v: f64| (v + 0.0).to_bits();
        let point = [
            Some(bits(row.alpha_deg)),
            row.mach.map(bits),
            row.third.map(bits),
        ];
        if self.points.insert((name, point)) {
            return Ok(());
        }
        let mach = row.mach.map_or_else(String::new, |m| format!(", Mach {m}"));
        Err(format!(
            "`{}` has a second value at alpha {} deg{mach}; a table over a third variable needs its name in \
             pipeline.yaml (tunnel: third:)",
            row.derivative, row.alpha_deg
        ))
    }
}

/// Reads the analyst's events.
pub(super) fn events(path: Option<&Path>, classes: &[Class]) -> Result<Vec<Event>> {
    let Some(path) = path else {
        return Ok(Vec::new());
    };
    let mut events = Vec::new();
    for (line, event) in files::events(path)? {
        let known = classes.iter().map(|c| c.name.as_str());
        if !known.clone().any(|name| name == event.class) {
            let what = format!(
                "unknown class `{}`{}",
                event.class,
                did_you_mean(&event.class, known)
            );
            return Err(Error::config(path, Some(line), what));
        }
        for (name, time_s) in [("start_s", event.start_s), ("end_s", event.end_s)] {
            if !time_s.is_finite() {
                let what = format!("column `{name}`: {time_s} is no time");
                return Err(Error::config(path, Some(line), what));
            }
        }
        if event.end_s.partial_cmp(&event.start_s) != Some(std::cmp::Ordering::Greater) {
            return Err(Error::config(
                path,
                Some(line),
                "the event ends before it starts",
            ));
        }
        events.push(event);
    }
    Ok(events)
}

/// Checks all files against each other.
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
            return Err(source.error_under(
                key,
                name,
                format!("`{name}` must be greater than zero, not {value}"),
            ));
        }
    }
    if !(-90.0..=90.0).contains(&a.latitude_deg) {
        return Err(source.error("latitude_deg", "`latitude_deg` must lie between -90 and 90"));
    }
    a.thrust_line
        .map_or(Ok(()), |line| thrust_line(line, source))
}

fn thrust_line(line: ThrustLine, source: &Source) -> Result<()> {
    let inclination = line.inclination_deg;
    if !(-45.0..=45.0).contains(&inclination) {
        let what = format!("`inclination_deg` must lie between -45 and 45, not {inclination}");
        return Err(source.error_under("thrust_line", "inclination_deg", what));
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
        if unit.conversion_to(target).is_none() {
            let (unit, target, signal) = (unit.name, target.name, &channel.signal);
            return error(format!(
                "channel `{column}`: `{unit}` cannot become {target} of `{signal}`"
            ));
        }
        if ![1.0, -1.0].contains(&channel.sign) {
            return error(format!(
                "channel `{column}`: sign is 1 or -1, not {}",
                channel.sign
            ));
        }
        if !(channel.scale.is_finite() && channel.scale > 0.0) {
            return error(format!(
                "channel `{column}`: scale must be greater than zero; a sign is `sign`"
            ));
        }
        if signals.contains(&channel.signal.as_str()) {
            return error(format!("signal `{}` has two sources", channel.signal));
        }
        signals.push(&channel.signal);
    }
    for name in signal::POSITIVE {
        if let Some(value) = config.constants.get(*name).filter(|v| **v <= 0.0) {
            let what = format!("`{name}` must be greater than zero, not {value}");
            return Err(source.error_under("constants", name, what));
        }
    }
    for required in std::iter::once(&"time_s").chain(signal::REQUIRED) {
        let has = |name: &str| signals.contains(&name);
        let is_needed = StandIn::of(required, has).is_none() || is_misspelt(required, &signals);
        if !has(required) && is_needed {
            let near = did_you_mean(required, signals.iter().copied());
            return Err(source.error(
                "channels",
                format!("no channel or constant gives the signal `{required}`{near}"),
            ));
        }
    }
    Ok(())
}

/// `true` where a signal of the channel map is probably this required one, misspelt.
fn is_misspelt(required: &str, signals: &[&str]) -> bool {
    let mut others = signals
        .iter()
        .filter(|name| !signal::REQUIRED.contains(name));
    others.any(|name| similarity(name, required) >= MISSPELT)
}

/// Names of all signals of the channel map and the constants.
fn signals(config: &Config) -> impl Iterator<Item = &str> + Clone {
    config
        .channels
        .values()
        .map(|c| c.signal.as_str())
        .chain(config.constants.keys().map(String::as_str))
}

fn known_signal(config: &Config, source: &Source, name: &str, user: &str) -> Result<()> {
    if signals(config).any(|s| s == name) {
        return Ok(());
    }
    let near = did_you_mean(name, signals(config));
    Err(source.error(
        name,
        format!("{user}: no channel gives the signal `{name}`{near}"),
    ))
}

fn model(config: &Config, source: &Source) -> Result<()> {
    let buildup = &config.buildup;
    let derivatives = buildup.derivatives.iter().map(|d| &d.name);
    let mut names: Vec<&String> = derivatives
        .chain(buildup.biases.iter().map(|b| &b.name))
        .collect();
    names.extend(buildup.combined.iter().map(|c| &c.name));
    names.sort();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(source.error(twice[0], format!("`{}` is defined twice", twice[0])));
    }
    for derivative in &buildup.derivatives {
        for signal in derivative.regressor.signals() {
            known_signal(config, source, signal, &derivative.name)?;
        }
    }
    few_products(config, source)?;
    for combined in &buildup.combined {
        for part in [&combined.constant, &combined.slope] {
            if buildup.derivative(part).is_none() {
                let near = did_you_mean(part, buildup.derivatives.iter().map(|d| d.name.as_str()));
                return Err(source.error(
                    part,
                    format!("{}: unknown derivative `{part}`{near}", combined.name),
                ));
            }
        }
    }
    Ok(())
}

/// Checks that the kernel has room for the products in which states are.
fn few_products(config: &Config, source: &Source) -> Result<()> {
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let mut products: Vec<&Regressor> = Vec::new();
        for derivative in config.buildup.derivatives_of(axis) {
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

fn statuses(config: &Config, class: &Class, source: &Source) -> Result<()> {
    let derivatives = config
        .buildup
        .derivatives_of(class.axis)
        .map(|d| d.name.as_str());
    let biases: Vec<&str> = config
        .buildup
        .biases_of(class.axis)
        .map(|b| b.name.as_str())
        .collect();
    let known: Vec<&str> = derivatives.chain(biases.iter().copied()).collect();
    let given = class
        .statuses
        .keys()
        .chain(class.overrides.iter().flat_map(|o| o.statuses.keys()));
    for name in given {
        if !known.contains(&name.as_str()) {
            let near = did_you_mean(name, known.iter().copied());
            let what = format!(
                "class {}: no {} derivative `{name}` in the model{near}",
                class.name,
                class.axis.name()
            );
            return Err(source.error(name, what));
        }
    }
    for name in &known {
        if !class.statuses.contains_key(*name) {
            let what = format!(
                "class {}: `{name}` is neither estimated, held nor inactive",
                class.name
            );
            return Err(source.error("class", what));
        }
    }
    let all = class
        .statuses
        .iter()
        .chain(class.overrides.iter().flat_map(|o| &o.statuses));
    for (name, _) in all
        .clone()
        .filter(|(_, status)| **status == Status::Estimated)
    {
        let derivative = config.buildup.derivative(name);
        if derivative.is_some_and(|d| d.regressor.has_alpha_rate()) {
            let what = format!(
                "class {}: `{name}` is estimated; a derivative along `alpha_dot` is held or inactive, since its rate is the measured one, and \
                 noise alone tells it from the damping in pitch (docs/method.md, terms of the model)",
                class.name
            );
            return Err(source.error(name, what));
        }
    }
    for (name, _) in all.filter(|(_, status)| **status == Status::Held) {
        if biases.contains(&name.as_str()) {
            return Err(source.error(
                name,
                format!(
                    "class {}: a bias is estimated or inactive, not held",
                    class.name
                ),
            ));
        }
        if !config.tunnel.has(name) {
            let table = config.tunnel_name();
            let what = format!(
                "class {}: `{name}` is held, and {table} has no value to hold it at",
                class.name
            );
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
    let all = class
        .weights
        .iter()
        .chain(class.overrides.iter().flat_map(|o| &o.weights));
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
            let what = format!(
                "class {}: the weight of {} must be greater than zero",
                class.name,
                word(*output)
            );
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
    let error = |name: &str, what: String| Err(source.error_under("recognise", name, what));
    for name in rule.flags.keys().chain(rule.counted()) {
        known_signal(config, source, name, &format!("class {}", class.name))?;
    }
    for (name, count) in &rule.steps {
        if count.at_least > count.at_most {
            return error(
                name,
                format!(
                    "class {}: `{name}` steps at least more than at most",
                    class.name
                ),
            );
        }
    }
    for name in rule.counted() {
        if !config.segment.steps.contains_key(name) {
            let what = format!(
                "class {}: `segment: steps:` of pipeline.yaml says no size for steps of `{name}`",
                class.name
            );
            return error(name, what);
        }
    }
    if rule.inputs().is_empty() {
        let what = format!(
            "class {}: nothing makes this maneuver; `steps` with `at_least`, `pulses` or `sweep` name its inputs",
            class.name
        );
        return error("recognise", what);
    }
    patterns(class, source)?;
    for (name, time_s) in [("lead_in_s", rule.lead_in_s), ("decay_s", rule.decay_s)] {
        if !(time_s.is_finite() && time_s >= 0.0) {
            return error(
                name,
                format!(
                    "class {}: `{name}` must not be negative, not {time_s}",
                    class.name
                ),
            );
        }
    }
    Ok(())
}

/// Pulses and sweeps of a class.
fn patterns(class: &Class, source: &Source) -> Result<()> {
    let error = |name: &str, what: &str| {
        Err(source.error_under("recognise", name, format!("class {}: {what}", class.name)))
    };
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

/// Signals and limits of segment.
fn segment(config: &Config, source: &Source) -> Result<()> {
    let settings = &config.segment;
    let named = settings
        .steps
        .keys()
        .chain(&settings.pilot_controls)
        .chain(settings.quality.actuators.keys());
    let flag = std::iter::once(&settings.excitation_flag).filter(|flag| !flag.is_empty());
    for name in flag.chain(named) {
        known_signal(config, source, name, "segment")?;
    }
    if let Some(name) = settings
        .pilot_controls
        .iter()
        .find(|name| !settings.steps.contains_key(*name))
    {
        let what = format!("segment: `steps` says no size for steps of the pilot control `{name}`");
        return Err(source.error_under("pilot_controls", name, what));
    }
    for (name, actuator) in &settings.quality.actuators {
        if !(actuator.lower_deg < actuator.upper_deg && actuator.rate_deg_s > 0.0) {
            let what = format!(
                "the actuator of `{name}` needs lower_deg < upper_deg and a rate greater than zero"
            );
            return Err(source.error_under("actuators", name, what));
        }
    }
    let q = &settings.quality;
    let limits = [
        ("lead_in_motion", q.lead_in_motion),
        ("alpha_rms_deg", q.alpha_rms_deg),
        ("other_axis", q.other_axis),
        ("signal_to_noise", q.signal_to_noise),
        ("saturated_share", q.saturated_share),
        ("rate_limited_share", q.rate_limited_share),
        ("marked_share", q.marked_share),
    ];
    for (name, limit) in limits {
        if limit.is_nan() || limit < 0.0 {
            return Err(source.error_under(
                "quality",
                name,
                format!("`{name}` must not be negative, not {limit}"),
            ));
        }
    }
    Ok(())
}

/// Sizes of instrument errors: known signals, no negative sizes.
pub(super) fn instruments(
    errors: &BTreeMap<String, Instrument>,
    config: &Config,
    source: &Source,
) -> Result<()> {
    let mut examined = ingest::Settings::default().compatibility.ordinary;
    for (name, instrument) in errors {
        let error = |what: String| Err(source.error_under("instruments", name, what));
        known_signal(config, source, name, "instruments")?;
        let uncertainty = instrument.uncertainty;
        let (ordinary, fault) = (instrument.ordinary.given(), instrument.fault.given());
        let sizes = [uncertainty.bias, uncertainty.scale_pct].map(Some);
        let sizes = sizes.iter().chain(&ordinary).chain(&fault).flatten();
        if let Some(size) = sizes
            .copied()
            .find(|size| !(size.is_finite() && *size >= 0.0))
        {
            return error(format!(
                "`{name}`: sizes of errors are not negative, not {size}"
            ));
        }
        let has_sizes = ordinary.iter().chain(&fault).any(Option::is_some);
        if has_sizes && examined.of_signal(name).is_none() {
            return error(format!(
                "`{name}`: no kinematic equation has this signal, so `ordinary` and `fault` have no effect"
            ));
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
    if config.buildup.lags().next().is_some() && config.estimate.hold == Hold::Evidence {
        let what = "`hold: evidence` frees derivatives along `alpha_dot`, which must stay held: `hold: table` holds them";
        return Err(source.error_under("estimate", "hold", what));
    }
    segment(config, source)?;
    let angles = config
        .estimate
        .joint
        .iter()
        .map(|j| ("alpha_bin_deg", j.alpha_bin_deg));
    let distances = config
        .estimate
        .prediction
        .iter()
        .map(|p| ("alpha_distance_deg", p.alpha_distance_deg));
    for (name, angle_deg) in angles.chain(distances) {
        if !(angle_deg.is_finite() && angle_deg > 0.0) {
            return Err(source.error(
                name,
                format!("`{name}` must be greater than zero, not {angle_deg}"),
            ));
        }
    }
    trends_and_tunnel(config, source)?;
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

/// Numbers of trends, comparison and tunnel.
fn trends_and_tunnel(config: &Config, source: &Source) -> Result<()> {
    let (trend, compare) = (&config.trend, &config.compare);
    let knots = trend.knots_deg.iter().chain(
        trend
            .groups
            .iter()
            .flat_map(|g| g.knots_deg.iter().flatten()),
    );
    if let Some(knot) = knots.copied().find(|k| !k.is_finite()) {
        return Err(source.error_under(
            "trend",
            "knots_deg",
            format!("a knot is an angle of attack in deg, not {knot}"),
        ));
    }
    let positive = [
        ("trend", "outlier_z", trend.outlier_z),
        ("trend", "alpha_step_deg", trend.alpha_step_deg),
        ("compare", "agreement_z", compare.agreement_z),
    ];
    for (key, name, value) in positive {
        if !(value.is_finite() && value > 0.0) {
            return Err(source.error_under(
                key,
                name,
                format!("`{name}` must be greater than zero, not {value}"),
            ));
        }
    }
    if let Some(third) = config
        .tunnel
        .settings()
        .third
        .as_ref()
        .filter(|third| !third.at.is_finite())
    {
        return Err(source.error_under(
            "tunnel",
            "at",
            format!("`at` must be a number, not {}", third.at),
        ));
    }
    let mut given = config.export.jsbsim_properties.keys();
    let used = || {
        config
            .buildup
            .derivatives
            .iter()
            .flat_map(|d| d.regressor.signals())
    };
    if let Some(signal) = given.find(|signal| !used().any(|s| s == signal.as_str())) {
        let near = did_you_mean(signal, used());
        return Err(source.error(
            signal,
            format!("export: no derivative is of the signal `{signal}`{near}"),
        ));
    }
    Ok(())
}
