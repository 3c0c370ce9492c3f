//! Pilot controls whose noise hides their steps. Such a control seems to move all the time, and every
//! step of a surface would then count as commanded by the pilot. It is left out as if it were not
//! recorded; surfaces stand for it.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::problems::at_place;
use super::settings::Settings;
use super::steps::detection::level_noise;
use crate::error::Problem;
use crate::flight::Record;

/// Standard deviation of each recorded control's changes between levels that its noise causes.
pub(super) type ControlNoise<'a> = BTreeMap<&'a str, f64>;

pub(super) fn control_noise<'a>(record: &Record, settings: &'a Settings) -> ControlNoise<'a> {
    let controls = settings.pilot_controls.iter();
    let noise = |control| level_noise(record, control, settings);
    controls
        .filter_map(|control| Some((control.as_str(), noise(control)?)))
        .collect()
}

/// The record without the pilot's controls whose smallest step is within their noise, and a problem
/// for each of them.
pub(super) fn without_noisy_controls<'r>(
    record: &'r Record,
    settings: &Settings,
    noise: &ControlNoise,
) -> (Cow<'r, Record>, Vec<Problem>) {
    let (mut others, mut problems) = (Cow::Borrowed(record), Vec::new());
    for (control, noise) in noise {
        let hidden = settings.steps_over_noise * noise;
        let Some(smallest) = settings.steps.get(*control).filter(|step| hidden > **step) else {
            continue;
        };
        others.to_mut().signals.remove(*control);
        let reason = format!(
            "its noise hides steps of less than {hidden:.2} of `{control}`, and {smallest:.2} is a step (segment: steps). \
             The control is left out; steps of surfaces stand for the pilot's"
        );
        problems.push(at_place(record, (*control).to_owned(), reason));
    }
    (others, problems)
}
