//! Instruments whose errors step or drift over the flights.

use std::collections::BTreeSet;

use crate::lineage::InstrumentChange;
use crate::tables::{InstrumentError, InstrumentTrend, InstrumentTrendRow};

/// Errors that step or drift now, but did not in the earlier night. A step that is found a flight
/// earlier or later than before is not reported again.
pub fn instruments(
    before: &[InstrumentTrendRow],
    now: &[InstrumentTrendRow],
) -> Vec<InstrumentChange> {
    let known: BTreeSet<_> = before.iter().filter_map(kind_of_change).collect();
    let is_new =
        |row: &&InstrumentTrendRow| kind_of_change(row).is_some_and(|at| !known.contains(&at));
    now.iter().filter(is_new).filter_map(change).collect()
}

/// Error and the kind of its change; `None` for a steady error, and for a change that is only possible.
fn kind_of_change(row: &InstrumentTrendRow) -> Option<(&str, InstrumentError, InstrumentTrend)> {
    let changes = matches!(row.verdict, InstrumentTrend::Step | InstrumentTrend::Drift);
    changes.then_some((row.channel.as_str(), row.error, row.verdict))
}

fn change(row: &InstrumentTrendRow) -> Option<InstrumentChange> {
    Some(InstrumentChange {
        channel: row.channel.clone(),
        error: row.error,
        what: row.verdict,
        since: row.since.clone()?,
        change: row.change?,
        bound: row.change_bound?,
        unit: row.unit.clone(),
    })
}
