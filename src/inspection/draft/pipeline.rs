//! `pipeline.yaml` of a draft.

use std::fmt::Write;

use super::contents::{Draft, scalar};
use crate::inspection::findings::{Channel, Role};

/// Words by which the flag of an on-board excitation system is known.
const EXCITATION: [&str; 6] = ["obes", "excitation", "excit", "fti", "pti", "inject"];

/// Text of the file.
pub fn text(draft: &Draft) -> String {
    let (name, archive) = (draft.name, scalar(draft.archive));
    let title = scalar(&format!("{name} stability and control derivatives"));
    let segment = segment(draft);
    format!(
        "\
# Settings of the campaign, drafted by `harvest init`. Paths are relative to the folder harvest is run in. Keys that are not
# given have defaults; docs/settings.md lists all keys with the effect of a change.
title: {title}
archive: {archive} # a folder, a glob, or a tree partitioned as flight=…/
# wind_tunnel: tunnel.csv # derivative, alpha_deg, value, unit; without it nothing is held or compared
# events: events.csv # flight_id, class, start_s, end_s of maneuvers that you have marked

{segment}
estimate:
  method: filter_error # gusts are estimated with the derivatives; output_error: still air

trend:
  groups:
    - {{ name: all }}
"
    )
}

/// Line of the flag of an on-board excitation system.
fn excitation_flag(draft: &Draft) -> String {
    let is_flag = |c: &&Channel| c.role == Role::Flag;
    let flags = draft.inspection.channels.iter().filter(is_flag);
    let flag = flags
        .map(|c| c.signal.as_str())
        .find(|signal| EXCITATION.iter().any(|word| signal.contains(word)));
    match flag {
        Some(flag) => format!(
            "  excitation_flag: {flag} # up while the on-board system moves the surfaces: is it this one?\n"
        ),
        None => {
            "  # excitation_flag: … # flag that is up while an on-board system moves the surfaces\n"
                .to_owned()
        }
    }
}

/// Search for maneuvers: flag, pilot controls, sizes of steps.
fn segment(draft: &Draft) -> String {
    let mut text = "\
# Search for maneuvers. A step is a lasting change within about a quarter of a second, of at least the size given here, in
# the unit of the signal's name. The sizes are a fifth of the quickest changes in the recording: compare them with the
# strip charts.
segment:
"
    .to_owned();
    text += &excitation_flag(draft);
    let steps: Vec<_> = draft
        .inputs()
        .filter_map(|(c, i)| Some((c, i, c.step?)))
        .collect();
    let controls = steps
        .iter()
        .filter(|(_, input, _)| !input.kind.is_surface());
    let controls: Vec<&str> = controls.map(|(c, _, _)| c.signal.as_str()).collect();
    if !controls.is_empty() {
        let _ = writeln!(text, "  pilot_controls: [{}]", controls.join(", "));
    }
    text += "  steps:";
    if steps.is_empty() {
        text += " {}";
    }
    text.push('\n');
    for (channel, _, step) in steps {
        let _ = writeln!(text, "    {}: {step}", channel.signal);
    }
    let resting = draft.inputs().filter(|(channel, _)| channel.step.is_none());
    let resting: Vec<&str> = resting.map(|(c, _)| c.signal.as_str()).collect();
    if !resting.is_empty() {
        let _ = writeln!(
            text,
            "    # no step: {}. They change as little as feedback or noise does: give one a size, and a class in maneuvers/, if\n    # it is flown.",
            resting.join(", ")
        );
    }
    text
}
