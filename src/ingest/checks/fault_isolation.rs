//! Fault isolation: the channel whose correction by a sign or a unit makes all failed relations
//! hold.
//!
//! A faulty channel fails every relation that contains it, so the failed relations alone name too
//! many channels. Each channel of the failed relations is tried with a reversed sign, in each unit
//! in which it could have been recorded, and converted twice. If every relation holds after a
//! trial, the trial names the channel and the cause. If there is no such trial, the channels that
//! the failed relations share and no other relation confirms are named without a cause.

use std::collections::{BTreeMap, BTreeSet};

use super::agreement::{Check, check_relations, confirmed_signals};
use super::block_means::BlockMeans;
use super::relations::{self, GustEffect};
use crate::aircraft::Aircraft;
use crate::flight::{Channel, signal};
use crate::ingest::settings::Checks;
use crate::tables::CheckVerdict;
use crate::units::Unit;

/// Ratio of squared misfits up to which another channel's trial explains the failure as well as the
/// best trial. Residual noise makes equally good explanations differ by less.
const EQUAL_MISFIT: f64 = 3.0;

/// Largest number of independent faults searched for in one flight. Trade-off: each costs a round of trials, and
/// fails several relations, so that after three few are left to confirm a fourth. Channels of further faults are
/// named without a cause.
const MOST_FAULTS: usize = 3;

/// Relative difference below which two units are the same for a trial: no conversion is so close
/// to one.
const SAME_UNIT: f64 = 1e-6;

/// A channel that fails its checks.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultyChannel {
    pub channel: String,
    pub signal: String,
    /// Probable cause, where a correction makes the relations hold.
    pub cause: Option<String>,
    /// Factor by which the signal is corrected.
    pub factor: Option<f64>,
    /// `false` if other channels explain the failed relations as well.
    pub is_unique: bool,
}

impl FaultyChannel {
    /// `true` if this channel alone explains the failed relations and a factor corrects it.
    pub fn is_correctable(&self) -> bool {
        self.is_unique && self.factor.is_some()
    }

    /// Verdict for the table `channels`.
    pub fn verdict(&self) -> String {
        let cause = self
            .cause
            .as_deref()
            .unwrap_or("does not agree with the other channels");
        if self.is_unique {
            cause.to_owned()
        } else {
            format!("suspect: {cause}")
        }
    }
}

/// Failed checks and faulty channels of a flight in words.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultReport {
    pub place: String,
    pub reason: String,
}

/// Finds the channels that make relations fail; `recorded` are the signals that come from channels.
pub fn find_faulty_channels(
    blocks: &BlockMeans,
    checks: &[Check],
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
    aircraft: &Aircraft,
    settings: &Checks,
) -> Vec<FaultyChannel> {
    let isolation = Isolation {
        channels,
        recorded,
        aircraft,
        settings,
    };
    let dead = isolation.dead_channels(blocks, checks);
    if dead.is_empty() {
        isolation.find_by_trial(blocks.clone(), checks.to_vec())
    } else {
        dead
    }
}

/// Inputs of fault isolation that no trial changes.
struct Isolation<'a> {
    channels: &'a BTreeMap<String, Channel>,
    /// Signals that come from channels.
    recorded: &'a [String],
    aircraft: &'a Aircraft,
    settings: &'a Checks,
}

impl<'a> Isolation<'a> {
    /// Channels that never change: throughout the flight, or in a failed relation that they
    /// dominate.
    fn dead_channels(&self, blocks: &BlockMeans, checks: &[Check]) -> Vec<FaultyChannel> {
        let constant = self.constant_instruments(blocks);
        let is_dead = |signal: &str| {
            constant.contains(&signal)
                || failed(checks).any(|check| {
                    check.relation.dominant().contains(&signal)
                        && blocks.is_constant(signal)
                        && check
                            .relation
                            .signals
                            .iter()
                            .any(|s| !blocks.is_constant(s))
                })
        };
        self.faulty_where(blocks, is_dead)
    }

