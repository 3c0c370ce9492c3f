//! Sweeps: runs of swings of one signal that become faster.

use super::class_evidence::recognised;
use super::class_match::fits;
use super::detections::Detections;
use super::found::FoundManeuver;
use super::patterns;
use super::segment::Segment;
use super::sequences::Source;
use crate::maneuver::{Class, Sweep};
use crate::segment::steps::swings::{Swing, swings};

/// Factor by which an interval between swings may exceed the one before within a run. A sweep's
/// intervals shrink; the factor leaves room for a swing whose extreme noise has moved.
const INTERVAL_GROWTH: f64 = 1.5;

/// Finds the maneuvers of a class that is defined by a sweep.
pub(super) fn find_sweeps<'a>(detections: &Detections, class: &'a Class) -> Vec<FoundManeuver<'a>> {
    let mut found = Vec::new();
    for (signal, wanted) in &class.recognition.sweep {
        let values = detections.record.values(signal).unwrap_or_default();
        let swings = swings(values, detections.steps.smallest(signal));
        for run in runs(detections, swings) {
            found.extend(sweep_of_run(detections, class, &run, wanted));
        }
    }
    found
}

/// Runs of swings, times in s: no interval much longer than the one before, and none longer than a
/// control may be held.
fn runs(detections: &Detections, swings: Vec<Swing>) -> Vec<Vec<Swing>> {
    let record = detections.record;
    let time_s = |sample: f64| record.start_s + sample * record.step_s;
    let mut runs: Vec<Vec<Swing>> = Vec::new();
    for swing in swings {
        let swing = Swing {
            from_s: time_s(swing.from_s),
            to_s: time_s(swing.to_s),
        };
        let continues = |run: &[Swing]| {
            let mut earlier_s = run.iter().rev().map(Swing::middle_s);
            let last_s = earlier_s.next().unwrap_or(f64::NEG_INFINITY);
            let interval_s = swing.middle_s() - last_s;
            let previous_s = earlier_s.next().map_or(f64::INFINITY, |s| last_s - s);
            interval_s <= detections.settings.longest_hold_s
                && interval_s <= INTERVAL_GROWTH * previous_s
        };
        match runs.last_mut().filter(|run| continues(run)) {
            Some(run) => run.push(swing),
            None => runs.push(vec![swing]),
        }
    }
    runs
}

fn sweep_of_run<'a>(
    detections: &Detections,
    class: &'a Class,
    run: &[Swing],
    wanted: &Sweep,
) -> Option<FoundManeuver<'a>> {
    let ratio = patterns::fit_sweep(run, wanted).ok()?;
    let source = Source::of_class(class, detections);
    let (first_s, last_s) = (run.first()?.from_s, run.last()?.to_s);
    let segment = Segment {
        detections,
        source: &source,
        from_s: first_s,
        to_s: last_s,
    };
    if !fits(&segment, class) {
        return None;
    }
    let mut recognised = recognised(&segment, class, (first_s, last_s));
    let sweep = format!("{} swings that become {ratio:.1} times as fast", run.len());
    recognised.evidence = if recognised.evidence.is_empty() {
        sweep
    } else {
        format!("{sweep}; {}", recognised.evidence)
    };
    Some(FoundManeuver {
        class,
        first_s,
        last_s,
        recognised,
    })
}
