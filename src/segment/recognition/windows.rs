//! Windows of maneuvers: the inputs with the lead-in before and the decay after them.

use super::detections::Detections;
use super::found::FoundManeuver;

/// Number of levels after the last input within which another step of the pilot cannot be separated
/// from it. One follows the transit of the input, one precedes the transit of the step.
const LEVELS_BETWEEN_STEPS: f64 = 2.0;

/// The windows of maneuvers in order of time.
///
/// A window begins with the lead-in before the first input. It ends with the decay after the last
/// input, or where the pilot takes over. If a pause is too short for both, the decay gets a share
/// of it and the next maneuver's lead-in the rest. The decay may also use the same share of that
/// lead-in.
pub(in crate::segment) fn windows(
    detections: &Detections,
    found: &[FoundManeuver],
) -> Vec<(f64, f64)> {
    let mut windows: Vec<(f64, f64)> = found.iter().map(|f| whole_window(detections, f)).collect();
    let share = detections.settings.shared_lead_in;
    for k in 1..windows.len() {
        let (last_s, next_s) = (found[k - 1].last_s, found[k].first_s);
        let start_s = windows[k].0.max(last_s + share * (next_s - last_s));
        let shared_end_s = start_s + share * (next_s - start_s);
        windows[k].0 = start_s;
        windows[k - 1].1 = windows[k - 1].1.min(shared_end_s);
    }
    windows
}

/// The window of a maneuver without neighbours.
fn whole_window(detections: &Detections, maneuver: &FoundManeuver) -> (f64, f64) {
    let recognition = &maneuver.class.recognition;
    let decayed_s = maneuver.last_s + recognition.decay_s;
    let taken_over_s = take_over_s(detections, maneuver.last_s, decayed_s);
    (
        maneuver.first_s - recognition.lead_in_s,
        decayed_s.min(taken_over_s),
    )
}

/// Time at which the pilot next steps after the last input, less a step's transit; infinite if he
/// does not.
fn take_over_s(detections: &Detections, last_s: f64, end_s: f64) -> f64 {
    let settings = detections.settings;
    let clear_s = last_s + settings.transit_s + LEVELS_BETWEEN_STEPS * settings.level_s;
    settings
        .pilot_controls
        .iter()
        .flat_map(|control| {
            let steps = &detections.steps;
            steps.between(control, clear_s, end_s + settings.transit_s)
        })
        .map(|step| step.time_s - settings.transit_s)
        .fold(f64::INFINITY, f64::min)
}
