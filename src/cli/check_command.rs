//! The command `check`.

use std::process::ExitCode;

use super::options::Options;
use crate::maneuver::Status;
use crate::store::archive;

/// Validates the configuration and prints what a run would use.
#[expect(clippy::print_stdout, reason = "the output of a check")]
pub fn check(options: &Options) -> anyhow::Result<ExitCode> {
    let config = options.load()?;
    let flights = archive::find(&config.archive)?;
    println!("pipeline   {}: {}", config.name, config.title);
    println!("archive    {}: {} flights", config.archive, flights.len());
    println!(
        "aircraft   {}, {} channels",
        config.aircraft.name,
        config.channels.len()
    );
    println!(
        "model      {} derivatives, {} biases",
        config.buildup.derivatives.len(),
        config.buildup.biases.len()
    );
    println!("tunnel     {}", config.wind_tunnel.display());
    println!(
        "events     {}",
        if config.events.is_empty() {
            "found in the records".into()
        } else {
            format!("{} given", config.events.len())
        }
    );
    println!("classes    estimated  held  inactive");
    for class in &config.classes {
        let count = |status| class.statuses.values().filter(|s| **s == status).count();
        let [free, held, inactive] = [Status::Estimated, Status::Held, Status::Inactive].map(count);
        println!(
            "  {:<10} {free:>7} {held:>5} {inactive:>9}  {}",
            class.name, class.title
        );
    }
    match &config.shared_store {
        Some(shared) => println!(
            "store      {}, kept in {}",
            shared.display(),
            config.store.display()
        ),
        None => println!("store      {}", config.store.display()),
    }
    println!("reports    {}", config.reports.display());
    if let Some(warning) = config.estimate.hold.warning() {
        println!("note       {warning}");
    }
    println!("The configuration is right.");
    Ok(ExitCode::SUCCESS)
}
