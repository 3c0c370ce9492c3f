//! Pilot controls whose noise hides their steps. Such a control seems to move all the time, and every
//! step of a surface would then count as commanded by the pilot. It is left out as if it were not
//! recorded; surfaces stand for it.

use std::borrow::Cow;

use super::problems::at_place;
use super::settings::Settings;
use super::steps::detection::level_noise;
use crate::error::Problem;
use crate::flight::Record;

/// The record without the pilot's controls whose smallest step is within their noise, and a problem
/// for each of them.
pub(super) fn without_noisy_controls<'r>(
    record: &'r Record,
    settings: &Settings,
) -> (Cow<'r, Record>, Vec<Problem>) {
    let noisy: Vec<(&String, f64)> = settings
        .pilot_controls
        .iter()
        .filter_map(|control| Some((control, hidden_size(record, control, settings)?)))
        .collect();
    if noisy.is_empty() {
        return (Cow::Borrowed(record), Vec::new());
    }
    let mut others = record.clone();
    others
        .signals
        .retain(|name, _| !noisy.iter().any(|(control, _)| *control == name));
    let problem = |(control, hidden): &(&String, f64)| {
        let reason = format!(
            "its noise hides steps of less than {hidden:.2} of `{control}`, and {:.2} is a step (segment: steps). \
             The control is left out; steps of surfaces stand for the pilot's",
            settings.steps[*control]
        );
        at_place(record, (*control).clone(), reason)
    };
    let problems = noisy.iter().map(problem).collect();
    (Cow::Owned(others), problems)
}

/// Size of the steps of a control that its noise hides; `None` if that is less than its smallest step.
fn hidden_size(record: &Record, control: &str, settings: &Settings) -> Option<f64> {
    let smallest = settings.steps.get(control)?;
    let hidden = settings.steps_over_noise * level_noise(record, control, settings)?;
    (hidden > *smallest).then_some(hidden)
}
