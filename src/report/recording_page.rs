//! Page of a recording as found: its channels with their evidence, and strip charts of all columns.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use super::notation::{number, well_formed};
use super::strip_chart::{draw_channels, draw_unused};
use crate::inspection::{Channel, Inspection, Role};

/// Values of the template.
#[derive(Debug, Serialize)]
struct RecordingPage<'a> {
    name: &'a str,
    rows: Vec<ChannelRow<'a>>,
    /// Columns without a signal, each with the reason.
    unused: Vec<(&'a str, &'a str)>,
    seconds: String,
    step_s: String,
    stretches: usize,
    motion: String,
    inputs: String,
    others: String,
    columns: String,
}

/// Row of the table of channels.
#[derive(Debug, Serialize)]
struct ChannelRow<'a> {
    column: &'a str,
    signal: &'a str,
    unit: &'a str,
    sign: &'static str,
    low: String,
    high: String,
    is_sure: bool,
    evidence: &'a str,
}

/// Renders the page.
///
/// # Errors
/// An error of the template, with its line.
pub fn recording_page(name: &str, inspection: &Inspection) -> Result<String, String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let of_role = |is_wanted: fn(&Role) -> bool| {
        let channels = inspection.channels.iter().filter(|c| is_wanted(&c.role));
        channels.collect::<Vec<&Channel>>()
    };
    let motion = of_role(|role| *role == Role::Motion);
    let inputs = of_role(|role| matches!(role, Role::Input(_) | Role::Flag));
    let others = of_role(|role| *role == Role::Constant);
    let unused = inspection
        .unused
        .iter()
        .map(|c| (c.column.as_str(), c.reason.as_str()));
    let stretches = &inspection.grid.stretches;
    let samples = stretches.last().map_or(0, |stretch| stretch.end);
    let page = RecordingPage {
        name,
        rows: inspection.channels.iter().map(row).collect(),
        unused: unused.collect(),
        seconds: format!("{:.0}", samples as f64 * inspection.grid.step_s),
        step_s: format!("{:.4}", inspection.step_s),
        stretches: stretches.len(),
        motion: draw_channels(inspection, "motion", &motion),
        inputs: draw_channels(inspection, "inputs", &inputs),
        others: draw_channels(inspection, "others", &others),
        columns: draw_unused(inspection, "columns"),
    };
    environment
        .render_named_str(
            "recording.html",
            include_str!("recording.html"),
            Serde(&page),
        )
        .map(well_formed)
        .map_err(|error| format!("the recording's template: {error:#}"))
}

fn row(channel: &Channel) -> ChannelRow<'_> {
    let written = |value: f64| number(Some(value), 4);
    ChannelRow {
        column: &channel.column,
        signal: &channel.signal,
        unit: &channel.unit,
        sign: if channel.sign < 0.0 { "reversed" } else { "" },
        low: written(channel.range.0),
        high: written(channel.range.1),
        is_sure: channel.is_sure,
        evidence: &channel.evidence,
    }
}
