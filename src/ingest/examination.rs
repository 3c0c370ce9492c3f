//! Examination of a stretch: kinematic relations and flight-path reconstruction reconciled. A channel that
//! is wrong, and that the flight can do without, is left out first.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::checks::{
    BlockAverager, BlockMeans, Check, ENGINE_SIGNALS, FaultReport, FaultyChannel, Gusts,
    ImpossibleSignal, check_relations, confirmed_signals, find_faulty_channels,
    find_time_scale_fault, impossible_centre, impossible_gyration, impossible_mass,
    impossible_signals, impossible_temperature, impossible_velocity, report,
    unusable_engine_signal, unusable_temperature,
};
use super::clock::Clock;
use super::compatibility::{self, Findings};
use super::context::Context;
use super::refusal::Refusal;
use crate::flight::stand_in::GapExtent;
use crate::flight::{Completion, Record, StandIn, signal};
use crate::tables::{ChannelVerdict, CheckRow};

/// Samples of a long record that are read at once, so that memory does not grow with the record.
/// They are under an hour of a usual recorder.
pub const PART_SAMPLES: usize = 1 << 17;

/// Reads signals of a record over a range of its samples; `None` if they cannot be read.
pub type RecordReader<'a> = dyn Fn(&BTreeSet<String>, Range<usize>) -> Option<Record> + Sync + 'a;

/// Inputs of the relation checks and of flight-path reconstruction.
#[derive(Clone)]
pub struct Examination<'a> {
    pub clock: &'a Clock,
    pub context: &'a Context<'a>,
    /// Signals that come from channels.
    pub recorded: Vec<String>,
    pub completion: Completion,
    pub read: &'a RecordReader<'a>,
}

/// Outcome of the examination of one stretch.
pub struct Outcome {
    pub relations: RelationResult,
    pub findings: Findings,
    /// Channels that the stretch does without.
    pub left_out: Vec<ExcludedChannel>,
    /// Stand-ins of the signals that the stretch lacks, with those of the channels that are left out, and
    /// in gaps of others.
    pub completion: Completion,
    /// Block means of the channels that are not left out.
    pub blocks: BlockMeans,
}

impl Outcome {
    /// Verdict on the channel of a signal.
    pub fn verdict(&self, signal: &str) -> ChannelVerdict {
        let mut left_out = self.left_out.iter();
        if let Some(one) = left_out.find(|one| one.signal == signal) {
            return ChannelVerdict::Fault(one.verdict.clone());
        }
        let fault = self.findings.verdict(signal);
        fault.map_or_else(|| self.relations.verdict(signal), ChannelVerdict::Fault)
    }
}

/// A channel that is wrong, and that the stretch does without.
#[derive(Clone)]
pub struct ExcludedChannel {
    signal: String,
    /// Verdict for the table `channels`.
    verdict: String,
    /// Place and reason for the table `problems`.
    pub refusal: Refusal,
}

/// Outcome of the kinematic relations of one stretch.
pub struct RelationResult {
    checks: Vec<Check>,
    pub gusts: Gusts,
    faulty: Vec<FaultyChannel>,
    /// Signals that a relation confirms.
    confirmed: Vec<&'static str>,
    pub report: Option<FaultReport>,
    /// Signals with values that no aircraft has, unless they refuse the flight.
    pub impossible: Vec<ImpossibleSignal>,
}

impl RelationResult {
    pub fn check_rows(&self, flight_id: &str) -> Vec<CheckRow> {
        self.checks.iter().map(|c| c.row(flight_id)).collect()
    }

    fn verdict(&self, signal: &str) -> ChannelVerdict {
        if let Some(one) = self.impossible.iter().find(|one| one.signal == signal) {
            return ChannelVerdict::Fault(one.reason.clone());
        }
        match self.faulty.iter().find(|f| f.signal == signal) {
            Some(fault) => ChannelVerdict::Fault(fault.verdict()),
            None if self.confirmed.contains(&signal) => ChannelVerdict::Ok,
            None => ChannelVerdict::NotChecked,
        }
    }

    /// Adds the checks that only an examination with more signals has.
    fn with_checks_before(&mut self, before: Vec<Check>) {
        let mut own = std::mem::take(&mut self.checks).into_iter().peekable();
        for check in before {
            let is_own = |own: &Check| own.relation.name == check.relation.name;
            self.checks.push(own.next_if(is_own).unwrap_or(check));
        }
        self.checks.extend(own);
    }
}

