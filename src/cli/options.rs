//! Options that several commands share, and exit codes.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::Args;

use crate::config::{Config, Overrides};
use crate::store::files;

/// Exit code of a command that rejected something, and of a night that is no longer valid.
pub const REJECTED: u8 = 2;

/// Exit code when values moved, or artefacts are stale or missing.
pub const ATTENTION: u8 = 3;

/// Exit code for a wrong command line: an unknown command, option or value (`EX_USAGE`).
pub const USAGE: u8 = 64;

/// Exit code of work that another try may complete (`EX_TEMPFAIL`).
pub const TRY_AGAIN: u8 = 75;

/// Largest number of threads: more than any machine has processors.
const MOST_THREADS: usize = 4096;

/// Returns `code` if the condition holds, otherwise 0.
pub fn exit_code(condition: bool, code: u8) -> ExitCode {
    ExitCode::from(if condition { code } else { 0 })
}

#[derive(Args, Debug)]
pub struct WaitOptions {
    /// Longest wait for another run to leave the store and the reports
    #[arg(long = "wait", value_name = "SECONDS", default_value_t = 0)]
    pub seconds: u64,
}

impl WaitOptions {
    pub fn longest_wait(&self) -> Duration {
        Duration::from_secs(self.seconds)
    }
}

#[derive(Args, Debug)]
pub struct Options {
    /// The pipeline: a folder with pipeline.yaml, aircraft.yaml, model.yaml and maneuvers/, or its
    /// name under pipelines/
    #[arg(default_value = "harv")]
    pub pipeline: PathBuf,
    /// Flight archive instead of the pipeline's: a folder or a glob of Parquet files, also
    /// partitioned as flight=…/; or the same in an object store, s3://bucket/prefix
    #[arg(long)]
    pub archive: Option<String>,
    /// Wind-tunnel database instead of the pipeline's: DAVE-ML (.dml, .xml), or CSV or Parquet with
    /// derivative, alpha_deg, value, unit[, mach, uncertainty, source]
    #[arg(long, value_name = "FILE")]
    pub wind_tunnel: Option<PathBuf>,
    /// The analyst's events instead of the pipeline's: CSV with flight_id, class, start_s, end_s
    #[arg(long, value_name = "FILE")]
    pub events: Option<PathBuf>,
    /// Folder with the tables of an earlier campaign or night to compare with, besides the tunnel;
    /// may be given again
    #[arg(long, value_name = "FOLDER")]
    pub against: Vec<PathBuf>,
    /// Folder of the intermediate artefacts, or a place in an object store, s3://bucket/prefix
    /// [default: data/store/<pipeline>]
    #[arg(long, value_name = "FOLDER")]
    pub store: Option<PathBuf>,
    /// Local cache of a store in an object store [default: data/store/<pipeline>]
    #[arg(long, value_name = "FOLDER")]
    pub store_cache: Option<PathBuf>,
    /// Folder of the tables and the report [default: reports/<pipeline>]
    #[arg(long, value_name = "FOLDER")]
    pub reports: Option<PathBuf>,
    /// Number of threads; results do not depend on it [default: all cores]
    #[arg(long, short = 'j', visible_alias = "jobs", value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Memory for reading flights, over all of them, instead of the pipeline's; results do not depend
    /// on it
    #[arg(long, value_name = "MB", value_parser = memory)]
    pub memory_mb: Option<f64>,
    /// No progress bars and no summary
    #[arg(long, short)]
    pub quiet: bool,
}

/// Number of threads as typed, at least one.
fn threads(typed: &str) -> Result<usize, String> {
    match typed.parse() {
        Ok(threads @ 1..=MOST_THREADS) => Ok(threads),
        _ => Err(format!(
            "it must be a whole number from 1 to {MOST_THREADS}"
        )),
    }
}

/// Memory in MB as typed: a number of at least one.
fn memory(typed: &str) -> Result<f64, String> {
    let memory_mb: f64 = typed.parse().map_err(|_| "it is no number".to_owned())?;
    if (1.0..=1e9).contains(&memory_mb) {
        Ok(memory_mb)
    } else {
        Err("it must lie between 1 and 1e9".to_owned())
    }
}

impl Options {
    /// Pipeline and options as typed, for a script that repeats the command; options of the
    /// terminal are left out.
    pub fn typed(&self) -> Vec<String> {
        let path = |path: &Path| path.display().to_string();
        let options = [
            ("--archive", self.archive.clone()),
            ("--wind-tunnel", self.wind_tunnel.as_deref().map(path)),
            ("--events", self.events.as_deref().map(path)),
            ("--store", self.store.as_deref().map(path)),
            ("--store-cache", self.store_cache.as_deref().map(path)),
            ("--reports", self.reports.as_deref().map(path)),
            ("--memory-mb", self.memory_mb.map(|mb| mb.to_string())),
        ];
        let against = self
            .against
            .iter()
            .map(|folder| ("--against", Some(path(folder))));
        let given = options
            .into_iter()
            .chain(against)
            .filter_map(|(name, value)| Some([name.to_owned(), value?]));
        std::iter::once(path(&self.pipeline))
            .chain(given.flatten())
            .collect()
    }

    /// Folder of the pipeline.
    pub fn folder(&self) -> anyhow::Result<PathBuf> {
        let folder = if files::is_folder(&self.pipeline) {
            self.pipeline.clone()
        } else {
            Path::new("pipelines").join(&self.pipeline)
        };
        anyhow::ensure!(
            files::is_folder(&folder),
            "there is no pipeline {}: give a folder, or the name of one under pipelines/",
            self.pipeline.display()
        );
        Ok(folder)
    }

    /// Loads the configuration with the options of the command line.
    pub fn load(&self) -> anyhow::Result<Config> {
        let folder = self.folder()?;
        let overrides = Overrides {
            archive: self.archive.clone(),
            wind_tunnel: self.wind_tunnel.clone(),
            store: self.store.clone(),
            store_cache: self.store_cache.clone(),
            reports: self.reports.clone(),
            events: self.events.clone(),
            against: self.against.clone(),
            memory_mb: self.memory_mb,
        };
        Ok(Config::load(&folder, overrides)?)
    }
}

/// Starts this number of threads; by default one per core.
pub fn start_threads(threads: Option<usize>) -> anyhow::Result<()> {
    if let Some(threads) = threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .context("cannot start the threads")?;
    }
    Ok(())
}
