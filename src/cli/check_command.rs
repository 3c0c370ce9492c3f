//! The command `check`.

use std::process::ExitCode;

use super::options::Options;
use crate::config::doubts;
use crate::maneuver::Status;
use crate::store::archive;

/// Least width of the names of classes.
const SHORT_CLASS: usize = 10;

/// Validates the configuration and prints what a run would use.
pub fn check(options: &Options) -> anyhow::Result<ExitCode> {
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
        config.buildup.derivatives.len(),
        config.buildup.biases.len()
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
    for column in &config.unused_columns {
        out!("note       channel `{column}`: it has no `signal`, and no formula or table uses it");
    }
    let of_hold = config.estimate.hold.warning().map(str::to_owned);
    for warning in of_hold.into_iter().chain(config.buildup.lag_warning()) {
        out!("note       {warning}");
    }
    let doubts = doubts(&config);
    for doubt in &doubts {
        out!("not sure   {}:{}: {}", doubt.file, doubt.line, doubt.text);
    }
    if !doubts.is_empty() {
        out!("           Check these, and delete the word `unsure:` of each that is right.");
    }
    out!("The configuration is valid.");
    Ok(ExitCode::SUCCESS)
}
