//! Which channel is wrong when relations fail: the one whose correction by a sign or a unit makes
//! all of them hold.
//!
//! A wrong channel spoils every relation it is in, so the failed relations alone name too many.
//! Each channel in them is tried with a reversed sign, with each unit that it could have been
//! recorded in, and with a conversion done twice; the trial after which every relation holds names
//! the channel and the cause. Where none does, the channels common to the failed relations and
//! confirmed by no other are named without a cause.

use std::collections::{BTreeMap, BTreeSet};

use super::agreement::{Check, check_relations, confirmed_signals};
use super::block_means::BlockMeans;
use super::relations;
use crate::aircraft::Aircraft;
use crate::flight::{Channel, signal};
use crate::ingest::settings::Checks;
use crate::tables::CheckVerdict;
use crate::units::Unit;

/// A channel that fails its checks.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultyChannel {
    pub channel: String,
    pub signal: String,
    /// What is probably wrong with it, where a correction makes the relations hold.
    pub cause: Option<String>,
    /// What the signal is to be multiplied by to set it right.
    pub factor: Option<f64>,
    /// Whether others explain the failed relations as well.
    pub alone: bool,
}

impl FaultyChannel {
    /// `true` where this channel alone explains the failed relations and a factor corrects it.
    pub fn is_correctable(&self) -> bool {
        self.alone && self.factor.is_some()
    }

    /// CheckVerdict for the table `channels`.
    pub fn verdict(&self) -> String {
        let cause = self
            .cause
            .as_deref()
            .unwrap_or("does not agree with the other channels");
        if self.alone {
            cause.to_owned()
        } else {
            format!("suspect: {cause}")
        }
    }
}

/// The accused channels of a flight in words.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultReport {
    pub place: String,
    pub reason: String,
    /// Whether an accused channel is one that the equations cannot do without.
    pub required: bool,
}

/// Trials whose squared misfit is within this factor of the best explain the failure as well as it
/// does.
const AS_GOOD: f64 = 3.0;

/// More independent faults than this are not looked for in one flight.
const FAULTS: usize = 3;

/// The channels that make relations fail; `recorded` are the signals that come from channels.
pub fn find_faulty_channels(
    blocks: &BlockMeans,
    found: &[Check],
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
    aircraft: &Aircraft,
    settings: &Checks,
) -> Vec<FaultyChannel> {
    let still = still(blocks, recorded, settings);
    let dead = |s: &str| {
        still.contains(&s)
            || found.iter().any(|c| {
                !c.verdict.passed() && c.relation.dominant().contains(&s) && is_dead(s, c, blocks)
            })
    };
    let mut guilty = accused(channels, recorded, blocks, &dead);
    if !guilty.is_empty() {
        return guilty;
    }
    let (mut blocks, mut found) = (blocks.clone(), found.to_vec());
    for _ in 0..FAULTS {
        if !found.iter().any(|c| !c.verdict.passed()) {
            return guilty;
        }
        let mut trials = Vec::new();
        for (name, channel) in suspects(&found, channels, recorded) {
            for (factor, cause) in corrections(channel) {
                let checks =
                    check_relations(&blocks.with(&channel.signal, factor), aircraft, settings);
                trials.push(Trial {
                    name,
                    channel,
                    factor,
                    cause,
                    bad: bad(&checks, &found),
                    misfit: misfit(&checks),
                    checks,
                });
            }
        }
        trials.sort_by(|a, b| a.bad.cmp(&b.bad).then(a.misfit.total_cmp(&b.misfit)));
        let Some(best) = trials.first().filter(|t| t.bad < bad(&found, &found)) else {
            break;
        };
        if best.bad == 0 {
            guilty.extend(as_good_as(best, &trials));
            return guilty;
        }
        guilty.push(best.guilty(true));
        blocks = blocks.with(&best.channel.signal, best.factor);
        found.clone_from(&best.checks);
    }
    guilty.extend(common(&found, &blocks, channels, recorded));
    guilty
}

