//! Surfaces in place of pilot controls that a record lacks.
//!
//! A surface that is geared to a control steps with it. A class that the pilot flies can therefore
//! be recognised by the steps of the surfaces whose derivatives it estimates.

use std::collections::BTreeSet;

use crate::flight::Record;
use crate::maneuver::class::StepCount;
use crate::maneuver::{Class, Recognition};
use crate::segment::settings::Settings;

/// Classes with the steps of surfaces in place of those of the pilot's controls that the record
/// lacks.
pub(in crate::segment) fn with_surfaces_for_controls(
    record: &Record,
    classes: &[Class],
    settings: &Settings,
) -> Vec<Class> {
    let lacks = |control: &String| {
        let values = record.values(control).unwrap_or_default();
        settings.pilot_controls.contains(control) && !values.iter().any(|v| v.is_finite())
    };
    let mut classes = classes.to_vec();
    for class in &mut classes {
        let recognition = &mut class.recognition;
        let lacking: BTreeSet<String> = recognition
            .steps
            .keys()
            .filter(|c| lacks(c))
            .cloned()
            .collect();
        if lacking
            .iter()
            .any(|control| recognition.steps[control].at_least > 0)
        {
            replace_controls(recognition, &lacking);
        }
    }
    classes
}

/// Replaces the steps of controls. Several controls move several surfaces: each steps as often as the
/// control that steps least, and at most as often as all together.
fn replace_controls(recognition: &mut Recognition, controls: &BTreeSet<String>) {
    let counts = controls.iter().filter_map(|c| recognition.steps.get(c));
    let commanded: Vec<StepCount> = counts.filter(|c| c.at_least > 0).copied().collect();
    let least = commanded.iter().map(|c| c.at_least).min().unwrap_or(0);
    let most = commanded
        .iter()
        .fold(0_usize, |sum, c| sum.saturating_add(c.at_most));
    recognition.steps.retain(|name, _| !controls.contains(name));
    for surface in recognition.surfaces.clone() {
        let count = StepCount {
            at_least: least,
            at_most: most,
        };
        recognition.steps.entry(surface).or_insert(count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_surface_of_the_class_steps_as_the_controls_do() {
        let count = |at_least, at_most| StepCount { at_least, at_most };
        let mut recognition = Recognition {
            steps: [
                ("pedal_in".to_owned(), count(4, 8)),
                ("stick_lat_in".to_owned(), count(5, 6)),
                ("dsa_deg".to_owned(), count(0, 2)),
            ]
            .into(),
            surfaces: vec!["da_deg".to_owned(), "dr_deg".to_owned()],
            ..Recognition::default()
        };
        let controls = ["pedal_in".to_owned(), "stick_lat_in".to_owned()].into();
        replace_controls(&mut recognition, &controls);
        let steps: Vec<_> = recognition.steps.into_iter().collect();
        let expected = [("da_deg", 4, 14), ("dr_deg", 4, 14), ("dsa_deg", 0, 2)];
        let expected = expected.map(|(name, least, most)| (name.to_owned(), count(least, most)));
        assert_eq!(steps, expected);
    }
}
