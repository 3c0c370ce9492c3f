//! Recognition: which classes the stretches of a train fit, and what fits none.
//!
//! A train may hold one maneuver, several that follow each other closely, or none. It is cut at its
//! pauses into the stretches that leave the fewest steps unexplained, then with the most steps in
//! pulses of known lengths, then where the flag rests, then into as few as possible, then where
//! decay and lead-in are whole, then where one repeats the other, then where most inputs are back
//! at their trim and steps of one input follow each other, then at the longest pauses. Two trains
//! between which the pilot has gone over from one control to another are one where more is found in
//! both together. A stretch that fits several classes is of the one whose inputs explain the most
//! steps; a rule about lengths of pulses goes before one about counts; where nothing else differs
//! the flags decide.

use crate::error::Problem;
use crate::maneuver::{Class, Recognised, Unknown};

use super::candidates::{Kind, Scene, TRIM_SHARE, Train, kind_of};
use super::seen::{Miss, Seen};
use super::swings::{self, Swing};
use super::{patterns, problem};

/// A stretch is never longer than so many pauses: the search stays linear in a flight's length.
const MOST_PAUSES: usize = 64;

/// A maneuver's class and inputs, s on the record's clock.
#[derive(Clone, Debug)]
pub(super) struct Found<'a> {
    pub class: &'a Class,
    pub first_s: f64,
    pub last_s: f64,
    pub recognised: Recognised,
}

/// What a record holds.
#[derive(Clone, Debug, Default)]
pub(super) struct Recognition<'a> {
    pub found: Vec<Found<'a>>,
    pub unknown: Vec<Unknown>,
}

impl<'a> Recognition<'a> {
    fn add(&mut self, more: Recognition<'a>) {
        self.found.extend(more.found);
        self.unknown.extend(more.unknown);
    }
}

/// The verdict on one stretch.
enum Verdict<'a> {
    Fits(&'a Class),
    /// Several classes alike.
    Alike(String),
    None,
}

/// Recognises every train, and the sweeps.
pub(super) fn all<'a>(scene: &Scene, classes: &'a [Class], trains: &[Train]) -> Recognition<'a> {
    let mut recognition = Recognition::default();
    // The train before, and what was recognised in it.
    let mut before: Option<(Train, Recognition)> = None;
    for train in trains {
        let of_its_kind: Vec<&Class> = classes
            .iter()
            .filter(|c| c.recognition.sweep.is_empty() && kind_of(c, scene) == train.kind)
            .collect();
        let alone = one_train(scene, &of_its_kind, train);
        let parted = before.as_ref().map_or(0, |b| b.1.found.len()) + alone.found.len();
        let joined = before.as_ref().and_then(|b| b.0.going_over(train, scene));
        let joined = joined
            .map(|t| (one_train(scene, &of_its_kind, &t), t))
            .filter(|j| j.0.found.len() > parted);
        before = if let Some((recognised, joined)) = joined {
            Some((joined, recognised))
        } else {
            recognition.add(before.map(|b| b.1).unwrap_or_default());
            Some((train.clone(), alone))
        };
    }
    recognition.add(before.map(|b| b.1).unwrap_or_default());
    for class in classes {
        for (signal, wanted) in &class.recognition.sweep {
            let smallest = scene
                .steps
                .smallest
                .get(signal)
                .copied()
                .unwrap_or(f64::INFINITY);
            let values = scene.record.values(signal).unwrap_or_default();
            for run in runs(scene, swings::of_signal(values, smallest)) {
                recognition
                    .found
                    .extend(one_sweep(scene, class, &run, wanted));
            }
        }
    }
    recognition
}

/// A part of a train, between pauses: the range of its edges.
#[derive(Clone, Copy, Debug)]
struct Block {
    first: usize,
    end: usize,
}

