//! The YAML files as they are written.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

use super::cluster::ClusterSettings;
use super::instruments::InstrumentErrors;
use crate::aero::{
    AeroModel, Axis, Bias, Coefficient, Combined, Derivative, Output, Regressor, wind_tunnel,
};
use crate::aircraft::Aircraft;
use crate::maneuver::class::Recognition;
use crate::maneuver::{Class, ClassOverrides, Status};
use crate::settings::settings;
use crate::{compare, estimate, export, ingest, model, segment, trend};

settings! {
    /// `pipeline.yaml`. Paths are relative to the folder harvest is run in.
    pub struct PipelineFile {
        /// Title of the report.
        pub title: String,
        /// Flight archive: a folder, a glob, a tree partitioned as `flight=…/`, or a place in an
        /// object store (`s3://bucket/prefix`).
        pub archive: String,
        /// Wind-tunnel tables: CSV, Parquet or DAVE-ML. Without them nothing is held or compared.
        #[serde(default)]
        pub wind_tunnel: Option<PathBuf>,
        /// Artefacts: a folder, `data/store/<pipeline>` unless given, or a place in an object store.
        #[serde(default)]
        pub store: Option<PathBuf>,
        /// Folder of this machine that caches a store in an object store.
        #[serde(default)]
        pub store_cache: Option<PathBuf>,
        /// Folder of the tables and the report, `reports/<pipeline>` unless given.
        #[serde(default)]
        pub reports: Option<PathBuf>,
        /// CSV of the analyst's own maneuvers: `flight_id`, `class`, `start_s`, `end_s`. They replace
        /// what segment finds there.
        #[serde(default)]
        pub events: Option<PathBuf>,
        /// Reading of the wind-tunnel tables.
        #[serde(default)]
        pub tunnel: wind_tunnel::Settings,
        /// Channels into signals, repairs, checks.
        #[serde(default)]
        pub ingest: ingest::Settings,
        /// Maneuvers and their classes.
        #[serde(default)]
        pub segment: segment::Settings,
        /// Derivatives of each maneuver.
        #[serde(default)]
        pub estimate: estimate::Settings,
        /// Trends across angle of attack.
        #[serde(default)]
        pub trend: trend::Settings,
        /// Posterior: tunnel and flight as one answer.
        #[serde(default)]
        pub model: model::Settings,
        /// Comparison with the wind tunnel and earlier campaigns.
        #[serde(default)]
        pub compare: compare::Settings,
        /// Derivatives for simulators.
        #[serde(default)]
        pub export: export::Settings,
        /// Settings of the report and of the published nights.
        #[serde(default)]
        pub report: ReportSettings,
        /// Resources on a batch cluster.
        #[serde(default)]
        pub cluster: ClusterSettings,
    }
}

settings! {
    /// Settings of the report.
    pub struct ReportSettings {
        /// Angle of attack of the time histories, deg: each class shows its maneuver nearest to it.
        /// The paper's Figures 4 and 12 are at 30 deg.
        pub histories_at_alpha_deg: f64 = 30.0,
        /// Most maneuvers with a page of their own. Of more, those that changed, failed or represent
        /// their class come first.
        pub maneuver_pages: usize = 300,
        /// HTML template in place of the built-in one.
        pub template: Option<PathBuf> = None,
        /// Published nights that `harvest gc` keeps, at least one. Fewer: less disk space, and a
        /// shorter history to go back to.
        pub keep_nights: usize = 7,
    }
}

/// `aircraft.yaml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AircraftFile {
    pub aircraft: Aircraft,
    pub channels: BTreeMap<String, ChannelLine>,
    #[serde(default)]
    pub constants: BTreeMap<String, f64>,
    #[serde(default)]
    pub instruments: BTreeMap<String, InstrumentErrors>,
}

/// Line of the channel map: a column, a formula or a table with its signal; or a column without a
/// signal that only formulas and tables use.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelLine {
    pub signal: Option<String>,
    pub unit: Option<String>,
    pub sign: Option<f64>,
    pub scale: Option<f64>,
    pub wraps_at: Option<f64>,
    pub formula: Option<String>,
    pub table: Option<TableLine>,
}

