//! Checks of names that one file gives and another uses: signals and classes.

use std::collections::BTreeSet;

use crate::config::checked::Config;
use crate::config::source::Source;
use crate::config::tunnel_tables::MISSPELT;
use crate::error::{Error, Result, did_you_mean, similarity};
use crate::flight::signal;

/// Number of places of the configuration from which a name is no typing error: those are made once.
const DELIBERATE: usize = 2;

/// Names of all signals of the channel map and the constants.
fn signals(config: &Config) -> impl Iterator<Item = &str> + Clone {
    config
        .channels
        .values()
        .map(|c| c.signal.as_str())
        .chain(config.constants.keys().map(String::as_str))
}

/// `true` for a signal of a channel or a constant.
pub(super) fn is_given(config: &Config, name: &str) -> bool {
    signals(config).any(|given| given == name)
}

/// Refuses a signal that neither a channel nor a constant gives; `user` names what needs it.
pub(super) fn known_signal(config: &Config, source: &Source, name: &str, user: &str) -> Result<()> {
    if is_given(config, name) {
        return Ok(());
    }
    // A signal of harvest's own is not another one misspelt.
    let near = if signal::is_own(name) {
        String::new()
    } else {
        did_you_mean(name, signals(config))
    };
    Err(no_channel(source, name, user, &near))
}

/// Refuses a signal that is probably another one misspelt; `user` names what needs it. A recorder may
/// lack any other signal: `check` lists it with the cost.
pub(super) fn spelt_signal(config: &Config, source: &Source, name: &str, user: &str) -> Result<()> {
    match corrected_spelling(config, name) {
        Some(spelling) => {
            let near = format!("; did you mean `{spelling}`?");
            Err(no_channel(source, name, user, &near))
        }
        None => Ok(()),
    }
}

/// Refuses a signal that a list describes, that no channel gives and that nothing else uses.
pub(super) fn used_signal(config: &Config, source: &Source, name: &str, user: &str) -> Result<()> {
    let places = places(config);
    let uses = places.iter().filter(|place| place.contains(name)).count();
    if uses < DELIBERATE && !signal::is_own(name) {
        return known_signal(config, source, name, user);
    }
    spelt_signal(config, source, name, user)
}

fn no_channel(source: &Source, name: &str, user: &str, near: &str) -> Error {
    let what = format!("{user}: no channel gives the signal `{name}`{near}");
    source.error(name, what)
}

/// Signal whose name is the corrected spelling of `name`. A name counts as a typing error in two
/// cases. It occurs in one place of the configuration and resembles a correct name, or it occurs in
/// the channel map and nothing else uses the signal.
fn corrected_spelling<'a>(config: &'a Config, name: &str) -> Option<&'a str> {
    if is_given(config, name) || signal::is_own(name) {
        return None;
    }
    let places = places(config);
    let uses = |name: &str| places.iter().filter(|place| place.contains(name)).count();
    let is_single = uses(name) < DELIBERATE;
    let is_misspelt_in_map = |given: &str| uses(given) == 0 && !signal::is_own(given);
    let given = signals(config).filter(|given| is_single || is_misspelt_in_map(given));
    let used = places.iter().flatten().copied();
    let used = used.filter(|used| is_single && uses(used) >= DELIBERATE);
    let near = given.chain(used).filter(|other| *other != name);
    let near = near.map(|other| (similarity(name, other), other));
    let near = near.filter(|(score, _)| *score >= MISSPELT);
    near.max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, near)| near)
}

/// Names of signals that each place of the configuration uses: the model, the lists of segment, each
/// class.
fn places(config: &Config) -> Vec<BTreeSet<&str>> {
    let settings = &config.segment;
    let derivatives = config.aero_model.derivatives.iter();
    let of_classes = config.classes.iter().map(|class| {
        let names = class.recognition.signals();
        names.collect()
    });
    let mut places: Vec<BTreeSet<&str>> = of_classes.collect();
    places.extend([
        derivatives.flat_map(|d| d.regressor.signals()).collect(),
        [settings.excitation_flag.as_str()].into(),
        settings.pilot_controls.iter().map(String::as_str).collect(),
        settings.steps.keys().map(String::as_str).collect(),
        settings
            .quality
            .actuators
            .keys()
            .map(String::as_str)
            .collect(),
    ]);
    places
}

/// Refuses a class that the pipeline does not have.
pub(super) fn known_class(config: &Config, source: &Source, name: &str) -> Result<()> {
    if config.class(name).is_some() {
        return Ok(());
    }
    let near = did_you_mean(name, config.classes.iter().map(|c| c.name.as_str()));
    Err(source.error(name, format!("unknown class `{name}`{near}")))
}

/// Refuses a name that is not among those known; `kind` names what they are.
pub(super) fn known_name(source: &Source, name: &str, known: &[&str], kind: &str) -> Result<()> {
    if known.contains(&name) {
        return Ok(());
    }
    let near = did_you_mean(name, known.iter().copied());
    Err(source.error(name, format!("`{name}` is no {kind}{near}")))
}