/// The best way to cut a train as far as some block.
#[derive(Clone, Copy, Debug, Default)]
struct Cut<'a> {
    unexplained: usize,
    /// Steps that rules about lengths of pulses explain.
    in_pulses: usize,
    /// Rests of the flag that stretches run across.
    run_across: usize,
    stretches: usize,
    /// Stretches that follow another so closely that one's decay and the other's lead-in overlap,
    /// where both are whole elsewhere.
    cramped: usize,
    /// Stretches of the class of the one before that do not repeat its steps: what is flown again
    /// at once is mostly the same.
    unlike: usize,
    /// How many inputs of stretches do not end where they began, and how often one steps again
    /// after another has stepped meanwhile: a cut in the wrong place makes more of them. Neither
    /// counts for more, for a step may pass unseen.
    loose_ends: usize,
    /// The pauses cut at, s.
    paused_s: f64,
    /// The block at which the last stretch begins, and its class if it is one.
    from: usize,
    class: Option<&'a Class>,
}

impl Cut<'_> {
    fn is_better_than(&self, other: &Cut) -> bool {
        let parts = |c: &Cut| (c.run_across, c.stretches, c.cramped, c.unlike, c.loose_ends);
        let key = |c: &Cut| (c.unexplained, usize::MAX - c.in_pulses, parts(c));
        key(self) < key(other) || (key(self) == key(other) && self.paused_s > other.paused_s)
    }
}

fn one_train<'a>(scene: &Scene, classes: &[&'a Class], train: &Train) -> Recognition<'a> {
    let mut into = Recognition::default();
    let blocks = blocks(train, scene.settings.shortest_pause_s);
    let mut left: Option<(usize, usize)> = None;
    for (from, to, is_stretch) in cut(scene, classes, train, &blocks) {
        let range = (blocks[from].first, blocks[to - 1].end);
        if is_stretch {
            leave(scene, classes, train, left.take(), &mut into);
            stretch(scene, classes, train, range, &mut into);
        } else {
            left = Some((left.map_or(range.0, |l| l.0), range.1));
        }
    }
    leave(scene, classes, train, left, &mut into);
    into
}

fn blocks(train: &Train, pause_s: f64) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for (k, pair) in train.edges.iter().enumerate() {
        let pauses = k == 0 || pair.time_s - train.edges[k - 1].time_s >= pause_s;
        match blocks.last_mut().filter(|_| !pauses) {
            Some(block) => block.end = k + 1,
            None => blocks.push(Block {
                first: k,
                end: k + 1,
            }),
        }
    }
    blocks
}

fn seen<'s>(scene: &'s Scene, train: &'s Train, (first, end): (usize, usize)) -> Seen<'s> {
    let at = |k: usize| train.edges.get(k).map_or(f64::NAN, |e| e.time_s);
    Seen {
        scene,
        kind: &train.kind,
        from_s: at(first),
        to_s: at(end.saturating_sub(1)),
    }
}

/// The train's stretches and what is between them, as ranges of blocks.
fn cut(
    scene: &Scene,
    classes: &[&Class],
    train: &Train,
    blocks: &[Block],
) -> Vec<(usize, usize, bool)> {
    let mut best: Vec<Cut> = vec![Cut::default()];
    for end in 1..=blocks.len() {
        let before = best[end - 1];
        let block = blocks[end - 1];
        let mut chosen = Cut {
            unexplained: before.unexplained + block.end - block.first,
            from: end - 1,
            class: None,
            ..before
        };
        for from in (end.saturating_sub(MOST_PAUSES)..end).rev() {
            let range = (blocks[from].first, block.end);
            let Some(explained) = explained(&seen(scene, train, range), classes, train, range)
            else {
                continue;
            };
            let candidate = best[from].and(scene, train, blocks, (from, end), &explained);
            if candidate.is_better_than(&chosen) {
                chosen = candidate;
            }
        }
        best.push(chosen);
    }
    let mut parts = Vec::new();
    let mut end = blocks.len();
    while end > 0 {
        parts.push((best[end].from, end, best[end].class.is_some()));
        end = best[end].from;
    }
    parts.reverse();
    parts
}