/// The instruments that never change while the aircraft flies and most of the others do change:
/// whatever relation they are in, it may say nothing for want of them.
fn still(blocks: &BlockMeans, recorded: &[String], settings: &Checks) -> Vec<&'static str> {
    let instruments: BTreeSet<&'static str> = relations::all(settings)
        .iter()
        .flat_map(|r| r.dominant().iter().copied())
        .collect();
    let recorded = |s: &&&str| recorded.iter().any(|r| r == *s);
    let (still, changing): (Vec<&str>, Vec<&str>) = instruments
        .iter()
        .filter(recorded)
        .partition(|s| blocks.still(s));
    let long = blocks.count as f64 * blocks.block_s >= settings.dead_s;
    let tells = long && changing.len() > still.len() && blocks.flies(settings.least_velocity_ft_s);
    if tells { still } else { Vec::new() }
}

/// A signal that never changes, in a relation whose other signals do.
fn is_dead(signal: &str, check: &Check, blocks: &BlockMeans) -> bool {
    blocks.still(signal) && check.relation.signals.iter().any(|s| !blocks.still(s))
}

/// One channel corrected in one way.
struct Trial<'a> {
    name: &'a str,
    channel: &'a Channel,
    factor: f64,
    cause: String,
    bad: usize,
    misfit: f64,
    checks: Vec<Check>,
}

impl Trial<'_> {
    fn guilty(&self, alone: bool) -> FaultyChannel {
        FaultyChannel {
            channel: self.name.to_owned(),
            signal: self.channel.signal.clone(),
            cause: Some(self.cause.clone()),
            factor: Some(self.factor),
            alone,
        }
    }
}

/// Channels in a failed relation.
fn suspects<'a>(
    found: &[Check],
    channels: &'a BTreeMap<String, Channel>,
    recorded: &[String],
) -> Vec<(&'a str, &'a Channel)> {
    let failed = |signal: &str| {
        found
            .iter()
            .any(|c| !c.verdict.passed() && c.relation.signals.contains(&signal))
    };
    let suspect = |c: &Channel| recorded.contains(&c.signal) && failed(&c.signal);
    channels
        .iter()
        .filter(|(_, c)| suspect(c))
        .map(|(name, c)| (name.as_str(), c))
        .collect()
}

