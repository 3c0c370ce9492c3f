//! Recognition: which class an excitation fits, and the window of the maneuver around it.

use std::collections::BTreeMap;

use crate::error::Problem;
use crate::flight::Record;
use crate::maneuver::Class;

use super::candidates::{Excitation, Kind, Steps, inputs, is_excited};
use super::{Settings, Step, problem};

/// A maneuver's class and window, s on the record's clock.
#[derive(Clone, Debug)]
pub(super) struct Recognised<'a> {
    pub class: &'a Class,
    pub start_s: f64,
    pub end_s: f64,
    /// First and last input.
    excited_s: (f64, f64),
}

/// What the steps and flags of one stretch of a record are.
struct Seen<'a> {
    record: &'a Record,
    steps: &'a Steps,
    from_s: f64,
    to_s: f64,
}

impl Seen<'_> {
    fn steps_of(&self, signal: &str) -> impl Iterator<Item = &Step> {
        let steps = self.steps.get(signal).into_iter().flatten();
        steps.filter(|s| (self.from_s..=self.to_s).contains(&s.time_s))
    }

    /// Whether a flag is up for most of the stretch; unknown where the record has no such flag.
    fn flag(&self, signal: &str) -> Option<bool> {
        let (from, to) = (self.record.sample_at(self.from_s), self.record.sample_at(self.to_s));
        let values = self.record.values(signal)?.get(from..=to)?;
        let known: Vec<&f64> = values.iter().filter(|v| v.is_finite()).collect();
        let up = known.iter().filter(|v| ***v > 0.5).count();
        (!known.is_empty()).then_some(2 * up > known.len())
    }

    /// Whether the record has every signal that the class wants steps of and they step often enough; `None` when not,
    /// else whether everything else fits too.
    fn fits(&self, class: &Class) -> Option<bool> {
        let counts = || class.recognition.steps.iter().map(|(signal, count)| (self.steps_of(signal).count(), count));
        if counts().any(|(n, count)| n < count.at_least) {
            return None;
        }
        let flags = class.recognition.flags.iter().all(|(flag, up)| self.flag(flag) == Some(*up));
        Some(flags && counts().all(|(n, count)| n <= count.at_most))
    }

    /// First and last step of the class's inputs.
    fn excited_s(&self, class: &Class) -> Option<(f64, f64)> {
        let signals = inputs(class);
        let times = || signals.iter().flat_map(|s| self.steps_of(s)).map(|s| s.time_s);
        Some((times().min_by(f64::total_cmp)?, times().max_by(f64::total_cmp)?))
    }

    fn count_all<'b>(&self, signals: impl Iterator<Item = &'b String>) -> BTreeMap<&'b str, usize> {
        let counted = signals.map(|s| (s.as_str(), self.steps_of(s).count()));
        counted.filter(|(_, n)| *n > 0).collect()
    }
}

/// Recognises every excitation; those that fit no class, several, or are cut by the record become problems.
pub(super) fn all<'a>(
    record: &Record,
    classes: &'a [Class],
    settings: &Settings,
    steps: &Steps,
    excitations: &[Excitation],
) -> (Vec<Recognised<'a>>, Vec<Problem>) {
    let (mut recognised, mut problems) = (Vec::new(), Vec::new());
    for excitation in excitations {
        match one(record, classes, settings, steps, excitation) {
            Ok(found) => recognised.extend(found),
            Err(reason) => problems.push(problem(record, excitation.from_s, reason)),
        }
    }
    (recognised, problems)
}

