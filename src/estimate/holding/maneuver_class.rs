//! Class of one maneuver: the maneuver's class without what this maneuver has no information on.

use std::collections::BTreeMap;

use super::absent_outputs::class_of_recorded_outputs;
use super::resting_surfaces::class_of_moving_surfaces;
use crate::estimate::task::Task;
use crate::maneuver::Class;

/// Reason why a derivative that the class estimates is inactive in a maneuver.
const RESTS: &str = "its surface rests";

/// The class without the derivatives of resting surfaces and without those that need an absent
/// output, and the reason for each derivative left out.
pub(in crate::estimate) fn class_of_maneuver(task: &Task) -> (Class, BTreeMap<String, String>) {
    let (class, mut reasons) = class_of_recorded_outputs(task);
    let seen = Task {
        class: &class,
        ..*task
    };
    let (class, resting) = class_of_moving_surfaces(&seen);
    let resting = resting.into_iter().map(|name| (name, RESTS.to_owned()));
    reasons.extend(resting);
    (class, reasons)
}
