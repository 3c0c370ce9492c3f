//! The YAML files as they are written.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::aero::{
    Axis, Bias, Buildup, Coefficient, Combined, Derivative, Output, Regressor, wind_tunnel,
};
use crate::aircraft::Aircraft;
use crate::flight::Channel;
use crate::maneuver::class::Recognition;
use crate::maneuver::{Class, Overrides, Status};
use crate::{compare, estimate, export, ingest, segment, trend};

/// `pipeline.yaml`. Paths are relative to the folder harvest is run in.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PipelineFile {
    pub title: String,
    pub archive: String,
    pub wind_tunnel: PathBuf,
    #[serde(default)]
    pub store: Option<PathBuf>,
    /// The folder beside a store in an object store.
    #[serde(default)]
    pub store_cache: Option<PathBuf>,
    #[serde(default)]
    pub reports: Option<PathBuf>,
    /// CSV of the analyst's events.
    #[serde(default)]
    pub events: Option<PathBuf>,
    /// How the tunnel's tables are read.
    #[serde(default)]
    pub tunnel: wind_tunnel::Settings,
    #[serde(default)]
    pub ingest: ingest::Settings,
    pub segment: segment::Settings,
    #[serde(default)]
    pub estimate: estimate::Settings,
    #[serde(default)]
    pub trend: trend::Settings,
    #[serde(default)]
    pub compare: compare::Settings,
    #[serde(default)]
    pub export: export::Settings,
    #[serde(default)]
    pub report: ReportSettings,
    #[serde(default)]
    pub cluster: super::cluster::ClusterSettings,
}

/// Settings of the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSettings {
    /// The class's maneuver nearest to this angle of attack shows its time histories.
    pub histories_at_alpha_deg: f64,
    /// So many maneuvers have a page of their own at most; which ones, `report::maneuvers_with_page` says.
    /// Default 600.
    pub maneuver_pages: usize,
    /// A template of the analyst's own instead of the built-in one.
    pub template: Option<PathBuf>,
    /// So many published nights stay; at least one. Default 7: a week to look back over.
    pub keep_nights: usize,
}

impl Default for ReportSettings {
    fn default() -> Self {
        // The paper's Figures 4 and 12 are at 30 deg.
        ReportSettings {
            histories_at_alpha_deg: 30.0,
            maneuver_pages: 600,
            template: None,
            keep_nights: 7,
        }
    }
}

/// `aircraft.yaml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AircraftFile {
    pub aircraft: Aircraft,
    pub channels: BTreeMap<String, Channel>,
    #[serde(default)]
    pub constants: BTreeMap<String, f64>,
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

impl From<ModelFile> for Buildup {
    fn from(file: ModelFile) -> Buildup {
        let derivative = |line: DerivativeLine| {
            let regressor = match (line.regressor.as_str(), line.vane) {
                (_, true) => Regressor::Vane(line.regressor),
                ("constant", _) => Regressor::Constant,
                ("alpha", _) => Regressor::Alpha,
                ("beta", _) => Regressor::Beta,
                ("p", _) => Regressor::RollRate,
                ("q", _) => Regressor::PitchRate,
                ("r", _) => Regressor::YawRate,
                _ => Regressor::Surface(line.regressor),
            };
            Derivative {
                name: line.name,
                coefficient: line.coefficient,
                regressor,
            }
        };
        let combined = |line: CombinedLine| Combined {
            name: line.name,
            constant: line.constant,
            slope: line.slope,
        };
        Buildup {
            derivatives: file.derivatives.into_iter().map(derivative).collect(),
            biases: file
                .biases
                .into_iter()
                .map(|b| Bias {
                    name: b.name,
                    output: b.output,
                })
                .collect(),
            combined: file.combined.into_iter().map(combined).collect(),
        }
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

/// What differs in a class above an angle of attack.
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
        let overrides = file.overrides.into_iter().map(|line| Overrides {
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
