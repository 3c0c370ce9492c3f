//! Checks of the stages' settings in `pipeline.yaml` against each other and against the other files.

use super::names::{known_class, spelt_signal, used_signal};
use super::numbers;
use crate::config::checked::Config;
use crate::config::source::Source;
use crate::error::{Result, did_you_mean};
use crate::estimate::Hold;
use crate::segment;

/// Checks the settings of all stages.
pub(super) fn stages(config: &Config, source: &Source) -> Result<()> {
    estimate(config, source)?;
    segment(config, source)?;
    groups(config, source)?;
    trends(config, source)?;
    third_variable(config, source)?;
    export(config, source)?;
    names(config, source)
}

/// Checks signals and limits of segment.
fn segment(config: &Config, source: &Source) -> Result<()> {
    let settings = &config.segment;
    let described = settings.steps.keys();
    for name in described.chain(settings.quality.actuators.keys()) {
        used_signal(config, source, name, "segment")?;
    }
    let flag = std::iter::once(&settings.excitation_flag).filter(|flag| !flag.is_empty());
    for name in flag.chain(&settings.pilot_controls) {
        spelt_signal(config, source, name, "segment")?;
    }
    let mut controls = settings.pilot_controls.iter();
    if let Some(name) = controls.find(|name| !settings.steps.contains_key(*name)) {
        let what =
            format!("segment: `steps` gives no size for steps of the pilot control `{name}`");
        return Err(source.error_under("pilot_controls", name, what));
    }
    quality_limits(&settings.quality, source)
}

/// Checks the limits by which a maneuver's quality is judged.
fn quality_limits(q: &segment::QualityLimits, source: &Source) -> Result<()> {
    for (name, actuator) in &q.actuators {
        if !(actuator.lower_deg < actuator.upper_deg && actuator.rate_deg_s > 0.0) {
            let what = format!(
                "the actuator of `{name}` needs lower_deg < upper_deg and a rate greater than zero"
            );
            return Err(source.error_under("actuators", name, what));
        }
    }
    let limits = [
        ("lead_in_motion", q.lead_in_motion),
        ("alpha_rms_deg", q.alpha_rms_deg),
        ("other_axis", q.other_axis),
        ("signal_to_noise", q.signal_to_noise),
        ("saturated_share", q.saturated_share),
        ("rate_limited_share", q.rate_limited_share),
        ("marked_share", q.marked_share),
    ];
    let mut limits = limits.into_iter();
    limits.try_for_each(|(name, limit)| numbers::not_negative(source, "quality", name, limit))
}

/// Checks that the settings of estimate fit each other.
fn estimate(config: &Config, source: &Source) -> Result<()> {
    let settings = &config.estimate;
    if settings.joint.is_some() && settings.hold == Hold::Evidence {
        let what = "`joint` needs `hold: table`: by evidence each maneuver chooses for itself what to hold, and \
                    maneuvers that share derivatives must hold the same";
        return Err(source.error_under("estimate", "joint", what));
    }
    if config.aero_model.along_alpha_rate().next().is_some() && settings.hold == Hold::Evidence {
        let what = "`hold: evidence` frees derivatives along `alpha_dot`, which must stay held: `hold: table` holds them";
        return Err(source.error_under("estimate", "hold", what));
    }
    Ok(())
}

/// Checks the widths within which maneuvers of one class count as flown at one angle of attack.
fn groups(config: &Config, source: &Source) -> Result<()> {
    if let Some(joint) = &config.estimate.joint {
        numbers::positive(source, "joint", "alpha_bin_deg", joint.alpha_bin_deg)?;
    }
    if let Some(prediction) = &config.estimate.prediction {
        let distance_deg = prediction.alpha_distance_deg;
        numbers::positive(source, "prediction", "alpha_distance_deg", distance_deg)?;
    }
    Ok(())
}

/// Checks that derivatives and classes that trends and comparison name exist.
fn names(config: &Config, source: &Source) -> Result<()> {
    let groups = &config.trend.groups;
    let derivatives = config.derivative_names();
    let in_groups = groups.iter().flat_map(|g| &g.derivatives);
    for name in in_groups.chain(&config.compare.not_comparable) {
        if !derivatives.contains(name) {
            let near = did_you_mean(name, derivatives.iter().map(String::as_str));
            return Err(source.error(name, format!("unknown derivative `{name}`{near}")));
        }
    }
    for name in groups.iter().flat_map(|g| &g.classes) {
        known_class(config, source, name)?;
    }
    Ok(())
}

/// Checks that the knots of trends are finite, and that outlier limit, published step and agreement
/// limit are positive.
fn trends(config: &Config, source: &Source) -> Result<()> {
    let (trend, compare) = (&config.trend, &config.compare);
    let of_groups = trend.groups.iter();
    let of_groups = of_groups.flat_map(|g| g.knots_deg.iter().flatten());
    let mut knots = trend.knots_deg.iter().chain(of_groups);
    if let Some(knot) = knots.find(|k| !k.is_finite()) {
        let what = format!("a knot is an angle of attack in deg, not {knot}");
        return Err(source.error_under("trend", "knots_deg", what));
    }
    numbers::positive(source, "trend", "outlier_z", trend.outlier_z)?;
    numbers::positive(source, "trend", "alpha_step_deg", trend.alpha_step_deg)?;
    numbers::positive(source, "compare", "agreement_z", compare.agreement_z)
}

/// Checks the value of the tunnel's third variable.
fn third_variable(config: &Config, source: &Source) -> Result<()> {
    match &config.tunnel.settings().third {
        Some(third) if !third.at.is_finite() => {
            let what = format!("`at` must be a number, not {}", third.at);
            Err(source.error_under("tunnel", "at", what))
        }
        _ => Ok(()),
    }
}

/// Checks that a derivative is of each signal that export gives a property.
fn export(config: &Config, source: &Source) -> Result<()> {
    let derivatives = &config.aero_model.derivatives;
    let used = || derivatives.iter().flat_map(|d| d.regressor.signals());
    let mut given = config.export.jsbsim_properties.keys();
    let unused = given.find(|signal| !used().any(|s| s == signal.as_str()));
    unused.map_or(Ok(()), |signal| {
        let near = did_you_mean(signal, used());
        let what = format!("export: no derivative is of the signal `{signal}`{near}");
        Err(source.error(signal, what))
    })
}