impl<'a> Cut<'a> {
    /// This cut and a stretch of some blocks after it.
    fn and(
        &self,
        scene: &Scene,
        train: &Train,
        blocks: &[Block],
        (from, end): (usize, usize),
        explained: &Explained<'a>,
    ) -> Cut<'a> {
        let range = (blocks[from].first, blocks[end - 1].end);
        let mut cut = Cut {
            unexplained: self.unexplained + explained.unexplained,
            in_pulses: self.in_pulses + explained.in_pulses,
            run_across: self.run_across + explained.run_across,
            stretches: self.stretches + 1,
            loose_ends: self.loose_ends + explained.loose_ends,
            from,
            class: Some(explained.class),
            ..*self
        };
        if let (Some(class), Some(block)) = (self.class, blocks.get(self.from)) {
            let (last_s, next_s) = (train.edges[range.0 - 1].time_s, train.edges[range.0].time_s);
            let whole_s = class.recognition.decay_s + explained.class.recognition.lead_in_s
                - scene.settings.transit_s;
            cut.paused_s += next_s - last_s;
            cut.cramped += usize::from(next_s - last_s < whole_s);
            let own = (block.first, range.0);
            let repeats =
                || repeated(scene, train, class, own) == repeated(scene, train, class, range);
            cut.unlike += usize::from(class.name == explained.class.name && !repeats());
        }
        cut
    }
}

/// The steps of a class's inputs in a stretch: which signal steps how often before another does.
fn repeated<'t>(
    scene: &Scene,
    train: &'t Train,
    class: &Class,
    range: (usize, usize),
) -> Vec<(&'t str, usize)> {
    let inputs = seen(scene, train, range).inputs(class);
    let own: Vec<&str> = train
        .edges
        .get(range.0..range.1)
        .unwrap_or_default()
        .iter()
        .map(|e| e.signal)
        .filter(|s| inputs.contains(s))
        .collect();
    own.chunk_by(|a, b| a == b)
        .map(|run| (run[0], run.len()))
        .collect()
}

/// How a class explains a stretch.
#[derive(Clone, Copy, Debug)]
struct Explained<'a> {
    class: &'a Class,
    unexplained: usize,
    in_pulses: usize,
    run_across: usize,
    loose_ends: usize,
}

/// What the class that explains most of a stretch's edges makes of it; none where it fits no class.
fn explained<'a>(
    seen: &Seen,
    classes: &[&'a Class],
    train: &Train,
    (first, end): (usize, usize),
) -> Option<Explained<'a>> {
    let edges = train.edges.get(first..end)?;
    let of_class = |class: &&'a Class| {
        let inputs = seen.inputs(class);
        let own = |signal: &str| -> Vec<f64> {
            edges
                .iter()
                .filter(|e| e.signal == signal)
                .map(|e| e.change)
                .collect()
        };
        let share = seen.scene.settings.outstanding_share;
        let returns = edges
            .chunk_by(|a, b| a.signal == b.signal)
            .count()
            .saturating_sub(inputs.len());
        let away = inputs
            .iter()
            .filter(|signal| is_away(&own(signal), share))
            .count();
        let pulses = &class.recognition.pulses;
        Explained {
            class,
            unexplained: edges.iter().filter(|e| !inputs.contains(e.signal)).count(),
            in_pulses: pulses
                .iter()
                .map(|(signal, p)| own(signal).len().min(p.widths.len() + 1))
                .sum(),
            run_across: run_across(seen, class, edges),
            loose_ends: returns + away,
        }
    };
    let fitting = classes.iter().filter(|c| seen.misses(c).is_empty());
    fitting
        .map(of_class)
        .min_by_key(|e| (e.unexplained, usize::MAX - e.in_pulses))
}

/// How many rests of the excitation flag lie within a stretch of a class that it is up for. A flag
/// that rests while there is more than a step of feedback is late, or wrong.
fn run_across(seen: &Seen, class: &Class, edges: &[super::candidates::Edge]) -> usize {
    let scene = seen.scene;
    if *seen.kind != Kind::Onboard
        || class.recognition.flags.get(&scene.settings.excitation_flag) != Some(&true)
    {
        return 0;
    }
    let within = |(from_s, to_s): &&(f64, f64)| seen.from_s < *from_s && *to_s < seen.to_s;
    let still = |(from_s, to_s): &&(f64, f64)| {
        edges
            .iter()
            .filter(|e| (*from_s..=*to_s).contains(&e.time_s))
            .count()
            <= 1
    };
    scene.flag_rests.iter().filter(within).filter(still).count()
}