/// The class of one excitation: `Ok(None)` when it is none worth a word.
fn one<'a>(
    record: &Record,
    classes: &'a [Class],
    settings: &Settings,
    steps: &Steps,
    excitation: &Excitation,
) -> Result<Option<Recognised<'a>>, String> {
    // The detector places a step within half its transit; that much belongs to a train at both ends. The system that the
    // flag speaks of does nothing before the flag is up; the pilot's last correction before it is none of its steps.
    let slack_s = settings.transit_s / 2.0;
    let from_s = if excitation.kind == Kind::Flagged { excitation.from_s } else { excitation.from_s - slack_s };
    let seen = Seen { record, steps, from_s, to_s: excitation.to_s + slack_s };
    let of_its_kind = |c: &&Class| match &excitation.kind {
        Kind::Flagged => is_excited(c, settings),
        Kind::Pilot(signals) => !is_excited(c, settings) && inputs(c) == *signals,
    };
    let candidates: Vec<&Class> = classes.iter().filter(of_its_kind).collect();
    let fitting: Vec<&Class> = candidates.iter().filter(|c| seen.fits(c) == Some(true)).copied().collect();
    match fitting[..] {
        [class] if excitation.cut => Err(format!("a maneuver like {} is cut by the end of the record", class.name)),
        [class] => Ok(seen.excited_s(class).map(|excited_s| window(class, excitation, excited_s))),
        [] => nothing_fits(&seen, &candidates, excitation, settings).map_or(Ok(None), Err),
        _ => {
            let names: Vec<&str> = fitting.iter().map(|c| c.name.as_str()).collect();
            Err(format!("excitation that fits {} alike; make their recognition exclude each other", names.join(", ")))
        }
    }
}

/// What to say of an excitation that fits no class. Flagged intervals of a few steps are a flag that flickers; pilot
/// steps are worth a word only when they are as many as some class wants, for pilots move their controls anyway.
fn nothing_fits(seen: &Seen, candidates: &[&Class], excitation: &Excitation, settings: &Settings) -> Option<String> {
    let counts = seen.count_all(candidates.iter().flat_map(|c| c.recognition.steps.keys()));
    let near_miss = candidates.iter().any(|c| seen.fits(c).is_some());
    let enough = counts.values().sum::<usize>() >= settings.fewest_steps;
    let worth = match excitation.kind {
        Kind::Flagged => enough,
        Kind::Pilot(_) => near_miss && enough,
    };
    let length_s = excitation.to_s - excitation.from_s;
    let steps: Vec<String> = counts.iter().map(|(signal, n)| format!("{signal} {n}")).collect();
    worth.then(|| format!("excitation of {length_s:.1} s that fits no class; steps seen: {}", steps.join(", ")))
}

/// The maneuver's window: from the lead-in before the first input, but not before the flag came on, to the decay after
/// the last input and the flag's going off.
fn window<'a>(class: &'a Class, excitation: &Excitation, excited_s: (f64, f64)) -> Recognised<'a> {
    let lead_in_s = class.recognition.lead_in_s;
    let (excited_s, start_s, end_s) = match excitation.kind {
        Kind::Flagged => {
            let start_s = (excited_s.0 - lead_in_s).max(excitation.from_s);
            (excited_s, start_s, excited_s.1.max(excitation.to_s))
        }
        Kind::Pilot(_) => ((excitation.from_s, excitation.to_s), excitation.from_s - lead_in_s, excitation.to_s),
    };
    Recognised { class, start_s, end_s: end_s + class.recognition.decay_s, excited_s }
}

/// Puts the maneuvers in order of time and keeps them from overlapping. Where the inputs of two overlap, the longer
/// excitation stands (a flag that flickers during pilot steps is shorter than they are). Otherwise a maneuver ends at
/// the latest where the next one's inputs begin, and the next one's lead-in gives way to its decay: an aircraft that
/// still moves is not trimmed.
pub(super) fn keep_apart(recognised: &mut Vec<Recognised>) {
    let length = |r: &Recognised| r.excited_s.1 - r.excited_s.0;
    recognised.sort_by(|a, b| a.excited_s.0.total_cmp(&b.excited_s.0));
    let mut kept: Vec<Recognised> = Vec::new();
    for mut r in recognised.drain(..) {
        match kept.last_mut() {
            Some(last) if r.excited_s.0 <= last.excited_s.1 => {
                if length(&r) > length(last) {
                    *last = r;
                }
            }
            Some(last) => {
                last.end_s = last.end_s.min(r.excited_s.0);
                r.start_s = r.start_s.max(last.end_s);
                kept.push(r);
            }
            None => kept.push(r),
        }
    }
    *recognised = kept;
}
