//! Assessment of a stretch after all of its channels are read: counts, kinematic relations, gusts
//! and instrument errors.

use serde::{Deserialize, Serialize};

use super::assessment_rows::{channel_rows, flight_row};
use super::channel::{ConditionedChannel, Signature};
use super::checks::{FaultReport, LiftPoint, lift_curve};
use super::clock::Stretch;
use super::compatibility::{ErrorEvidence, Findings, OnFault};
use super::conditioned_stretch::ConditionedStretch;
use super::context::Context;
use super::examination::{Examination, RecordReader, RelationResult};
use super::refusal::Refusal;
use super::settings::OnFailedCheck;
use super::table_ends::held_throughout;
use crate::error::Problem;
use crate::flight::{Completion, Correction};
use crate::tables::{ChannelRow, CheckRow, FlightRow, InstrumentRow};

/// Results of ingest for one stretch, besides its record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Assessment {
    /// Times and gusts; `None` for a rejected stretch.
    pub flight: Option<FlightRow>,
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub instruments: Vec<InstrumentRow>,
    /// Evidence of this stretch alone on the errors of its instruments.
    pub error_evidence: Vec<ErrorEvidence>,
    /// Corrections that are applied to signals when the record is read.
    pub corrections: Vec<Correction>,
    /// Stand-ins of the signals that the stretch lacks, and in gaps of others.
    pub completion: Completion,
    pub problems: Vec<Problem>,
    /// Normal force over angle of attack, for the comparison with the tunnel.
    pub lift: Vec<LiftPoint>,
    /// Signature of the samples, by which repeated rows are found.
    pub signature: Signature,
}

/// Assesses a stretch from its conditioned channels. `read` reads signals of its record over a
/// range of samples.
///
/// # Errors
/// A problem that refuses the stretch: a required channel without any number, or a channel that the
/// relations prove wrong.
pub fn assess(
    stretch: &Stretch,
    channels: Vec<ConditionedChannel>,
    context: &Context,
    read: &RecordReader,
) -> Result<Assessment, Problem> {
    let flight_id = stretch.flight_id.as_str();
    let conditioned = ConditionedStretch::of(stretch, channels, context, read)?;
    let examination = Examination {
        clock: &stretch.clock,
        context,
        recorded: conditioned.recorded,
        completion: conditioned.completion,
        read,
    };
    let blocks = examination.blocks(conditioned.block_means);
    let channels = conditioned.channels;
    let held = channels
        .iter()
        .filter_map(|(name, channel, _)| held_throughout(name, channel, &blocks));
    let mut refusals: Vec<Refusal> = held.collect();
    let outcome = examination.examine(blocks);
    refusals.extend(outcome.left_out.iter().map(|one| one.refusal.clone()));
    let (relations, findings) = (&outcome.relations, &outcome.findings);
    let mut problems = conditioned.problems;
    problems.extend(refusals.into_iter().map(|one| one.into_problem(flight_id)));
    problems.extend(impossible_values(relations, context, flight_id)?);
    problems.extend(failed_relations(relations, findings, context, flight_id)?);
    problems.extend(instrument_faults(findings, context, flight_id)?);
    Ok(Assessment {
        flight: Some(flight_row(stretch, &relations.gusts)),
        channels: channel_rows(stretch, context.channels, &channels, &outcome),
        checks: relations.check_rows(flight_id),
        instruments: findings.rows(flight_id),
        error_evidence: findings.evidence(),
        corrections: findings.corrections(&context.settings.compatibility),
        problems,
        lift: lift_curve(&outcome.blocks, context.aircraft, &context.settings.checks),
        completion: outcome.completion,
        signature: conditioned.signature,
    })
}

/// Problems of signals with impossible values.
///
/// # Errors
/// The problem, where failed checks refuse a stretch.
fn impossible_values(
    relations: &RelationResult,
    context: &Context,
    flight_id: &str,
) -> Result<Vec<Problem>, Problem> {
    let found = relations.impossible.iter().map(|one| {
        let refusal = context.refusal(one.signal, one.reason.clone());
        refusal.into_problem(flight_id)
    });
    let found: Vec<Problem> = found.collect();
    let refuses = context.settings.on_failed_check == OnFailedCheck::Refuse;
    if refuses && !found.is_empty() {
        return Err(joined(&found, flight_id));
    }
    Ok(found)
}

/// Problem of the failed relations; `None` if all hold.
///
/// # Errors
/// The problem, where failed checks refuse a stretch.
fn failed_relations(
    relations: &RelationResult,
    findings: &Findings,
    context: &Context,
    flight_id: &str,
) -> Result<Option<Problem>, Problem> {
    let Some(report) = &relations.report else {
        return Ok(None);
    };
    let problem = relation_problem(report, findings, flight_id);
    if context.settings.on_failed_check == OnFailedCheck::Refuse {
        return Err(problem);
    }
    Ok(Some(problem))
}

/// Problems of faulty instruments.
///
/// # Errors
/// The problem, where a fault of a required instrument refuses a stretch.
fn instrument_faults(
    findings: &Findings,
    context: &Context,
    flight_id: &str,
) -> Result<Vec<Problem>, Problem> {
    let faults = findings.problems(flight_id);
    if context.settings.compatibility.fault == OnFault::Refuse && findings.has_required_fault() {
        return Err(joined(&faults, flight_id));
    }
    Ok(faults)
}

/// Problem of the failed relations, with the instrument faults found besides.
fn relation_problem(report: &FaultReport, findings: &Findings, flight_id: &str) -> Problem {
    let besides = findings
        .fault_summary()
        .map(|faults| format!(". Besides, {faults}"))
        .unwrap_or_default();
    let refusal = Refusal {
        place: report.place.clone(),
        reason: format!(
            "{}. Correct the channel map, or leave the flight out{besides}",
            report.reason
        ),
    };
    refusal.into_problem(flight_id)
}

/// One problem that joins the places and reasons of several.
fn joined(problems: &[Problem], flight_id: &str) -> Problem {
    let places: Vec<&str> = problems.iter().map(|p| p.place.as_str()).collect();
    let reasons: Vec<&str> = problems.iter().map(|p| p.reason.as_str()).collect();
    let refusal = Refusal {
        place: places.join(", "),
        reason: reasons.join(". "),
    };
    refusal.into_problem(flight_id)
}