/// Whether a signal does not end near where it began, by those of its changes that are not
/// feedback's.
fn is_away(changes: &[f64], outstanding_share: f64) -> bool {
    let largest = changes.iter().map(|c| c.abs()).fold(0.0, f64::max);
    let moved: f64 = changes
        .iter()
        .filter(|c| c.abs() >= outstanding_share * largest)
        .sum();
    moved.abs() > TRIM_SHARE * largest
}

fn verdict<'a>(seen: &Seen, classes: &[&'a Class]) -> Verdict<'a> {
    let fitting = classes.iter().filter(|c| seen.misses(c).is_empty());
    let worth = |c: &Class| (seen.explained(c), !c.recognition.pulses.is_empty());
    let mut ranked: Vec<(&'a Class, (usize, bool), f64)> = fitting
        .map(|c| (*c, worth(c), seen.confidence(c)))
        .collect();
    ranked.sort_by(|a, b| b.1.cmp(&a.1).then(b.2.total_cmp(&a.2)));
    match ranked[..] {
        [] => Verdict::None,
        [best, second, ..] if best.1 == second.1 && best.2 - second.2 < 0.01 => {
            let alike = ranked
                .iter()
                .filter(|r| r.1 == best.1 && best.2 - r.2 < 0.01);
            Verdict::Alike(
                alike
                    .map(|r| r.0.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", "),
            )
        }
        [best, ..] => Verdict::Fits(best.0),
    }
}

fn stretch<'a>(
    scene: &Scene,
    classes: &[&'a Class],
    train: &Train,
    range: (usize, usize),
    into: &mut Recognition<'a>,
) {
    let seen = seen(scene, train, range);
    match verdict(&seen, classes) {
        Verdict::Fits(class) => {
            let Some((first_s, last_s)) = seen.excited_s(class) else {
                return;
            };
            let before = range
                .0
                .checked_sub(1)
                .and_then(|k| train.edges.get(k))
                .map_or(f64::NEG_INFINITY, |e| e.time_s);
            let first_s = opening(scene, &seen, (before, first_s));
            let recognised = seen.recognised(class, (first_s, last_s));
            into.found.push(Found {
                class,
                first_s,
                last_s,
                recognised,
            });
        }
        Verdict::Alike(names) => {
            let reason = format!("fits {names} alike; make their recognition exclude each other");
            into.unknown.push(unknown(&seen, classes, names, reason));
        }
        Verdict::None => {}
    }
}

/// When the first step of a surface was preceded by a smaller one to the other side: a deflection
/// from trim that feedback made small. What steps no later than the edge before the stretch belongs
/// to another.
fn opening(scene: &Scene, seen: &Seen, (after_s, first_s): (f64, f64)) -> f64 {
    if *seen.kind != Kind::Onboard {
        return first_s;
    }
    let at_first = |s: &&super::Step| (s.time_s - first_s).abs() < scene.record.step_s / 2.0;
    let before = |signal: &String| -> Option<f64> {
        let steps = scene
            .own
            .between(signal, first_s - scene.settings.longest_rest_s, first_s);
        let first = steps.iter().find(at_first)?;
        let opens = |s: &&super::Step| {
            after_s < s.time_s && s.time_s < first.time_s && s.change() * first.change() < 0.0
        };
        let share = |s: &&super::Step| {
            s.change().abs() >= 0.5 * scene.settings.outstanding_share * first.change().abs()
        };
        steps
            .iter()
            .filter(opens)
            .filter(share)
            .map(|s| s.time_s)
            .next_back()
    };
    scene
        .own
        .of
        .keys()
        .filter_map(before)
        .fold(first_s, f64::min)
}

