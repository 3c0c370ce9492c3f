//! Throughput of ingest and segment, beside polars reading the same columns.
//!
//! `cargo bench --features polars-reader --bench streaming` uses the demonstration campaign; with
//! `-- <folder>` at its end, another archive. Long flights give steadier figures. Each measurement follows a run that
//! fills the file cache, and is the best of three. The last line is the maximum memory of the
//! process.

#![expect(clippy::print_stdout, reason = "a benchmark's own output")]

use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use harvest::config::{Config, Overrides};
use harvest::lineage::Stage;
use harvest::night;
use harvest::pipeline::Progress;
use harvest::store::archive;
use polars::prelude::{ArrowDataType, ParquetReader, SerReader};

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

fn main() -> anyhow::Result<()> {
    let archive = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    let own = Overrides {
        archive: archive.clone(),
        ..Overrides::default()
    };
    let config = Config::load(Path::new("pipelines/harv"), own)?;
    let flights = archive::find(&config.archive)?;
    let mut decoded = 0.0;
    let ingest = best(|| run(archive.as_deref(), Stage::Ingest))?;
    let segment = best(|| run(archive.as_deref(), Stage::Segment))?;
    let memory = memory_mb();
    let polars = best(|| {
        decoded = 0.0;
        for path in flights.iter().flat_map(|f| &f.files) {
            let schema = ParquetReader::new(File::open(path)?).schema()?;
            // polars is built without small integers here, so flags are left out.
            let small = [
                ArrowDataType::Int8,
                ArrowDataType::Int16,
                ArrowDataType::UInt8,
                ArrowDataType::UInt16,
            ];
            let read = schema
                .iter_values()
                .filter(|field| !small.contains(&field.dtype));
            let names = read
                .map(|field| field.name.to_string())
                .filter(|name| config.channels.contains_key(name));
            let frame = ParquetReader::new(File::open(path)?)
                .with_columns(Some(names.collect()))
                .finish()?;
            decoded += (frame.height() * frame.width() * 8) as f64 / 1e6;
        }
        Ok(())
    })
    .context("polars")?;
    let rate = |time: Duration| decoded / time.as_secs_f64();
    println!("{} flights, {decoded:.0} MB decoded", flights.len());
    println!(
        "polars reads the columns                {:8.0} MB/s",
        rate(polars)
    );
    let ratio = |time: Duration| polars.as_secs_f64() / time.as_secs_f64();
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
