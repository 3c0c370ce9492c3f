//! Candidates whose inputs overlap: one of them is the maneuver. The others are excitation of no class,
//! unless the maneuver explains the same motion.

use super::detections::Detections;
use super::found::{FoundManeuver, RecognitionResult};
use crate::maneuver::UnclassifiedExcitation;

/// A candidate with the reason for which it would be rejected.
struct CandidateManeuver<'a> {
    found: FoundManeuver<'a>,
    rejection: Option<String>,
}

/// Removes overlaps, and sorts by time.
///
/// The accepted one of two candidates whose inputs overlap counts, then the longer one. `rejection`
/// returns the reason for which a candidate would be rejected. The other one is `unknown` if it was
/// rejected or belongs to the other axis: the maneuver then does not explain its inputs. Excitation of
/// no class is removed if it overlaps a maneuver, or longer excitation of no class, of which it is a
/// part.
pub(in crate::segment) fn without_overlaps<'a>(
    detections: &Detections,
    recognition: RecognitionResult<'a>,
    rejection: impl Fn(&FoundManeuver) -> Option<String>,
) -> RecognitionResult<'a> {
    let mut candidates: Vec<CandidateManeuver> = Vec::new();
    for found in &recognition.found {
        let others = recognition
            .found
            .iter()
            .filter(|other| overlap(found, other));
        // A candidate overlaps itself.
        let is_contested = others.count() > 1;
        candidates.push(CandidateManeuver {
            rejection: is_contested.then(|| rejection(found)).flatten(),
            found: found.clone(),
        });
    }
    candidates.sort_by(|a, b| {
        let longer = b.found.excited_for_s().total_cmp(&a.found.excited_for_s());
        let accepted = a.rejection.is_some().cmp(&b.rejection.is_some());
        accepted.then(longer)
    });
    let mut found: Vec<FoundManeuver> = Vec::new();
    let mut displaced: Vec<UnclassifiedExcitation> = Vec::new();
    for candidate in candidates {
        match found.iter().find(|other| overlap(&candidate.found, other)) {
            None => found.push(candidate.found),
            Some(maneuver) => displaced.extend(candidate.displaced(detections, maneuver)),
        }
    }
    found.sort_by(|a, b| a.first_s.total_cmp(&b.first_s));
    let mut unknown = apart(recognition.unknown, &found);
    unknown.extend(displaced);
    unknown.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    RecognitionResult { found, unknown }
}

/// `true` if the inputs of two candidates overlap.
fn overlap(a: &FoundManeuver, b: &FoundManeuver) -> bool {
    a.first_s <= b.last_s && a.last_s >= b.first_s
}

/// Excitation of no class apart from maneuvers and from longer excitation of no class.
fn apart(
    mut all: Vec<UnclassifiedExcitation>,
    found: &[FoundManeuver],
) -> Vec<UnclassifiedExcitation> {
    all.sort_by(|a, b| (b.end_s - b.start_s).total_cmp(&(a.end_s - a.start_s)));
    let mut unknown: Vec<UnclassifiedExcitation> = Vec::new();
    for u in all {
        let overlaps = |from_s: f64, to_s: f64| u.start_s <= to_s && u.end_s >= from_s;
        if !found.iter().any(|f| overlaps(f.first_s, f.last_s))
            && !unknown.iter().any(|o| overlaps(o.start_s, o.end_s))
        {
            unknown.push(u);
        }
    }
    unknown
}

impl CandidateManeuver<'_> {
    /// Row of a candidate that a maneuver displaces; `None` if the maneuver explains its inputs.
    fn displaced(
        &self,
        detections: &Detections,
        maneuver: &FoundManeuver,
    ) -> Option<UnclassifiedExcitation> {
        let FoundManeuver {
            class,
            first_s,
            last_s,
            ..
        } = self.found;
        if self.rejection.is_none() && class.axis == maneuver.class.axis {
            return None;
        }
        let rejected = self.rejection.as_ref();
        let rejected = rejected.map_or_else(String::new, |reason| format!("; {reason}"));
        Some(UnclassifiedExcitation {
            flight_id: detections.record.flight_id.clone(),
            start_s: first_s,
            end_s: last_s,
            inputs: counted_inputs(detections, &self.found),
            nearest_class: class.name.clone(),
            reason: format!(
                "like {}, and its inputs overlap those of the {} from {:.1} to {:.1} s{rejected}",
                class.name, maneuver.class.name, maneuver.first_s, maneuver.last_s
            ),
        })
    }
}

/// Inputs of a candidate with their number of steps: `de_deg 5, dpv_deg 1`.
fn counted_inputs(detections: &Detections, found: &FoundManeuver) -> String {
    let half_a_transit_s = detections.settings.transit_s / 2.0;
    let (from_s, to_s) = (
        found.first_s - half_a_transit_s,
        found.last_s + half_a_transit_s,
    );
    let inputs = found.class.recognition.inputs().into_iter();
    let counted = inputs.map(|signal| {
        let steps = detections.steps.between(signal, from_s, to_s);
        format!("{signal} {}", steps.len())
    });
    counted.collect::<Vec<_>>().join(", ")
}