/// What fits no class: worth a word where a signal goes to one side, to the other by more than
/// ordinary flying does, and back.
fn leave<'a>(
    scene: &Scene,
    classes: &[&'a Class],
    train: &Train,
    range: Option<(usize, usize)>,
    into: &mut Recognition<'a>,
) {
    let Some(range) = range else { return };
    let seen = seen(scene, train, range);
    let misses = classes.iter().map(|c| (*c, seen.misses(c)));
    let nearest = misses.min_by_key(|(c, misses)| (usize::MAX - seen.explained(c), misses.len()));
    let Some((class, misses)) = nearest else {
        return;
    };
    let signals = train.edges.iter().map(|e| e.signal);
    if !signals
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .any(|s| seen.is_excitation(s))
    {
        return;
    }
    // Pilots move their controls anyway: a few steps, or steps among which no class finds one of
    // its inputs complete.
    if train.kind != Kind::Onboard
        && misses.iter().filter(|m| m.too_little).count() > 0
        && !is_series(&seen, class)
    {
        return;
    }
    let reason = in_words(scene, class, &misses, &seen);
    into.unknown
        .push(unknown(&seen, classes, class.name.clone(), reason));
}

/// Whether the pilot's steps are more than ordinary flying: at least half of what the class wants
/// of all its inputs together, and four reversals.
fn is_series(seen: &Seen, class: &Class) -> bool {
    let wanted: usize = class.recognition.steps.values().map(|c| c.at_least).sum();
    seen.explained(class) >= wanted.div_ceil(2).max(4)
}

fn unknown(seen: &Seen, classes: &[&Class], nearest_class: String, reason: String) -> Unknown {
    let counted = classes
        .iter()
        .flat_map(|c| c.recognition.counted())
        .map(String::as_str);
    Unknown {
        flight_id: seen.scene.record.flight_id.clone(),
        start_s: seen.from_s,
        end_s: seen.to_s,
        inputs: seen.count_all(counted),
        nearest_class,
        reason,
    }
}

fn in_words(scene: &Scene, class: &Class, misses: &[Miss], seen: &Seen) -> String {
    let reasons: Vec<&str> = misses.iter().map(|m| m.reason.as_str()).collect();
    let record = scene.record;
    let ends_s = record.time_s(record.samples.saturating_sub(1));
    let cut =
        seen.to_s + scene.settings.longest_hold_s > ends_s || seen.from_s - 1.0 < record.start_s;
    let broken_off = misses.iter().all(|m| m.too_little);
    let why = match (broken_off, cut) {
        (true, true) => "cut by the end of the record, or broken off: ",
        (true, false) => "broken off? ",
        (false, _) => "",
    };
    format!("nearest to {}; {why}{}", class.name, reasons.join("; "))
}

/// Runs of swings, each no more than half as long again as the one before, and none longer than a
/// control may be held.
fn runs(scene: &Scene, swings: Vec<Swing>) -> Vec<Vec<Swing>> {
    let record = scene.record;
    let at = |k: f64| record.start_s + k * record.step_s;
    let mut runs: Vec<Vec<Swing>> = Vec::new();
    for swing in swings {
        let swing = Swing {
            from_s: at(swing.from_s),
            to_s: at(swing.to_s),
        };
        let goes_on = |run: &Vec<Swing>| {
            let middles: Vec<f64> = run.iter().rev().take(2).map(Swing::middle_s).collect();
            let apart_s = swing.middle_s() - middles[0];
            let before_s = middles.get(1).map_or(f64::INFINITY, |b| middles[0] - b);
            apart_s <= scene.settings.longest_hold_s && apart_s <= 1.5 * before_s
        };
        match runs.last_mut().filter(|run| goes_on(run)) {
            Some(run) => run.push(swing),
            None => runs.push(vec![swing]),
        }
    }
    runs
}