    /// Instruments that never change while the aircraft flies and most of the others do. The
    /// relations that need them may not be excited without them.
    fn constant_instruments(&self, blocks: &BlockMeans) -> Vec<&'static str> {
        let instruments: BTreeSet<&'static str> = relations::all(self.settings)
            .iter()
            .flat_map(|r| r.dominant().iter().copied())
            .collect();
        let (constant, changing): (Vec<&str>, Vec<&str>) = instruments
            .iter()
            .filter(|signal| self.is_recorded(signal))
            .partition(|signal| blocks.is_constant(signal));
        let is_long = blocks.count as f64 * blocks.block_s >= self.settings.dead_s;
        let is_evidence = is_long
            && changing.len() > constant.len()
            && blocks.is_flying_faster_than(self.settings.least_velocity_ft_s);
        if is_evidence { constant } else { Vec::new() }
    }

    /// Corrects one channel after another by the trial that leaves the fewest relations failed,
    /// until all hold. A channel is corrected and named once.
    fn find_by_trial(&self, mut blocks: BlockMeans, mut checks: Vec<Check>) -> Vec<FaultyChannel> {
        let mut faulty: Vec<FaultyChannel> = Vec::new();
        let is_named = |faulty: &[FaultyChannel], name: &str| {
            faulty.iter().any(|channel| channel.channel == name)
        };
        for _ in 0..MOST_FAULTS {
            if failed(&checks).next().is_none() {
                return faulty;
            }
            let mut trials = self.trials(&blocks, &checks);
            trials.retain(|trial| !is_named(&faulty, trial.name));
            let best = trials.first();
            let Some(best) = best.filter(|t| t.failures < failures(&checks, &checks)) else {
                break;
            };
            if best.failures == 0 {
                faulty.extend(equally_good(best, &trials));
                return faulty;
            }
            faulty.push(best.faulty_channel(true));
            blocks = blocks.with(&best.channel.signal, best.factor);
            checks.clone_from(&best.checks);
        }
        let mut common = self.common_channels(&checks, &blocks);
        common.retain(|channel| !is_named(&faulty, &channel.channel));
        faulty.extend(common);
        faulty
    }

    /// Tries every correction of every suspect channel; the best trial first.
    fn trials(&self, blocks: &BlockMeans, before: &[Check]) -> Vec<Trial<'a>> {
        let mut trials = Vec::new();
        for (name, channel) in self.suspects(before) {
            for (factor, cause) in corrections(channel) {
                let corrected = blocks.with(&channel.signal, factor);
                let (checks, _) = check_relations(&corrected, self.aircraft, self.settings);
                trials.push(Trial {
                    name,
                    channel,
                    factor,
                    cause,
                    failures: failures(&checks, before),
                    misfit: squared_misfit(&checks),
                    checks,
                });
            }
        }
        trials.sort_by(|a, b| {
            let by_failures = a.failures.cmp(&b.failures);
            by_failures.then(a.misfit.total_cmp(&b.misfit))
        });
        trials
    }

    /// Recorded channels in a failed relation. The mass is not suspected. It occurs in one relation
    /// only, so that its fault could not be distinguished from one of the accelerometer in that
    /// relation.
    fn suspects(&self, checks: &[Check]) -> Vec<(&'a str, &'a Channel)> {
        let is_suspect = |name: &str| {
            name != signal::MASS
                && self.is_recorded(name)
                && failed(checks).any(|check| check.relation.signals.contains(&name))
        };
        let suspects = self.channels.iter().filter(|(_, c)| is_suspect(&c.signal));
        suspects.map(|(name, c)| (name.as_str(), c)).collect()
    }

    /// Channels that all failed relations share, except those that another relation confirms. If
    /// the failed relations share none, every unconfirmed channel that dominates one of them.
    fn common_channels(&self, checks: &[Check], blocks: &BlockMeans) -> Vec<FaultyChannel> {
        let confirmed = confirmed_signals(checks);
        let is_unconfirmed = |s: &str| !confirmed.contains(&s);
        let is_shared = |s: &str| failed(checks).all(|c| c.relation.signals.contains(&s));
        let dominates = |s: &str| failed(checks).any(|c| c.relation.dominant().contains(&s));
        let criteria: [&dyn Fn(&str) -> bool; 4] = [
            &|s| is_shared(s) && dominates(s) && is_unconfirmed(s),
            &|s| is_shared(s) && is_unconfirmed(s),
            &|s| dominates(s) && is_unconfirmed(s),
            &|s| dominates(s),
        ];
        criteria
            .iter()
            .map(|criterion| self.faulty_where(blocks, criterion))
            .find(|faulty| !faulty.is_empty())
            .unwrap_or_default()
    }

    /// Recorded channels whose signals meet a criterion, named together.
    fn faulty_where(
        &self,
        blocks: &BlockMeans,
        criterion: impl Fn(&str) -> bool,
    ) -> Vec<FaultyChannel> {
        let found: Vec<(&String, &Channel)> = self
            .channels
            .iter()
            .filter(|(_, c)| self.is_recorded(&c.signal) && criterion(&c.signal))
            .collect();
        let is_unique = found.len() == 1;
        let faulty = found.into_iter().map(|(name, channel)| FaultyChannel {
            channel: name.clone(),
            signal: channel.signal.clone(),
            cause: blocks
                .is_constant(&channel.signal)
                .then(|| "it never changes".to_owned()),
            factor: None,
            is_unique,
        });
        faulty.collect()
    }

    fn is_recorded(&self, signal: &str) -> bool {
        self.recorded.iter().any(|s| s == signal)
    }
}

fn failed(checks: &[Check]) -> impl Iterator<Item = &Check> {
    checks.iter().filter(|check| !check.verdict.passed())
}

/// One channel corrected in one way.
struct Trial<'a> {
    name: &'a str,
    channel: &'a Channel,
    factor: f64,
    cause: String,
    failures: usize,
    misfit: f64,
    checks: Vec<Check>,
}

