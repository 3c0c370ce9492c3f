//! Columns of the archive's files compared with the channel map, before any data are read. The
//! result is the signals that a run would lack, and the flights that it would refuse.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::config::Config;
use crate::error::Problem;
use crate::flight::{Channel, RawFlight, signal};
use crate::ingest::{ColumnSource, ComputedColumns, Context, check_clocks, plan_channels};
use crate::store::archive::{self, FlightFiles};

/// Largest number of flights whose files are opened: their footers take a second on a disk, and ten
/// in an object store.
const MOST_FLIGHTS: usize = 200;

/// Findings on the columns of an archive.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ArchiveColumns {
    /// Number of flights whose files were opened.
    pub examined: usize,
    /// Number of these flights that a run would refuse.
    pub refused: usize,
    /// Cost of the signals that files lack, with the number of flights.
    pub absences: Vec<(String, usize)>,
    /// Reasons for which a run would refuse flights, with their number.
    pub refusals: Vec<(String, usize)>,
}

/// Findings on one flight.
struct FlightColumns {
    absences: Vec<String>,
    refusal: Option<String>,
}

/// Compares the files of flights with the channel map. Of many flights some are examined, at equal
/// distances in the archive.
#[must_use]
pub fn examine_columns(config: &Config, flights: &[FlightFiles]) -> ArchiveColumns {
    let step = flights.len().div_ceil(MOST_FLIGHTS).max(1);
    let examined: Vec<&FlightFiles> = flights.iter().step_by(step).collect();
    let examined: Vec<FlightColumns> = examined
        .par_iter()
        .map(|flight| examine(config, flight))
        .collect();
    let refusals: Vec<&String> = examined.iter().filter_map(|f| f.refusal.as_ref()).collect();
    ArchiveColumns {
        examined: examined.len(),
        refused: refusals.len(),
        absences: counted(examined.iter().flat_map(|flight| &flight.absences)),
        refusals: counted(refusals.iter().copied()),
    }
}

/// Lines with the number of their repetitions, in the order in which they come first.
fn counted<'a>(lines: impl Iterator<Item = &'a String>) -> Vec<(String, usize)> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for line in lines {
        let place = *places.entry(line).or_insert(counts.len());
        match counts.get_mut(place) {
            Some((_, count)) => *count += 1,
            None => counts.push((line.clone(), 1)),
        }
    }
    counts
}

fn examine(config: &Config, flight: &FlightFiles) -> FlightColumns {
    let refused = |problem: Problem| Some(problem.reason);
    let columns = match archive::mapped_columns(flight, &config.channels) {
        Ok(columns) => columns,
        Err(problem) => {
            return FlightColumns {
                absences: vec![],
                refusal: refused(problem),
            };
        }
    };
    let columns: &[RawFlight] = &columns;
    let columns = ComputedColumns::of(columns, &config.channels);
    let context = Context {
        channels: &config.channels,
        constants: &config.constants,
        aircraft: &config.aircraft,
        settings: &config.ingest,
    };
    FlightColumns {
        absences: config.absences_in_files(&lacking(&columns, &config.channels)),
        refusal: check_clocks(&columns, &config.channels)
            .and_then(|()| plan_channels(&columns, &context))
            .err()
            .and_then(refused),
    }
}

/// Signals of the channel map whose columns no file of a flight has.
fn lacking(columns: &impl ColumnSource, channels: &BTreeMap<String, Channel>) -> BTreeSet<String> {
    let is_lacking = |(name, channel): &(&String, &Channel)| {
        let mut files = 0..columns.files();
        channel.signal != signal::TIME && !files.any(|file| columns.has(file, name))
    };
    let lacking = channels.iter().filter(is_lacking);
    lacking.map(|(_, channel)| channel.signal.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_several_flights_comes_once_with_their_number() {
        let lines = ["a", "b", "a"].map(str::to_owned);
        let counted = counted(lines.iter());
        assert_eq!(counted, [("a".to_owned(), 2), ("b".to_owned(), 1)]);
    }
}
