//! Changes from one published night to another, with their causes.

use super::published_night::PublishedNight;
use super::{NONE_PUBLISHED, changes, damaged};
use crate::config::Config;
use crate::error::{Error, Result};
use crate::lineage::Changes;
use crate::store::{Night, Nights};

/// Changes of a night.
#[derive(Clone, Debug, PartialEq)]
pub struct Diff {
    pub night: String,
    pub changes: Changes,
}

/// Compares the night `to`, by default the last complete one, with the night `since`, by default
/// its predecessor.
///
/// # Errors
/// There is no such night, or its tables cannot be read.
pub fn diff(config: &Config, since: Option<&str>, to: Option<&str>) -> Result<Diff> {
    let nights = Nights::read_only(&config.reports);
    let night = match to {
        Some(name) => complete_night(config, &nights, name)?,
        None => last_night(config, &nights)?,
    };
    let now = PublishedNight::read(&nights, &night)?;
    let now = now.tables();
    let changes = match since.or(night.since.as_deref()) {
        Some(name) => changes::since(&nights, &complete_night(config, &nights, name)?, &now),
        None => changes::of_first_night(now.instrument_trends),
    };
    Ok(Diff {
        night: night.name,
        changes,
    })
}

/// Finds the last complete night; the current night must be whole.
fn last_night(config: &Config, nights: &Nights) -> Result<Night> {
    let none = |what: &str| Error::not_found(&config.reports, what);
    match nights.damaged_current() {
        Some(name) => Err(none(&damaged(&name))),
        None => nights.complete().ok_or_else(|| none(NONE_PUBLISHED)),
    }
}

/// Finds a complete night by its name, with or without leading zeros.
fn complete_night(config: &Config, nights: &Nights, name: &str) -> Result<Night> {
    let night = nights.named(name).filter(Night::is_complete);
    night.ok_or_else(|| {
        let what = match nights.full_name(name) {
            Some(own) if nights.night(&own).is_none() => damaged(&own),
            _ => format!(
                "there is no complete night `{name}` here; there are {}",
                nights.names().join(", ")
            ),
        };
        Error::not_found(&config.reports, what)
    })
}

/// Marks the changes of a night as reported, and returns `true` if they already were.
///
/// # Errors
/// A disk that fails.
pub fn mark_reported(config: &Config, night: &str) -> Result<bool> {
    Nights::read_only(&config.reports).mark_reported(night)
}
