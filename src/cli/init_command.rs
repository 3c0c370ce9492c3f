//! The command `init`.

use std::process::ExitCode;

use clap::Args;

use crate::inspection::{Channel, Role};
use crate::pipeline::draft;

/// Help below the options.
pub const INIT_HELP: &str = "\
Names and stated units propose which column is which signal; the equations of motion determine unit and sign, and how \
certain they are: attitudes must follow from rates, speeds from accelerations and gravity, climb from the flight path, \
dynamic pressure and Mach number from speed and altitude. The files have a question (FILL_IN) where no recording can \
answer: reference dimensions, positions of sensors, masses that are not recorded. `harvest check NAME` lists what is open.

Examples:
  harvest init mine --from flights/              pipelines/mine and reports/mine/recording.html
  harvest check mine                             the questions that are open

Exit codes: 0 written; 1 not written, the message says why.";

#[derive(Args, Debug)]
pub struct InitOptions {
    /// Name of the pipeline: the folder under pipelines/ that is written
    #[arg(value_name = "NAME", value_parser = name)]
    name: String,
    /// Recordings: a Parquet file, a folder or a glob; may be given again
    #[arg(long, value_name = "FILE_OR_FOLDER", required = true, num_args = 1..)]
    from: Vec<String>,
}

/// Name of a folder as typed.
fn name(typed: &str) -> Result<String, String> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if typed.chars().all(is_plain) && typed.starts_with(|c: char| c.is_ascii_alphabetic()) {
        Ok(typed.to_owned())
    } else {
        Err("it must begin with a letter, and contain only letters, digits, `_` and `-`".to_owned())
    }
}

/// Writes the draft and prints what the recording has.
pub fn init(options: &InitOptions) -> anyhow::Result<ExitCode> {
    let drafted = draft::write(&options.name, &options.from)?;
    let inspection = &drafted.inspection;
    let (read, found) = drafted.files;
    out!(
        "read       {read} of {found} files, {:.4} s from row to row",
        inspection.step_s
    );
    let (sure, unsure): (Vec<&Channel>, Vec<&Channel>) =
        inspection.channels.iter().partition(|c| c.is_sure);
    out!("sure       {}", list(&sure));
    for channel in &unsure {
        let (column, signal) = (&channel.column, &channel.signal);
        out!(
            "not sure   {column}: {signal}, {}: {}",
            described(channel),
            channel.evidence
        );
    }
    for column in &inspection.unused {
        out!("no signal  {}: {}", column.column, column.reason);
    }
    let has_input = |channel: &Channel| {
        matches!(channel.role, Role::Input(_)) && channel.moves && channel.step.is_some()
    };
    if !inspection.channels.iter().any(has_input) {
        out!(
            "no input   no surface or control that steps was found, so there is no maneuver class: give the columns names \
             such as elevator, aileron, rudder, and start again, or write the lines and classes yourself, as in \
             pipelines/navion"
        );
    }
    out!("charts     {}", drafted.page.display());
    out!("pipeline   {}", drafted.folder.display());
    out!(
        "Next: `harvest check {}` lists the values to give.",
        options.name
    );
    Ok(ExitCode::SUCCESS)
}

/// Columns with their signals where the names differ much.
fn list(channels: &[&Channel]) -> String {
    let one = |channel: &&Channel| {
        let sign = if channel.sign < 0.0 { ", reversed" } else { "" };
        match channel.role {
            Role::Time | Role::Motion | Role::Constant => {
                format!("{} is {}{sign}", channel.column, channel.signal)
            }
            _ => format!("{}{sign}", channel.column),
        }
    };
    let names: Vec<String> = channels.iter().map(one).collect();
    names.join("; ")
}

fn described(channel: &Channel) -> String {
    let sign = if channel.sign < 0.0 { ", reversed" } else { "" };
    format!("in {}{sign}", channel.unit)
}