/// The factors that would correct a channel, each with what it would mean.
fn corrections(channel: &Channel) -> Vec<(f64, String)> {
    let mut corrections = vec![(-1.0, "its sign is reversed".to_owned())];
    let Ok(mapped) = Unit::parse(&channel.unit) else {
        return corrections;
    };
    for other in mapped.alike() {
        let Some(factor) = other.factor_to(mapped).filter(|f| (f - 1.0).abs() > 1e-6) else {
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

/// Relations that fail, or that say nothing any more though they did before.
fn bad(checks: &[Check], before: &[Check]) -> usize {
    let silenced = |c: &Check, b: &Check| {
        c.verdict == CheckVerdict::NotExcited && b.verdict != CheckVerdict::NotExcited
    };
    checks
        .iter()
        .zip(before)
        .filter(|(c, b)| !c.verdict.passed() || silenced(c, b))
        .count()
}

/// The sum of the squared misfits of the relations that say something.
fn misfit(checks: &[Check]) -> f64 {
    let excited = checks
        .iter()
        .filter(|c| c.verdict != CheckVerdict::NotExcited);
    excited
        .filter_map(|c| c.fit)
        .map(|f| f.misfit.powi(2))
        .sum()
}

/// The best trial and the best ones of other channels that explain the failure as well: with as
/// small a misfit, and with as few windows in which the record would have to jump.
fn as_good_as(best: &Trial, trials: &[Trial]) -> Vec<FaultyChannel> {
    let mut chosen: Vec<&Trial> = Vec::new();
    let jumps = |t: &Trial| t.checks.iter().map(|c| c.jumps).sum::<usize>();
    let as_few = |t: &&Trial| jumps(t) <= jumps(best);
    for trial in trials
        .iter()
        .filter(|t| t.bad == 0 && t.misfit <= AS_GOOD * best.misfit)
        .filter(as_few)
    {
        if !chosen.iter().any(|c| c.name == trial.name) {
            chosen.push(trial);
        }
    }
    let alone = chosen.len() == 1;
    chosen.into_iter().map(|t| t.guilty(alone)).collect()
}

/// The channels that all failed relations share, without those that another relation confirms;
/// where the failed relations share none, every unconfirmed channel that dominates one of them.
fn common(
    found: &[Check],
    blocks: &BlockMeans,
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
) -> Vec<FaultyChannel> {
    let cleared = confirmed_signals(found);
    let failed: Vec<&Check> = found.iter().filter(|c| !c.verdict.passed()).collect();
    let shared = |s: &str| failed.iter().all(|c| c.relation.signals.contains(&s));
    let dominates = |s: &str| failed.iter().any(|c| c.relation.dominant().contains(&s));
    let unconfirmed = |s: &str| !cleared.contains(&s);
    let attempts: [&dyn Fn(&str) -> bool; 4] = [
        &|s| shared(s) && dominates(s) && unconfirmed(s),
        &|s| shared(s) && unconfirmed(s),
        &|s| dominates(s) && unconfirmed(s),
        &|s| dominates(s),
    ];
    let attempts = attempts
        .iter()
        .map(|test| accused(channels, recorded, blocks, test));
    attempts
        .into_iter()
        .find(|guilty| !guilty.is_empty())
        .unwrap_or_default()
}

/// The recorded channels whose signals pass a test, accused together.
fn accused(
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
    blocks: &BlockMeans,
    test: &dyn Fn(&str) -> bool,
) -> Vec<FaultyChannel> {
    let suspects = channels
        .iter()
        .filter(|(_, c)| recorded.contains(&c.signal) && test(&c.signal));
    let mut guilty: Vec<FaultyChannel> = suspects
        .map(|(name, channel)| FaultyChannel {
            channel: name.clone(),
            signal: channel.signal.clone(),
            cause: blocks
                .still(&channel.signal)
                .then(|| "it never changes".to_owned()),
            factor: None,
            alone: true,
        })
        .collect();
    let alone = guilty.len() == 1;
    for g in &mut guilty {
        g.alone = alone;
    }
    guilty
}

/// What the failed checks and the guilty channels amount to; none where nothing failed and none is
/// dead.
pub fn report(guilty: &[FaultyChannel], found: &[Check]) -> Option<FaultReport> {
    let failed: Vec<String> = found
        .iter()
        .filter(|c| !c.verdict.passed())
        .map(described)
        .collect();
    if failed.is_empty() && guilty.is_empty() {
        return None;
    }
    let named = |g: &FaultyChannel| format!("`{}`", g.channel);
    let causes: Vec<String> = guilty
        .iter()
        .filter_map(|g| Some(format!("`{}`: {}", g.channel, g.cause.as_ref()?)))
        .collect();
    let names: Vec<String> = guilty.iter().map(named).collect();
    let several = if guilty.iter().any(|g| !g.alone) {
        "one of these is wrong: "
    } else {
        ""
    };
    let likely = if causes.is_empty() {
        "no sign and no unit would set it right".to_owned()
    } else {
        format!("likely {}", causes.join(", or "))
    };
    let disagreement = if failed.is_empty() {
        format!(
            "{} {} one value throughout, while the aircraft flies",
            names.join(", "),
            one(&names, "has", "have")
        )
    } else {
        let (names, do_not) = (names.join(", "), one(&names, "does not", "do not"));
        format!(
            "{names} {do_not} agree with the other channels ({})",
            failed.join("; ")
        )
    };
    let reason = format!(
        "{several}{disagreement}; {likely}. Correct the channel map, or leave the flight out"
    );
    let place = if names.len() == 1 {
        "channel"
    } else {
        "channels"
    };
    let required = guilty.is_empty()
        || guilty
            .iter()
            .any(|g| signal::REQUIRED.contains(&g.signal.as_str()));
    Some(FaultReport {
        place: format!("{place} {}", names.join(", ")),
        reason,
        required,
    })
}

fn one<'a>(names: &[String], singular: &'a str, plural: &'a str) -> &'a str {
    if names.len() == 1 { singular } else { plural }
}

fn described(check: &Check) -> String {
    let words = check.verdict;
    match check.fit {
        Some(fit) => format!("{}: slope {:.3}, {words}", check.relation.name, fit.slope),
        None => format!("{}: {words}", check.relation.name),
    }
}