fn one_sweep<'a>(
    scene: &Scene,
    class: &'a Class,
    run: &[Swing],
    wanted: &crate::maneuver::Sweep,
) -> Option<Found<'a>> {
    let ratio = patterns::sweep(run, wanted).ok()?;
    let kind = kind_of(class, scene);
    let (first_s, last_s) = (run.first()?.from_s, run.last()?.to_s);
    let seen = Seen {
        scene,
        kind: &kind,
        from_s: first_s,
        to_s: last_s,
    };
    if !seen.misses(class).is_empty() {
        return None;
    }
    let mut recognised = seen.recognised(class, (first_s, last_s));
    let evidence = format!("{} swings that become {ratio:.1} times as fast", run.len());
    recognised.evidence = if recognised.evidence.is_empty() {
        evidence
    } else {
        format!("{evidence}; {}", recognised.evidence)
    };
    Some(Found {
        class,
        first_s,
        last_s,
        recognised,
    })
}

/// Puts the maneuvers in order of time and keeps their inputs from overlapping: where they do, the
/// longer excitation stands. What is unknown within a maneuver, or within something longer unknown,
/// is a part of it.
pub(super) fn keep_apart(recognition: &mut Recognition) {
    let Recognition { found, unknown } = recognition;
    found.sort_by(|a, b| (b.last_s - b.first_s).total_cmp(&(a.last_s - a.first_s)));
    let mut kept: Vec<Found> = Vec::new();
    for f in found.drain(..) {
        if kept
            .iter()
            .all(|k| f.first_s > k.last_s || f.last_s < k.first_s)
        {
            kept.push(f);
        }
    }
    kept.sort_by(|a, b| a.first_s.total_cmp(&b.first_s));
    unknown.sort_by(|a, b| (b.end_s - b.start_s).total_cmp(&(a.end_s - a.start_s)));
    let mut left: Vec<Unknown> = Vec::new();
    for u in unknown.drain(..) {
        let inside = kept
            .iter()
            .any(|k| u.start_s <= k.last_s && u.end_s >= k.first_s);
        if !inside
            && left
                .iter()
                .all(|l| u.start_s > l.end_s || u.end_s < l.start_s)
        {
            left.push(u);
        }
    }
    left.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    (*found, *unknown) = (kept, left);
}

/// The windows of maneuvers in order of time: the lead-in before the first input, the decay after
/// the last. A window ends where the pilot takes over. Of a pause too short for both, a share is
/// the decay's, the rest the next maneuver's lead-in; the decay may use the same share of that
/// lead-in.
pub(super) fn windows(scene: &Scene, found: &[Found]) -> Vec<(f64, f64)> {
    let of = |f: &Found| {
        let rule = &f.class.recognition;
        let end_s = f.last_s + rule.decay_s;
        (
            f.first_s - rule.lead_in_s,
            end_s.min(taken_over_s(scene, f.last_s, end_s)),
        )
    };
    let mut windows: Vec<(f64, f64)> = found.iter().map(of).collect();
    for k in 1..windows.len() {
        let (last_s, next_s) = (found[k - 1].last_s, found[k].first_s);
        let share = scene.settings.shared_lead_in;
        windows[k].0 = windows[k].0.max(last_s + share * (next_s - last_s));
        windows[k - 1].1 = windows[k - 1]
            .1
            .min(windows[k].0 + share * (next_s - windows[k].0));
    }
    windows
}

/// When the pilot next steps after the last input, less the time that a step takes.
fn taken_over_s(scene: &Scene, last_s: f64, end_s: f64) -> f64 {
    let settings = scene.settings;
    let clear_s = last_s + settings.transit_s + 2.0 * settings.level_s;
    let steps = settings
        .pilot_controls
        .iter()
        .flat_map(|c| scene.steps.between(c, clear_s, end_s + settings.transit_s));
    steps
        .map(|s| s.time_s - settings.transit_s)
        .fold(f64::INFINITY, f64::min)
}

/// One row of `problems` for everything unknown.
pub(super) fn problems(scene: &Scene, unknown: &[Unknown]) -> Vec<Problem> {
    let of = |u: &Unknown| {
        let lasting_s = u.end_s - u.start_s;
        let reason = format!(
            "excitation of {lasting_s:.1} s that fits no class: {}; steps seen: {}",
            u.reason, u.inputs
        );
        problem(scene.record, u.start_s, reason)
    };
    unknown.iter().map(of).collect()
}