impl Trial<'_> {
    fn faulty_channel(&self, is_unique: bool) -> FaultyChannel {
        FaultyChannel {
            channel: self.name.to_owned(),
            signal: self.channel.signal.clone(),
            cause: Some(self.cause.clone()),
            factor: Some(self.factor),
            is_unique,
        }
    }

    /// Number of windows in which the record would have to jump.
    fn jumps(&self) -> usize {
        self.checks.iter().map(|c| c.jumps).sum()
    }
}

/// Candidate correction factors of a channel (reversed sign, mistaken unit, both), each with the
/// fault that it would correct.
fn corrections(channel: &Channel) -> Vec<(f64, String)> {
    let mut corrections = vec![(-1.0, "its sign is reversed".to_owned())];
    let Ok(mapped) = Unit::parse(&channel.unit) else {
        return corrections;
    };
    for other in mapped.alike().filter(|unit| !unit.is_rare) {
        let factor = other.factor_to(mapped);
        let Some(factor) = factor.filter(|f| (f - 1.0).abs() > SAME_UNIT) else {
            continue;
        };
        let (was, is) = (other.name, mapped.name);
        let recorded = format!("it is recorded in {was}, not in {is}");
        let twice = format!("it is converted from {was} to {is} once too often");
        corrections.push((-factor, format!("{recorded}, and its sign is reversed")));
        corrections.push((-1.0 / factor, format!("{twice}, and its sign is reversed")));
        corrections.push((factor, recorded));
        corrections.push((1.0 / factor, twice));
    }
    corrections
}

/// Number of relations that fail, or that were excited before and no longer are.
fn failures(checks: &[Check], before: &[Check]) -> usize {
    // A faulty channel may look like gusts, so one that gusts excite may fall silent.
    let is_silenced = |c: &Check, b: &Check| {
        c.relation.gusts != GustEffect::Excite
            && c.verdict == CheckVerdict::NotExcited
            && b.verdict != CheckVerdict::NotExcited
    };
    checks
        .iter()
        .zip(before)
        .filter(|(c, b)| !c.verdict.passed() || is_silenced(c, b))
        .count()
}

/// Sum of the squared misfits of the excited relations.
fn squared_misfit(checks: &[Check]) -> f64 {
    let excited = checks
        .iter()
        .filter(|c| c.verdict != CheckVerdict::NotExcited);
    excited
        .filter_map(|c| c.fit)
        .map(|f| f.misfit.powi(2))
        .sum()
}

/// The best trial, and the best trial of each other channel that explains the failure equally well. Such a trial
/// has as small a misfit, and as few windows in which the record would have to jump.
fn equally_good(best: &Trial, trials: &[Trial]) -> Vec<FaultyChannel> {
    let mut chosen: Vec<&Trial> = Vec::new();
    for trial in trials {
        let is_as_good = trial.failures == 0
            && trial.misfit <= EQUAL_MISFIT * best.misfit
            && trial.jumps() <= best.jumps();
        if is_as_good && !chosen.iter().any(|c| c.name == trial.name) {
            chosen.push(trial);
        }
    }
    let is_unique = chosen.len() == 1;
    chosen
        .into_iter()
        .map(|t| t.faulty_channel(is_unique))
        .collect()
}

/// Reports the failed checks and the faulty channels in words; `None` if there are neither.
pub fn report(faulty: &[FaultyChannel], checks: &[Check]) -> Option<FaultReport> {
    let failures: Vec<String> = failed(checks).map(describe).collect();
    if failures.is_empty() && faulty.is_empty() {
        return None;
    }
    let names: Vec<String> = faulty.iter().map(|f| format!("`{}`", f.channel)).collect();
    let is_one = names.len() == 1;
    let names = names.join(", ");
    let several = if faulty.iter().any(|f| !f.is_unique) {
        "one of these is wrong: "
    } else {
        ""
    };
    let disagreement = if failures.is_empty() {
        let have = if is_one { "has" } else { "have" };
        format!("{names} {have} one value throughout, while the aircraft flies")
    } else {
        let do_not = if is_one { "does not" } else { "do not" };
        let failures = failures.join("; ");
        format!("{names} {do_not} agree with the other channels ({failures})")
    };
    let cause = likely_cause(faulty);
    Some(FaultReport {
        place: format!("{} {names}", if is_one { "channel" } else { "channels" }),
        reason: format!("{several}{disagreement}; {cause}"),
    })
}

fn likely_cause(faulty: &[FaultyChannel]) -> String {
    let causes: Vec<String> = faulty
        .iter()
        .filter_map(|f| Some(format!("`{}`: {}", f.channel, f.cause.as_ref()?)))
        .collect();
    if causes.is_empty() {
        "no sign and no unit would set it right".to_owned()
    } else {
        format!("likely {}", causes.join(", or "))
    }
}

fn describe(check: &Check) -> String {
    let (name, verdict) = (check.relation.name, check.verdict);
    match check.fit {
        Some(fit) => format!("{name}: slope {:.3}, {verdict}", fit.slope),
        None => format!("{name}: {verdict}"),
    }
}