/// Table of a channel: its values, in the channel's unit, over the result of a formula.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableLine {
    /// Formula of columns.
    pub over: String,
    /// Unit of `at`.
    pub at_unit: String,
    pub at: Vec<f64>,
    pub value: Vec<f64>,
}

/// `model.yaml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    derivatives: Vec<DerivativeLine>,
    #[serde(default)]
    biases: Vec<BiasLine>,
    #[serde(default)]
    combined: Vec<CombinedLine>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DerivativeLine {
    name: String,
    coefficient: Coefficient,
    regressor: String,
    #[serde(default)]
    vane: bool,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BiasLine {
    name: String,
    output: Output,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CombinedLine {
    name: String,
    constant: String,
    slope: String,
}

impl DerivativeLine {
    /// The derivative. The error has the name of its line, and the fault of its regressor.
    fn derivative(self) -> Result<Derivative, (String, String)> {
        let regressor = if self.vane {
            Ok(Regressor::Vane(self.regressor))
        } else {
            Regressor::parse(&self.regressor)
        };
        match regressor {
            Ok(regressor) => Ok(Derivative {
                name: self.name,
                coefficient: self.coefficient,
                regressor,
            }),
            Err(what) => Err((self.name, what)),
        }
    }
}

impl ModelFile {
    /// Build-up of the file. The error has the name of a derivative, and the fault of its
    /// regressor.
    pub fn aero_model(self) -> Result<AeroModel, (String, String)> {
        let file = self;
        let combined = |line: CombinedLine| Combined {
            name: line.name,
            constant: line.constant,
            slope: line.slope,
        };
        let derivatives = file.derivatives.into_iter();
        Ok(AeroModel {
            derivatives: derivatives
                .map(DerivativeLine::derivative)
                .collect::<Result<_, _>>()?,
            biases: file
                .biases
                .into_iter()
                .map(|b| Bias {
                    name: b.name,
                    output: b.output,
                })
                .collect(),
            combined: file.combined.into_iter().map(combined).collect(),
        })
    }
}

/// `maneuvers/<class>.yaml`: one column of Tables 1-4.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassFile {
    pub class: String,
    pub title: String,
    pub axis: Axis,
    pub recognise: Recognition,
    #[serde(default)]
    pub estimated: Vec<String>,
    #[serde(default)]
    pub held: Vec<String>,
    #[serde(default)]
    pub inactive: Vec<String>,
    pub weights: BTreeMap<Output, f64>,
    #[serde(default)]
    pub overrides: Vec<OverrideLine>,
}

/// Differences of a class above an angle of attack.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OverrideLine {
    pub above_alpha_deg: f64,
    #[serde(default)]
    pub weights: BTreeMap<Output, f64>,
    #[serde(default)]
    pub estimated: Vec<String>,
    #[serde(default)]
    pub held: Vec<String>,
    #[serde(default)]
    pub inactive: Vec<String>,
}

fn statuses(
    estimated: &[String],
    held: &[String],
    inactive: &[String],
) -> BTreeMap<String, Status> {
    let with = |names: &[String], status| {
        names
            .iter()
            .map(move |n| (n.clone(), status))
            .collect::<Vec<_>>()
    };
    [
        with(estimated, Status::Estimated),
        with(held, Status::Held),
        with(inactive, Status::Inactive),
    ]
    .concat()
    .into_iter()
    .collect()
}

impl From<ClassFile> for Class {
    fn from(file: ClassFile) -> Class {
        let overrides = file.overrides.into_iter().map(|line| ClassOverrides {
            above_alpha_deg: line.above_alpha_deg,
            statuses: statuses(&line.estimated, &line.held, &line.inactive),
            weights: line.weights,
        });
        Class {
            name: file.class,
            title: file.title,
            axis: file.axis,
            recognition: file.recognise,
            statuses: statuses(&file.estimated, &file.held, &file.inactive),
            weights: file.weights,
            overrides: overrides.collect(),
        }
    }
}
