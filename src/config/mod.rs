//! Configuration: YAML as written, checked whole before any flight is opened, as checked types.
//!
//! A pipeline is a folder: `pipeline.yaml` (archive, store, reports, settings of the stages),
//! `aircraft.yaml` (geometry, sensors, channel map), `model.yaml` (the build-up) and
//! `maneuvers/*.yaml` (one class per file).

mod check;
mod cluster;
mod instruments;
mod moved;
mod places;
mod source;
mod written;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::aero::{Buildup, WindTunnel};
use crate::aircraft::Aircraft;
use crate::error::Result;
use crate::flight::Channel;
use crate::maneuver::{Class, Event};
use crate::output_error::calibration_errors::Calibration;
use crate::{compare, estimate, export, ingest, segment, trend};

use instruments::Instrument;
use written::PipelineFile;

pub(crate) use check::tunnel_rows;
pub use cluster::ClusterSettings;
pub(crate) use source::Source;
pub use written::ReportSettings;

/// Everything that decides a campaign's results, checked.
#[derive(Clone, Debug)]
pub struct Config {
    /// Name of the pipeline: its folder's.
    pub name: String,
    pub title: String,
    /// Folder or glob of the flight archive, in the file system or in an object store
    /// (`s3://bucket/prefix`).
    pub archive: String,
    /// The wind-tunnel table's file, as the report names it.
    pub wind_tunnel: PathBuf,
    /// Folder of the artefacts.
    pub store: PathBuf,
    /// Where they lie in an object store, which the folder then is the cache of.
    pub shared_store: Option<PathBuf>,
    pub reports: PathBuf,
    pub aircraft: Aircraft,
    pub channels: BTreeMap<String, Channel>,
    pub constants: BTreeMap<String, f64>,
    pub buildup: Buildup,
    pub tunnel: WindTunnel,
    pub classes: Vec<Class>,
    pub events: Vec<Event>,
    pub ingest: ingest::Settings,
    pub segment: segment::Settings,
    pub estimate: estimate::Settings,
    pub trend: trend::Settings,
    pub compare: compare::Settings,
    pub export: export::Settings,
    pub report: ReportSettings,
    pub cluster: ClusterSettings,
    /// The analyst's own report template, where there is one.
    pub template: Option<String>,
    /// The pipeline's files as they are: name and text.
    pub files: Vec<(String, String)>,
}

/// What the command line says instead of the pipeline's YAML.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    pub archive: Option<String>,
    pub wind_tunnel: Option<PathBuf>,
    pub store: Option<PathBuf>,
    pub store_cache: Option<PathBuf>,
    pub reports: Option<PathBuf>,
    pub events: Option<PathBuf>,
    /// Folders of earlier campaigns' tables; the pipeline's own where it is empty.
    pub against: Vec<PathBuf>,
    /// What reading may hold in memory at once, MB.
    pub memory_mb: Option<f64>,
}

impl Config {
    /// Reads and checks a pipeline's folder.
    ///
    /// # Errors
    /// [`crate::error::Error::Config`] with file, line and what was probably meant, for the first
    /// thing that is wrong.
    pub fn load(folder: &Path, overrides: Overrides) -> Result<Config> {
        let files = source::Files::read(folder)?;
        let mut pipeline = files.pipeline()?;
        let aircraft = files.aircraft()?;
        share_keys(&mut pipeline, &aircraft.instruments);
        let buildup = files.model()?;
        let classes = files.classes()?;
        let wind_tunnel = overrides.wind_tunnel.unwrap_or(pipeline.wind_tunnel);
        let name = folder.file_name().map_or_else(
            || "pipeline".to_owned(),
            |n| n.to_string_lossy().into_owned(),
        );
        let events = overrides.events.or(pipeline.events);
        let template = pipeline
            .report
            .template
            .as_deref()
            .map(crate::store::files::text)
            .transpose()?;
        let default = Path::new("data/store").join(&name);
        let store = overrides.store.or(pipeline.store);
        let cache = overrides.store_cache.or(pipeline.store_cache);
        let (store, shared_store) = places::store(store, cache, default, &files.pipeline)?;
        let reports = overrides
            .reports
            .or(pipeline.reports)
            .unwrap_or_else(|| Path::new("reports").join(&name));
        let archive = overrides.archive.unwrap_or(pipeline.archive);
        places::reachable(Path::new(&archive))?;
        let config = Config {
            tunnel: check::tunnel(&wind_tunnel, &buildup, &pipeline.tunnel)?,
            events: check::events(events.as_deref(), &classes)?,
            title: pipeline.title,
            archive,
            wind_tunnel,
            store,
            shared_store,
            reports: places::in_folder(reports, "reports are published in a folder")?,
            name,
            aircraft: aircraft.aircraft,
            channels: aircraft.channels,
            constants: aircraft.constants,
            buildup,
            classes,
            ingest: ingest::Settings {
                memory_mb: overrides.memory_mb.unwrap_or(pipeline.ingest.memory_mb),
                ..pipeline.ingest
            },
            segment: pipeline.segment,
            estimate: pipeline.estimate,
            trend: pipeline.trend,
            compare: against(pipeline.compare, overrides.against),
            export: pipeline.export,
            report: pipeline.report,
            cluster: pipeline.cluster,
            template,
            files: files.all().map(|file| file.named(folder)).collect(),
        };
        check::whole(&config, &files)?;
        check::instruments(&aircraft.instruments, &config, &files.aircraft)?;
        Ok(config)
    }

    #[must_use]
    pub fn class(&self, name: &str) -> Option<&Class> {
        self.classes.iter().find(|c| c.name == name)
    }

    /// Names of derivatives and combined sums in the order of the model, as trends and figures have
    /// them.
    #[must_use]
    pub fn derivative_names(&self) -> Vec<String> {
        let derivatives = self.buildup.derivatives.iter().map(|d| &d.name);
        derivatives
            .chain(self.buildup.combined.iter().map(|c| &c.name))
            .cloned()
            .collect()
    }
}

/// Copies keys that several stages share, and the sizes of instrument errors, to the stages that
/// read them.
fn share_keys(pipeline: &mut PipelineFile, errors: &BTreeMap<String, Instrument>) {
    pipeline.ingest.share();
    let compatibility = &mut pipeline.ingest.compatibility;
    for (signal, instrument) in errors {
        if let Some(size) = compatibility.ordinary.of_signal(signal) {
            instruments::replace(size, instrument.ordinary.given());
        }
        if let Some(size) = compatibility.faulty.of_signal(signal) {
            instruments::replace(size, instrument.fault.given());
        }
    }
    let estimate = &mut pipeline.estimate;
    estimate.max_marked_share = pipeline.segment.quality.marked_share;
    estimate.calibration = errors
        .iter()
        .filter(|(_, instrument)| instrument.uncertainty != Calibration::default())
        .map(|(signal, instrument)| (signal.clone(), instrument.uncertainty))
        .collect();
    if let Some(joint) = &mut estimate.joint {
        joint.share_constants = estimate.share_constants;
    }
    if let Some(prediction) = &mut estimate.prediction {
        prediction.share_constants = estimate.share_constants;
    }
}

/// The comparison's settings with the earlier campaigns that the command line names, where it names
/// some.
fn against(settings: compare::Settings, named: Vec<PathBuf>) -> compare::Settings {
    if named.is_empty() {
        settings
    } else {
        compare::Settings {
            against: named,
            ..settings
        }
    }
}

#[cfg(test)]
mod settings_page;
#[cfg(test)]
mod tests;
