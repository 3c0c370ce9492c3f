//! Checks of a configuration beyond its types, file by file: names resolve, units fit, numbers are in range,
//! nothing is missing.

mod aircraft;
mod build_up;
mod classes;
mod flying_qualities;
mod match_tolerances;
mod names;
mod numbers;
mod ranges;
mod stages;

pub(crate) use ranges::of_cards as cards_in_range;

use std::collections::BTreeMap;

use super::checked::Config;
use super::instruments::InstrumentErrors;
use super::source::Files;
use crate::error::Result;

/// Checks all files against each other, and the numbers of each.
pub(super) fn whole(
    config: &Config,
    files: &Files,
    instruments: &BTreeMap<String, InstrumentErrors>,
) -> Result<()> {
    aircraft::geometry(config, &files.aircraft)?;
    aircraft::channels(config, &files.aircraft)?;
    build_up::aero_model(config, &files.model)?;
    for (class, source) in config.classes.iter().zip(&files.classes) {
        classes::class(config, class, source)?;
    }
    stages::stages(config, &files.pipeline)?;
    flying_qualities::check(config, files)?;
    match_tolerances::check(config, files)?;
    aircraft::instruments(instruments, config, &files.aircraft)?;
    if let Some(what) = config.no_class_left() {
        return Err(files.aircraft.error("channels", what));
    }
    let without_ranges = [&files.aircraft, &files.model].into_iter();
    let specifications = files.qualities.iter().chain(&files.proof_of_match);
    without_ranges
        .chain(specifications)
        .try_for_each(ranges::are_finite)?;
    ranges::of_pipeline(&files.pipeline)?;
    files.classes.iter().try_for_each(ranges::of_class)
}
