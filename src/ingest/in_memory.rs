//! Ingest of a flight whose columns are in memory.

use std::collections::BTreeMap;

use super::assessment::{Assessment, assess};
use super::channel::{ChannelPlan, ChannelReader, ConditionedChannel, plan_channels};
use super::clock::{Stretch, survey};
use super::column_source::ColumnSource;
use super::computed_columns::ComputedColumns;
use super::context::Context;
use super::refusal::Refusal;
use super::settings::Settings;
use crate::aircraft::Aircraft;
use crate::error::Problem;
use crate::flight::record::Series;
use crate::flight::stand_in::GapExtent;
use crate::flight::{Channel, Mark, RawFlight, Record};
use crate::tables::{ChannelRow, CheckRow, FlightRow, InstrumentRow};

/// One stretch of a flight after ingest.
#[derive(Clone, Debug, PartialEq)]
pub struct Ingested {
    pub record: Record,
    /// Times and gusts.
    pub flight: Option<FlightRow>,
    /// Repairs of each channel.
    pub channels: Vec<ChannelRow>,
    /// Outcome of each kinematic relation.
    pub checks: Vec<CheckRow>,
    /// Errors of the instruments.
    pub instruments: Vec<InstrumentRow>,
    /// Faults that do not refuse the flight.
    pub problems: Vec<Problem>,
}

/// Ingests the first stretch of a flight that is in memory.
///
/// # Errors
/// A problem that refuses this flight and no other:
///
/// - a clock that cannot be followed,
/// - a unit in the file other than the channel map's,
/// - a required channel that is missing, or that the kinematic relations prove wrong.
pub fn record(
    raw: &RawFlight,
    channels: &BTreeMap<String, Channel>,
    constants: &BTreeMap<String, f64>,
    aircraft: &Aircraft,
    settings: &Settings,
) -> Result<Ingested, Problem> {
    let context = Context {
        channels,
        constants,
        aircraft,
        settings,
    };
    let no_stretch = || Refusal {
        place: String::new(),
        reason: "no stretch".to_owned(),
    };
    records(std::slice::from_ref(raw), &context, usize::MAX)?
        .into_iter()
        .next()
        .unwrap_or_else(|| Err(no_stretch().into_problem(&raw.flight_id)))
}

/// Ingests all stretches of a flight that is in memory, read in pieces of `piece` samples. The
/// problems of the whole flight are the first stretch's.
///
/// # Errors
/// A problem that refuses the whole flight; inside, one that refuses a stretch.
pub fn records(
    files: &[RawFlight],
    context: &Context,
    piece: usize,
) -> Result<Vec<Result<Ingested, Problem>>, Problem> {
    let source = ComputedColumns::of(files, context.channels);
    let (plans, mut problems) = plan_channels(&source, context)?;
    let survey = survey(&source, context.channels, context.settings)?;
    problems.extend(survey.problems);
    let mut records: Vec<Result<Ingested, Problem>> = survey
        .stretches
        .iter()
        .map(|stretch| ingest_stretch(&source, &plans, stretch, context, piece))
        .collect();
    if let Some(Ok(first)) = records.first_mut() {
        first.problems.splice(0..0, problems);
    }
    Ok(records)
}

fn ingest_stretch(
    source: &impl ColumnSource,
    plans: &[ChannelPlan],
    stretch: &Stretch,
    context: &Context,
    piece: usize,
) -> Result<Ingested, Problem> {
    let samples = stretch.clock.samples;
    let mut signals = BTreeMap::new();
    let mut conditioned = Vec::new();
    for plan in plans {
        let (series, channel) = read_whole(source, plan, stretch, context.settings, piece)?;
        signals.insert(plan.channel.signal.clone(), series);
        conditioned.push(channel);
    }
    for (name, &value) in context.constants {
        signals
            .entry(name.clone())
            .or_insert_with(|| Series::assumed(vec![value; samples]));
    }
    let mut record = Record {
        flight_id: stretch.flight_id.clone(),
        start_s: stretch.clock.start_s,
        step_s: stretch.clock.step_s,
        samples,
        signals,
        remaining_errors: BTreeMap::new(),
    };
    let assessment = assess(stretch, conditioned, context, &|signals, range| {
        Some(record.cut(Some(signals), range))
    })?;
    for correction in &assessment.corrections {
        correction.apply(&mut record);
    }
    assessment.completion.apply(&mut record, GapExtent::Samples);
    let Assessment {
        flight,
        channels,
        checks,
        instruments,
        problems,
        ..
    } = assessment;
    Ok(Ingested {
        record,
        flight,
        channels,
        checks,
        instruments,
        problems,
    })
}

/// Reads one channel of a stretch from its first sample to its last.
fn read_whole<'a>(
    source: &impl ColumnSource,
    plan: &ChannelPlan<'a>,
    stretch: &'a Stretch,
    settings: &Settings,
    piece: usize,
) -> Result<(Series, ConditionedChannel<'a>), Problem> {
    let samples = stretch.clock.samples;
    let mut reader = ChannelReader::new(plan, stretch, settings);
    let mut whole = Series::default();
    let mut append = |values: &[f64], marks: &[Mark]| {
        whole.values.extend_from_slice(values);
        whole.marks.extend_from_slice(marks);
        Ok(())
    };
    reader
        .read_until(source, samples, piece.min(samples).max(1), &mut append)
        .map_err(|refusal| refusal.into_problem(&stretch.flight_id))?;
    Ok((whole, reader.finish()))
}