impl Examination<'_> {
    /// Block means of the recorded signals and of the constants.
    pub fn blocks(&self, mut means: BTreeMap<String, BlockAverager>) -> BlockMeans {
        let (clock, checks) = (self.clock, &self.context.settings.checks);
        for (signal, value) in self.context.constants {
            let constant =
                BlockAverager::constant(signal, *value, clock.samples, clock.step_s, checks);
            if let Some(constant) = constant {
                means.entry(signal.clone()).or_insert(constant);
            }
        }
        BlockMeans::of(means, clock.samples, clock.step_s, checks)
    }

    /// Examines the stretch. Wrong channels that it can do without are left out one after another,
    /// and the others are examined as if these were not recorded.
    pub fn examine(&self, blocks: BlockMeans) -> Outcome {
        let outside_relations = self.unusable_outside_relations(&blocks);
        if !outside_relations.is_empty() {
            return self.examine_without(outside_relations, &blocks, Vec::new());
        }
        let relations = self.check(&blocks);
        // A late altimeter is corrected by its delay, which the reconstruction finds.
        let may_be_late = relations
            .faulty
            .iter()
            .any(|f| f.signal == signal::ALTITUDE);
        if !may_be_late && self.has_only_dispensable_faults(&relations) {
            let left_out = self.dispensable_faults(&relations);
            return self.examine_without(left_out, &blocks, relations.checks);
        }
        let (mut relations, findings) = self.reconcile(&blocks, relations);
        if self.has_only_dispensable_faults(&relations)
            || self.holds_without_dispensable(&relations, &blocks)
        {
            let left_out = self.dispensable_faults(&relations);
            return self.examine_without(left_out, &blocks, relations.checks);
        }
        let inexplicable = self.inexplicable(&findings);
        if !inexplicable.is_empty() {
            return self.examine_without(inexplicable, &blocks, relations.checks);
        }
        if relations.impossible.is_empty() {
            relations.impossible = self.impossible(&blocks, &relations.faulty);
        }
        Outcome {
            relations,
            findings,
            left_out: Vec::new(),
            completion: self.completion.clone(),
            blocks,
        }
    }

    /// Examines the stretch without some channels. `checks` are those with these channels.
    fn examine_without(
        &self,
        left_out: Vec<ExcludedChannel>,
        blocks: &BlockMeans,
        checks: Vec<Check>,
    ) -> Outcome {
        let is_left_out = |name: &str| left_out.iter().any(|one| one.signal == name);
        let others = self.without(&is_left_out);
        let mut outcome = others.examine(blocks.without(is_left_out));
        outcome.relations.with_checks_before(checks);
        outcome.left_out.splice(0..0, left_out);
        outcome
    }

    /// This examination as if some signals were not recorded.
    fn without(&self, left_out: &dyn Fn(&str) -> bool) -> Self {
        let stays = |signal: &&String| !left_out(signal);
        let recorded: Vec<String> = self.recorded.iter().filter(stays).cloned().collect();
        let removed = self.recorded.iter().filter(|signal| left_out(signal));
        let removed = removed.map(|signal| (signal.clone(), StandIn::Absent));
        let is_recorded = |signal: &str| recorded.iter().any(|name| name == signal);
        // The signals that are left out have a stand-in, or none reads them.
        let stand_ins = self.context.stand_ins(is_recorded).unwrap_or_default();
        let before = self.completion.stand_ins.iter().cloned();
        let mut absent: Vec<(String, StandIn)> =
            before.filter(|(_, s)| *s == StandIn::Absent).collect();
        absent.extend(removed);
        let mut gaps = self.completion.gaps.clone();
        gaps.retain(|(signal, _)| !left_out(signal));
        Examination {
            completion: Completion {
                stand_ins: absent.into_iter().chain(stand_ins).collect(),
                gaps,
            },
            recorded,
            ..self.clone()
        }
    }

    /// Channels in no relation whose values cannot be used, to be left out.
    fn unusable_outside_relations(&self, blocks: &BlockMeans) -> Vec<ExcludedChannel> {
        let temperature =
            unusable_temperature(blocks).map(|reason| (signal::AIR_TEMPERATURE, reason));
        let engines = ENGINE_SIGNALS.iter();
        let engines =
            engines.filter_map(|name| Some((*name, unusable_engine_signal(blocks, name)?)));
        let found = temperature.into_iter().chain(engines);
        let recorded = found.filter(|(name, _)| self.is_recorded(name));
        let left_out = recorded.map(|(name, reason)| self.leave_out_for(name, reason));
        left_out.collect()
    }

    /// `true` for a signal that the stretch can do without.
    fn can_do_without(&self, signal: &str) -> bool {
        let is_other = |name: &str| name != signal && self.is_recorded(name);
        self.context.can_do_without(signal, is_other)
    }

    /// `true` for a faulty channel that the stretch can do without.
    fn is_dispensable(&self, fault: &FaultyChannel) -> bool {
        self.can_do_without(&fault.signal)
    }

    /// `true` if channels are faulty, and the stretch can do without all of them.
    fn has_only_dispensable_faults(&self, relations: &RelationResult) -> bool {
        let faulty = &relations.faulty;
        !faulty.is_empty() && faulty.iter().all(|fault| self.is_dispensable(fault))
    }

    /// `true` if three conditions hold:
    /// 1. no sign or unit of a suspect explains the failed relations;
    /// 2. without the suspects that the stretch can do without, all other relations hold;
    /// 3. these relations confirm the remaining suspects.
    fn holds_without_dispensable(&self, relations: &RelationResult, blocks: &BlockMeans) -> bool {
        let faulty = &relations.faulty;
        let dispensable: Vec<&FaultyChannel> =
            faulty.iter().filter(|f| self.is_dispensable(f)).collect();
        if dispensable.is_empty() || faulty.iter().any(|f| f.cause.is_some()) {
            return false;
        }
        let is_left_out = |name: &str| dispensable.iter().any(|fault| fault.signal == name);
        let others = self.without(&is_left_out);
        let checked = others.check(&blocks.without(is_left_out));
        let is_cleared = |fault: &FaultyChannel| {
            is_left_out(&fault.signal) || checked.confirmed.contains(&fault.signal.as_str())
        };
        checked.report.is_none() && checked.impossible.is_empty() && faulty.iter().all(is_cleared)
    }

    /// Faulty channels that the stretch can do without, to be left out.
    fn dispensable_faults(&self, relations: &RelationResult) -> Vec<ExcludedChannel> {
        let report = relations.report.as_ref();
        let reason = report.map_or_else(String::new, |report| report.reason.clone());
        let leave_out = |fault: &FaultyChannel| {
            let refusal = Refusal::of_channel(&fault.channel, reason.clone());
            self.leave_out(&fault.signal, fault.verdict(), refusal)
        };
        let dispensable = relations.faulty.iter().filter(|f| self.is_dispensable(f));
        dispensable.map(leave_out).collect()
    }

    /// Channels whose values no error of an instrument explains and that the stretch can do without.
    fn inexplicable(&self, findings: &Findings) -> Vec<ExcludedChannel> {
        let inexplicable = findings.inexplicable();
        let dispensable = inexplicable.filter(|(name, _)| self.can_do_without(name));
        let left_out = dispensable.map(|(name, fault)| self.leave_out_for(name, fault));
        left_out.collect()
    }

    /// A channel that is left out for a reason that is also its verdict.
    fn leave_out_for(&self, name: &str, reason: String) -> ExcludedChannel {
        let verdict = reason.clone();
        self.leave_out(name, verdict, self.context.refusal(name, reason))
    }

    /// A channel that is left out, with its stand-in and the cost.
    fn leave_out(&self, name: &str, verdict: String, refusal: Refusal) -> ExcludedChannel {
        let stand_ins = self.without(&|other| other == name).completion.stand_ins;
        let refusal = Refusal {
            reason: format!("{}. The channel is left out", refusal.reason),
            ..refusal
        };
        ExcludedChannel {
            signal: name.to_owned(),
            verdict,
            refusal: refusal.with_stand_in(name, &stand_ins),
        }
    }

    fn is_recorded(&self, signal: &str) -> bool {
        self.recorded.iter().any(|name| name == signal)
    }

    /// Reconciles the relations between channels with the errors of the instruments.
    ///
    /// If a channel has a wrong sign or unit, the errors of the other instruments are estimated
    /// with the channel corrected. The record keeps the channel as recorded. If no sign and no unit
    /// explains a failed relation, a delay may. If the relation holds with the delays removed, the
    /// delay is the fault.
    fn reconcile(
        &self,
        blocks: &BlockMeans,
        relations: RelationResult,
    ) -> (RelationResult, Findings) {
        if !relations.impossible.is_empty() {
            return (relations, Findings::default());
        }
        let faulty = &relations.faulty;
        if !faulty.is_empty() && faulty.iter().all(FaultyChannel::is_correctable) {
            let findings = self.reconstruct(|record| correct_by_factors(record, faulty));
            return (relations, findings.without_corrections());
        }
        // With a dead channel or with one fault among several there is nothing to go by.
        if faulty.iter().any(|f| f.cause.is_some()) {
            return (relations, Findings::default());
        }
        let findings = self.reconstruct(|_| ());
        if relations.report.is_none() {
            return (relations, findings);
        }
        if findings.has_fault() {
            let compatibility = &self.context.settings.compatibility;
            let corrected =
                blocks.corrected(&findings.with_faults_corrected().corrections(compatibility));
            let again = self.check(&corrected);
            if again.report.is_none() {
                return (again, findings);
            }
        }
        // A vane at another place may be why the relation fails.
        if findings.has_moved_vane() {
            return (relations, findings.without_corrections());
        }
        (relations, Findings::default())
    }

    /// Finds signals with values that no aircraft has. The mass is checked only if no relation
    /// finds a fault in the other signals of the lift.
    fn impossible(&self, blocks: &BlockMeans, faulty: &[FaultyChannel]) -> Vec<ImpossibleSignal> {
        const LIFT: [&str; 4] = [
            signal::AN,
            signal::ALPHA_VANE,
            signal::QBAR,
            signal::VELOCITY,
        ];
        let Context {
            channels,
            aircraft,
            settings,
            ..
        } = *self.context;
        let mut found = impossible_signals(blocks);
        found.extend(impossible_centre(blocks, aircraft));
        found.extend(impossible_velocity(blocks, &settings.checks));
        found.extend(impossible_temperature(blocks));
        if !found.is_empty() || faulty.iter().any(|f| LIFT.contains(&f.signal.as_str())) {
            return found;
        }
        let mass = channels.values().find(|c| c.signal == signal::MASS);
        let unit = mass.map(|channel| channel.unit.as_str());
        impossible_mass(blocks, aircraft, unit, &settings.checks)
            .or_else(|| impossible_gyration(blocks, aircraft))
            .into_iter()
            .collect()
    }

    /// Checks the kinematic relations and isolates the faulty channels. A wrong time fails the
    /// relations of every channel; no channel is then named.
    fn check(&self, blocks: &BlockMeans) -> RelationResult {
        let Context {
            channels,
            aircraft,
            settings,
            ..
        } = *self.context;
        let (checks, gusts) = check_relations(blocks, aircraft, &settings.checks);
        if let Some(time) = find_time_scale_fault(&checks) {
            return RelationResult {
                confirmed: Vec::new(),
                report: None,
                checks,
                gusts,
                faulty: Vec::new(),
                impossible: vec![time],
            };
        }
        let faulty = find_faulty_channels(
            blocks,
            &checks,
            channels,
            &self.recorded,
            aircraft,
            &settings.checks,
        );
        RelationResult {
            confirmed: confirmed_signals(&checks),
            report: report(&faulty, &checks),
            checks,
            gusts,
            faulty,
            impossible: Vec::new(),
        }
    }

    /// Estimates the instruments' errors by flight-path reconstruction, from the parts of the
    /// record, each after `correct`.
    fn reconstruct(&self, correct: impl Fn(&mut Record) + Sync + Send) -> Findings {
        let samples = self.clock.samples;
        let count = samples.div_ceil(PART_SAMPLES);
        let signals = compatibility::signals();
        let read = |part: usize| {
            let range = part * PART_SAMPLES..((part + 1) * PART_SAMPLES).min(samples);
            let mut record = (self.read)(&signals, range)?;
            self.completion.apply(&mut record, GapExtent::Samples);
            correct(&mut record);
            Some(record)
        };
        compatibility::examine(
            (count, read),
            self.context.channels,
            &self.recorded,
            self.context.aircraft,
            &self.context.settings.compatibility,
        )
    }
}

/// Multiplies the signals of faulty channels by the factors that correct them.
fn correct_by_factors(record: &mut Record, faulty: &[FaultyChannel]) {
    for fault in faulty {
        let series = record.signals.get_mut(&fault.signal);
        if let (Some(factor), Some(series)) = (fault.factor, series) {
            series.values.iter_mut().for_each(|v| *v *= factor);
        }
    }
}
