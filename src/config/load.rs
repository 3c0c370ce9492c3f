//! Loading of a pipeline's folder: files, options of the command line, checks.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::checked::Config;
use super::instruments::{self, InstrumentErrors};
use super::source::{Files, Source};
use super::written::PipelineFile;
use super::{channel_map, check, events, moved, places, questions, tunnel_tables};
use crate::aero::{AeroModel, Axis};
use crate::error::Result;
use crate::maneuver::{Class, Status};
use crate::output_error::calibration_errors::Calibration;
use crate::{segment, store};

/// Options of the command line that replace keys of `pipeline.yaml`.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    pub archive: Option<String>,
    pub wind_tunnel: Option<PathBuf>,
    pub store: Option<PathBuf>,
    pub store_cache: Option<PathBuf>,
    pub reports: Option<PathBuf>,
    pub events: Option<PathBuf>,
    /// Folders of earlier campaigns' tables; without any, those of the pipeline.
    pub against: Vec<PathBuf>,
    /// Memory that reading may use at once, MB.
    pub memory_mb: Option<f64>,
}

impl Overrides {
    fn replace_keys(self, pipeline: &mut PipelineFile) {
        if let Some(archive) = self.archive {
            pipeline.archive = archive;
        }
        replace(&mut pipeline.wind_tunnel, self.wind_tunnel);
        replace(&mut pipeline.store, self.store);
        replace(&mut pipeline.store_cache, self.store_cache);
        replace(&mut pipeline.reports, self.reports);
        replace(&mut pipeline.events, self.events);
        if !self.against.is_empty() {
            pipeline.compare.against = self.against;
        }
        if let Some(memory_mb) = self.memory_mb {
            pipeline.ingest.memory_mb = memory_mb;
        }
    }
}

/// Puts an option in the place of a key, where the option is given.
fn replace<T>(key: &mut Option<T>, option: Option<T>) {
    *key = option.or(key.take());
}

impl Config {
    /// Reads and checks a pipeline's folder.
    ///
    /// # Errors
    /// [`crate::error::Error`] of the configuration with file, line and the probable meaning, for the
    /// first mistake.
    pub fn load(folder: &Path, overrides: Overrides) -> Result<Config> {
        let files = Files::read(folder)?;
        questions::none_open(&files)?;
        let mut pipeline = pipeline_file(&files.pipeline)?;
        overrides.replace_keys(&mut pipeline);
        let aircraft = files.aircraft()?;
        share_keys(&mut pipeline, &aircraft.instruments);
        let aero_model = files.model()?;
        let mut classes = files.classes()?;
        let name = folder.file_name().map_or_else(
            || "pipeline".to_owned(),
            |n| n.to_string_lossy().into_owned(),
        );
        let template = pipeline.report.template.as_deref();
        let template = template.map(store::files::text).transpose()?;
        let (store, shared_store) = places::store(
            pipeline.store,
            pipeline.store_cache,
            Path::new("data/store").join(&name),
            &files.pipeline,
        )?;
        let default_reports = Path::new("reports").join(&name);
        let reports = pipeline.reports.unwrap_or(default_reports);
        places::reachable(Path::new(&pipeline.archive))?;
        let read_tables = |file| tunnel_tables::read_optional(file, &aero_model, &pipeline.tunnel);
        let tunnel = read_tables(pipeline.wind_tunnel.as_deref())?;
        let held_at_nothing = match &pipeline.wind_tunnel {
            Some(_) => 0,
            None => classes.iter_mut().map(Class::hold_nothing).sum(),
        };
        name_surfaces(&mut classes, &aero_model, &pipeline.segment);
        let proof = files.proof_of_match()?;
        let match_database = proof.as_ref().and_then(|proof| proof.database.as_deref());
        let match_database = read_tables(match_database)?;
        let channels = channel_map::channels(&aircraft.channels, &files.aircraft)?;
        let config = Config {
            tunnel,
            held_at_nothing,
            events: events::read(pipeline.events.as_deref(), &classes)?,
            title: pipeline.title,
            archive: pipeline.archive,
            wind_tunnel: pipeline.wind_tunnel,
            store,
            shared_store,
            reports: places::in_folder(reports, "reports are published in a folder")?,
            name,
            aircraft: aircraft.aircraft,
            unused_columns: channel_map::unused(&aircraft.channels, &channels),
            channels,
            constants: aircraft.constants,
            aero_model,
            classes,
            ingest: pipeline.ingest,
            segment: pipeline.segment,
            estimate: pipeline.estimate,
            trend: pipeline.trend,
            model: pipeline.model,
            qualities: files.qualities()?,
            match_database,
            proof_of_match: proof,
            compare: pipeline.compare,
            export: pipeline.export,
            report: pipeline.report,
            cluster: pipeline.cluster,
            template,
            files: files.all().map(|file| file.named(folder)).collect(),
        };
        check::whole(&config, &files, &aircraft.instruments)?;
        Ok(config)
    }
}

/// Parses `pipeline.yaml`; keys that have moved are refused with their new places.
fn pipeline_file(source: &Source) -> Result<PipelineFile> {
    let parsed = source.parse();
    parsed.map_err(|error| moved::refusal(source).unwrap_or(error))
}

/// Copies keys that several stages share, and the sizes of instrument errors, to the stages that
/// read them.
fn share_keys(pipeline: &mut PipelineFile, errors: &BTreeMap<String, InstrumentErrors>) {
    pipeline.ingest.share();
    pipeline.model.tunnel_uncertainty_pct = pipeline.estimate.held_uncertainty_pct;
    pipeline.estimate.tunnel_error_length_deg = pipeline.model.length_deg;
    let compatibility = &mut pipeline.ingest.compatibility;
    for (signal, instrument) in errors {
        if let Some(size) = compatibility.ordinary.of_signal(signal) {
            instruments::replace(size, instrument.ordinary.given());
        }
        if let Some(size) = compatibility.faulty.of_signal(signal) {
            instruments::replace(size, instrument.fault.given());
        }
    }
    let ordinary = &mut pipeline.ingest.compatibility.ordinary;
    let estimate = &mut pipeline.estimate;
    let outputs = [Axis::Longitudinal, Axis::Lateral].into_iter();
    for output in outputs.flat_map(Axis::outputs) {
        if let Some(size) = ordinary.of_signal(output.signal()) {
            estimate.ordinary_bias.insert(output, size.bias);
        }
    }
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

/// Enters into each class the surfaces whose derivatives it estimates and whose steps are found.
fn name_surfaces(classes: &mut [Class], aero_model: &AeroModel, segment: &segment::Settings) {
    for class in classes {
        let estimated = aero_model
            .derivatives_of(class.axis)
            .filter(|derivative| class.statuses.get(&derivative.name) == Some(&Status::Estimated));
        let surfaces = estimated.filter_map(|derivative| derivative.regressor.surface());
        let stepping = surfaces.filter(|surface| segment.steps.contains_key(*surface));
        let names: BTreeSet<String> = stepping.map(str::to_owned).collect();
        class.recognition.surfaces = names.into_iter().collect();
    }
}
