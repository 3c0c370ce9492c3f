//! A run: the campaign brought up to date and published as a night.

use std::time::Duration;

use crate::config::Config;
use crate::error::Result;
use crate::lineage::Stage;
use crate::pipeline::{Campaign, Progress, Run, begin};
use crate::store::archive::FlightFiles;
use crate::store::{Nights, table};

use super::publish::Done;

/// Brings the campaign up to date as far as `until` and publishes it as a night; waits up to `wait`
/// for another run to leave store and reports.
///
/// # Errors
/// What stops the whole run: no archive, a store in use, a disk that says no. What spoils a flight
/// or a maneuver is among the problems of the night's summary.
pub fn run(config: &Config, until: Stage, wait: Duration, progress: &dyn Progress) -> Result<Done> {
    let (mut run, files) = begin(config, wait, progress)?;
    let nights = Nights::open(&config.reports, wait)?;
    if let Some(done) = run.is_published(&nights, until) {
        return Ok(done);
    }
    run.publish_into(nights.tonight()?);
    let made = run.make(&files, until, &nights).and_then(|campaign| {
        run.store.send_rest()?;
        run.publish(&nights, &campaign, until)
    });
    if made.is_err() {
        // What is left of tonight takes up room on a disk that may be full.
        nights.forget_tonight();
    }
    made
}

impl Run<'_> {
    /// All stages as far as `until`, their tables in tonight's folder.
    fn make(&self, files: &[FlightFiles], until: Stage, nights: &Nights) -> Result<Campaign> {
        let mut campaign = self.results(files, until)?;
        if until >= Stage::Report {
            campaign.overnight = self.changes(nights, &campaign)?;
            self.report(&mut campaign)?;
        }
        table::publish(&self.shelf(until), &campaign.problems)?;
        Ok(campaign)
    }
}
