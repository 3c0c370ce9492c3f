//! Configuration with which ingest reads a flight.

use std::collections::BTreeMap;

use super::refusal::Refusal;
use super::settings::Settings;
use crate::aircraft::Aircraft;
use crate::flight::absence::irreplaceable;
use crate::flight::stand_in::stand_ins;
use crate::flight::{Channel, StandIn, signal};

/// Channel map, constants, aircraft and settings of ingest.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Channels by the name of their column.
    pub channels: &'a BTreeMap<String, Channel>,
    /// Values of signals that the aircraft does not record, in their units.
    pub constants: &'a BTreeMap<String, f64>,
    pub aircraft: &'a Aircraft,
    pub settings: &'a Settings,
}

impl Context<'_> {
    /// Refusal at the channel or constant of a signal.
    pub(super) fn refusal(&self, signal: &str, reason: String) -> Refusal {
        let of_signal = |(_, channel): &(&String, &Channel)| channel.signal == signal;
        match self.channels.iter().find(of_signal) {
            Some((name, _)) => Refusal::of_channel(name, reason),
            None => Refusal {
                place: format!("constant `{signal}`"),
                reason,
            },
        }
    }

    /// `true` for a signal that a flight can do without at little cost. `recorded` is `true` for the
    /// signals that its channels give.
    pub(super) fn can_do_without(&self, signal: &str, recorded: impl Fn(&str) -> bool) -> bool {
        let has = |name: &str| recorded(name) || self.constants.contains_key(name);
        let is_read = signal::REQUIRED.contains(&signal);
        !signal::is_indispensable(signal) && (!is_read || StandIn::of(signal, has).is_some())
    }

    /// Stand-ins of the required signals that neither `recorded` nor a constant gives.
    ///
    /// # Errors
    /// All signals that can have no stand-in.
    pub(super) fn stand_ins(
        &self,
        recorded: impl Fn(&str) -> bool,
    ) -> Result<Vec<(String, StandIn)>, Vec<&'static str>> {
        let has = |signal: &str| recorded(signal) || self.constants.contains_key(signal);
        stand_ins(has).map_err(|_| irreplaceable(has))
    }
}
