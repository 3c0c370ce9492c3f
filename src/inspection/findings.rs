//! Findings of an inspection: each column with its signal, unit and sign, and their certainty.

use super::controls::inputs::InputColumn;
use super::grid::Grid;
use super::names::mirror_images::MirrorImages;

/// Use of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    Time,
    Motion,
    /// Surface or pilot control.
    Input(InputColumn),
    /// Column with no values but zero and one.
    Flag,
    /// Mass, inertias, centre of gravity, engines, temperature of the air.
    Constant,
}

/// A column with the signal that it gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    pub column: String,
    pub signal: String,
    pub unit: String,
    pub sign: f64,
    /// Period of a heading, in the unit recorded.
    pub wraps_at: Option<f64>,
    pub role: Role,
    pub is_sure: bool,
    pub evidence: String,
    /// Range of the values as recorded.
    pub range: (f64, f64),
    /// `true` for an input that moves in the recording.
    pub moves: bool,
    /// Size of a step of an input, in the signal's unit; `None` if it only follows feedback.
    pub step: Option<f64>,
    /// Columns whose half difference it is proposed to be.
    pub mirror_images: Option<MirrorImages>,
}

/// A column that gives no signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Unused {
    pub column: String,
    pub unit: Option<String>,
    pub reason: String,
}

/// Findings about a set of recordings.
#[derive(Clone, Debug, Default)]
pub struct Inspection {
    /// Channels in the order of the signals.
    pub channels: Vec<Channel>,
    pub unused: Vec<Unused>,
    /// Recordings on one step, for charts.
    pub grid: Grid,
    /// Median step between samples, s.
    pub step_s: f64,
}
