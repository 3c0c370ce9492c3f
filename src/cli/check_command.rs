//! The command `check`.

use std::process::ExitCode;

use super::options::{Options, REJECTED, start_threads};
use crate::config::{Config, doubts};
use crate::maneuver::Status;
use crate::pipeline::{ArchiveColumns, examine_columns};
use crate::store::archive;

/// Least width of the names of classes.
const SHORT_CLASS: usize = 10;

/// Validates the configuration and prints what a run would use.
pub fn check(options: &Options) -> anyhow::Result<ExitCode> {
    start_threads(options.threads)?;
    let config = options.load()?;
    let flights = archive::find(&config.archive)?;
    out!("pipeline   {}: {}", config.name, config.title);
    out!("archive    {}: {} flights", config.archive, flights.len());
    out!(
        "aircraft   {}, {} channels",
        config.aircraft.name,
        config.channels.len()
    );
    out!(
        "model      {} derivatives, {} biases",
        config.aero_model.derivatives.len(),
        config.aero_model.biases.len()
    );
    out!("tunnel     {}", config.tunnel_name());
    out!(
        "events     {}",
        if config.events.is_empty() {
            "found in the records".into()
        } else {
            format!("{} given", config.events.len())
        }
    );
    print_classes(&config);
    match &config.shared_store {
        Some(shared) => out!(
            "store      {}, kept in {}",
            shared.display(),
            config.store.display()
        ),
        None => out!("store      {}", config.store.display()),
    }
    out!("reports    {}", config.reports.display());
    for absence in config.absences() {
        out!("without    {absence}");
    }
    let columns = examine_columns(&config, &flights);
    print_columns(&columns, flights.len());
    print_notes(&config);
    if columns.refused == columns.examined {
        out!("The configuration is valid; a run would refuse every flight.");
        return Ok(ExitCode::from(REJECTED));
    }
    out!("The configuration is valid.");
    Ok(ExitCode::SUCCESS)
}

/// Prints the classes with the number of their derivatives of each status.
fn print_classes(config: &Config) {
    let longest = config.classes.iter().map(|c| c.name.chars().count()).max();
    let width = longest.unwrap_or_default().max(SHORT_CLASS);
    out!("{:<width$} estimated  held  inactive", "classes");
    for class in &config.classes {
        let count = |status| class.statuses.values().filter(|s| **s == status).count();
        let [free, held, inactive] = [Status::Estimated, Status::Held, Status::Inactive].map(count);
        out!(
            "  {:<width$} {free:>7} {held:>5} {inactive:>9}  {}",
            class.name,
            class.title
        );
    }
}

/// Prints unused columns, warnings of the settings, and what the draft was not sure of.
fn print_notes(config: &Config) {
    for column in &config.unused_columns {
        out!("note       channel `{column}`: it has no `signal`, and no formula or table uses it");
    }
    let of_hold = config.estimate.hold.warning().map(str::to_owned);
    for warning in of_hold.into_iter().chain(config.aero_model.lag_warning()) {
        out!("note       {warning}");
    }
    let doubts = doubts(config);
    for doubt in &doubts {
        out!("not sure   {}:{}: {}", doubt.file, doubt.line, doubt.text);
    }
    if !doubts.is_empty() {
        out!("           Check these, and delete the word `unsure:` of each that is right.");
    }
}

/// Prints what the files of the archive lack, and which of its flights a run would refuse.
fn print_columns(columns: &ArchiveColumns, flights: usize) {
    let of_flights = |count: usize| {
        if count == columns.examined {
            "all".to_owned()
        } else {
            format!("{count} of {}", columns.examined)
        }
    };
    if columns.examined < flights {
        let examined = columns.examined;
        out!("note       the columns of {examined} of {flights} flights were examined");
    }
    for (absence, count) in &columns.absences {
        out!("without    in {} flights: {absence}", of_flights(*count));
    }
    for (reason, count) in &columns.refusals {
        out!("refused    {} flights: {reason}", of_flights(*count));
    }
}
