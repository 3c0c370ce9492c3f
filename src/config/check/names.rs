//! Checks of names that one file gives and another uses: signals and classes.

use crate::config::checked::Config;
use crate::config::source::Source;
use crate::error::{Result, did_you_mean};
use crate::flight::signal;

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
    let what = format!("{user}: no channel gives the signal `{name}`{near}");
    Err(source.error(name, what))
}

/// Refuses a class that the pipeline does not have.
pub(super) fn known_class(config: &Config, source: &Source, name: &str) -> Result<()> {
    if config.class(name).is_some() {
        return Ok(());
    }
    let near = did_you_mean(name, config.classes.iter().map(|c| c.name.as_str()));
    Err(source.error(name, format!("unknown class `{name}`{near}")))
}

/// Refuses a name that is not among those known; `kind` says what they are.
pub(super) fn known_name(source: &Source, name: &str, known: &[&str], kind: &str) -> Result<()> {
    if known.contains(&name) {
        return Ok(());
    }
    let near = did_you_mean(name, known.iter().copied());
    Err(source.error(name, format!("`{name}` is no {kind}{near}")))
}
