//! The morning's question: what changed from one published night to another, and why.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::lineage::Changes;
use crate::store::{Night, Nights};

use super::changes;
use super::publish::Published;

/// Two nights and what is different.
#[derive(Clone, Debug, PartialEq)]
pub struct Diff {
    pub night: String,
    pub changes: Changes,
}

/// What changed in the night `to`, unless given the last complete one, since the night `since`,
/// unless given the one before it.
///
/// # Errors
/// There is no such night, or its tables cannot be read.
pub fn diff(config: &Config, since: Option<&str>, to: Option<&str>) -> Result<Diff> {
    let nights = Nights::look(&config.reports);
    let unknown = |what: String| Error::not_found(&config.reports, what);
    let named = |name: &str| -> Result<Night> {
        let night = nights
            .night(name)
            .or_else(|| nights.night(&format!("{name:0>4}")));
        let night = night.filter(Night::is_complete);
        night.ok_or_else(|| {
            unknown(format!(
                "there is no complete night `{name}` here; there are {}",
                nights.names().join(", ")
            ))
        })
    };
    let night = match to {
        Some(name) => named(name)?,
        None => nights.complete().ok_or_else(|| {
            unknown("no night has been published here yet; `harvest run` publishes one".to_owned())
        })?,
    };
    let before = match since.or(night.since.as_deref()) {
        Some(name) => named(name)?,
        None => {
            return Ok(Diff {
                night: night.name,
                changes: Changes::default(),
            });
        }
    };
    let (a, b) = (
        Published::read(&nights, &before)?,
        Published::read(&nights, &night)?,
    );
    Ok(Diff {
        changes: changes::between(&before.name, &a.tables(), &b.tables()),
        night: night.name,
    })
}

/// Whether the changes of a night have been told already; from now on they have.
///
/// # Errors
/// A disk that says no.
pub fn tell_once(config: &Config, night: &str) -> Result<bool> {
    Nights::look(&config.reports).tell_once(night)
}
