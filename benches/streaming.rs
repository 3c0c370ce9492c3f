//! Throughput of ingest and segment, beside polars reading the same columns.
//!
//! `cargo bench --bench streaming` uses the demonstration campaign, `cargo bench --bench streaming --
//! <folder>` another archive; long flights give steadier figures. Each measurement follows a run that
//! fills the file cache, and is the best of three. The last line is the maximum memory of the
//! process. polars is that of Python: `pip install polars`.

#![expect(clippy::print_stdout, reason = "a benchmark's own output")]

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::Context;
use harvest::config::{Config, Overrides};
use harvest::lineage::Stage;
use harvest::night;
use harvest::pipeline::Progress;
use harvest::store::archive::{self, FlightFiles};

/// Progress without output.
struct Quiet;

impl Progress for Quiet {
    fn begin(&self, _: &str, _: usize) {}
    fn start(&self, _: &str) {}
    fn advance(&self, _: &str) {}
    fn end(&self) {}
}

/// Best time of three repetitions after a warm-up.
fn best(mut work: impl FnMut() -> anyhow::Result<()>) -> anyhow::Result<Duration> {
    work()?;
    let mut best = Duration::MAX;
    for _ in 0..3 {
        let start = Instant::now();
        work()?;
        best = best.min(start.elapsed());
    }
    Ok(best)
}

/// Maximum resident memory of the process, MB.
fn memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0 / 1e6)
}

/// Runs a pipeline into a new store as far as a stage.
fn run(archive: Option<&str>, until: Stage) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let own = Overrides {
        archive: archive.map(str::to_owned),
        store: Some(folder.path().join("store")),
        reports: Some(folder.path().join("reports")),
        ..Overrides::default()
    };
    let config = Config::load(Path::new("pipelines/harv"), own)?;
    night::run(&config, until, std::time::Duration::ZERO, &Quiet)?;
    Ok(())
}

/// Columns read by polars: the best time of three, and the size of the columns in memory.
struct Polars {
    time: Duration,
    decoded_mb: f64,
}

/// Reads the mapped columns of all flights by polars for Python.
fn polars(config: &Config, flights: &[FlightFiles]) -> anyhow::Result<Polars> {
    let columns: Vec<&str> = config.channels.keys().map(String::as_str).collect();
    let output = Command::new("python3")
        .args(["benches/polars_rate.py", &columns.join(",")])
        .args(flights.iter().flat_map(|flight| &flight.files))
        .output()
        .context("python3")?;
    let text = String::from_utf8(output.stdout)?;
    let numbers: Vec<f64> = text.split_whitespace().flat_map(str::parse).collect();
    let [seconds, decoded_mb] = numbers[..] else {
        anyhow::bail!("polars: {}", String::from_utf8_lossy(&output.stderr));
    };
    Ok(Polars {
        time: Duration::from_secs_f64(seconds),
        decoded_mb,
    })
}

fn main() -> anyhow::Result<()> {
    let archive = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    let own = Overrides {
        archive: archive.clone(),
        ..Overrides::default()
    };
    let config = Config::load(Path::new("pipelines/harv"), own)?;
    let flights = archive::find(&config.archive)?;
    let ingest = best(|| run(archive.as_deref(), Stage::Ingest))?;
    let segment = best(|| run(archive.as_deref(), Stage::Segment))?;
    let memory = memory_mb();
    let polars = polars(&config, &flights)?;
    let rate = |time: Duration| polars.decoded_mb / time.as_secs_f64();
    println!(
        "{} flights, {:.0} MB decoded",
        flights.len(),
        polars.decoded_mb
    );
    println!(
        "polars reads the columns                {:8.0} MB/s",
        rate(polars.time)
    );
    let ratio = |time: Duration| polars.time.as_secs_f64() / time.as_secs_f64();
    println!(
        "ingest, into a new store                {:8.0} MB/s, {:.2} of polars",
        rate(ingest),
        ratio(ingest)
    );
    println!(
        "ingest and segment, into a new store    {:8.0} MB/s, {:.2} of polars",
        rate(segment),
        ratio(segment)
    );
    if let Some(memory) = memory {
        println!("maximum memory of ingest and segment    {memory:8.0} MB");
    }
    Ok(())
}
