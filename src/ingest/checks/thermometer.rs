//! Check of the temperature of the air, which no kinematic relation decides.

use super::block_means::BlockMeans;
use super::mass_properties::ImpossibleSignal;
use crate::flight::signal;

/// Temperatures of the air up to 100,000 ft, K, with a margin of 10 K beyond the extremes on record
/// (MIL-STD-210C: 184 to 331 K).
const AIR_KELVIN: std::ops::Range<f64> = 174.0..341.0;

/// Largest median change between consecutive blocks of 0.2 s, K. It is ten times the change in a
/// dive at 1,000 ft/s (2 K per 1,000 ft), and far above the noise of a thermometer.
const LIVELIEST_KELVIN: f64 = 4.0;

/// Change of altitude from which the temperature must change, ft: 6 K of the standard atmosphere. An
/// inversion may keep it over a smaller one.
const CLIMB_FT: f64 = 3_000.0;

/// Altitude above which the temperature of the standard atmosphere is constant, ft, with a margin.
const LOWER_STRATOSPHERE_FT: f64 = 30_000.0;

/// Finds a recorded temperature that cannot be used: by its size, by its noise, or because it stays in a
/// climb.
pub fn unusable_temperature(blocks: &BlockMeans) -> Option<String> {
    wrong_size(blocks)
        .or_else(|| nothing_but_noise(blocks))
        .or_else(|| unchanged_in_a_climb(blocks))
}

/// Finds a temperature that no air has.
pub fn impossible_temperature(blocks: &BlockMeans) -> Option<ImpossibleSignal> {
    Some(ImpossibleSignal {
        signal: signal::AIR_TEMPERATURE,
        reason: wrong_size(blocks)?,
    })
}

fn wrong_size(blocks: &BlockMeans) -> Option<String> {
    let median = blocks.median(signal::AIR_TEMPERATURE);
    let median = median.filter(|k| !AIR_KELVIN.contains(k))?;
    Some(format!(
        "its median is {median:.1} K, and air has {} to {} K: is it in degC or degF?",
        AIR_KELVIN.start, AIR_KELVIN.end
    ))
}

fn nothing_but_noise(blocks: &BlockMeans) -> Option<String> {
    let median = blocks.median_change(signal::AIR_TEMPERATURE)?;
    (median > LIVELIEST_KELVIN).then(|| {
        format!(
            "it changes by {median:.1} K from one {:.1} s to the next: it is nothing but noise",
            blocks.block_s
        )
    })
}

fn unchanged_in_a_climb(blocks: &BlockMeans) -> Option<String> {
    let altitudes = blocks.means_of(signal::ALTITUDE);
    let altitudes = (0..blocks.count).map(|block| altitudes.mean(block));
    let (low, high) = altitudes
        .filter(|altitude| *altitude < LOWER_STRATOSPHERE_FT)
        .fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(low, high), altitude| (low.min(altitude), high.max(altitude)),
        );
    let is_unchanged =
        blocks.has(signal::AIR_TEMPERATURE) && blocks.is_constant(signal::AIR_TEMPERATURE);
    (is_unchanged && high - low > CLIMB_FT).then(|| {
        format!(
            "it never changes, while the altitude changes by {:.0} ft",
            high - low
        )
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::block_means::BlockAverager;
    use super::*;
    use crate::ingest::settings::Checks;

    const BLOCKS: usize = 100;

    /// Reason against a temperature in a climb by so many feet from 10,000 ft.
    fn reason(climb_ft: f64, kelvin: impl Fn(usize) -> f64) -> Option<String> {
        let settings = Checks::default();
        let step_s = settings.block_s;
        let averager = |signal: &str, value: &dyn Fn(usize) -> f64| {
            let mut averager = BlockAverager::of(signal, step_s, &settings).unwrap();
            (0..BLOCKS).for_each(|k| averager.push(&[value(k)]));
            (signal.to_owned(), averager)
        };
        let altitude = |k: usize| 10_000.0 + climb_ft * k as f64 / BLOCKS as f64;
        let means = BTreeMap::from([
            averager(signal::AIR_TEMPERATURE, &kelvin),
            averager(signal::ALTITUDE, &altitude),
        ]);
        let blocks = BlockMeans::of(means, BLOCKS, step_s, &settings);
        unusable_temperature(&blocks)
    }

    #[test]
    fn a_temperature_that_no_air_has_is_found_by_size_noise_and_rest() {
        let lapse = |k: usize| 268.0 - 0.1 * k as f64;
        assert_eq!(reason(5_000.0, lapse), None);
        assert_eq!(reason(500.0, |_| 268.0), None);
        let celsius = reason(5_000.0, |k| lapse(k) - 273.15).unwrap();
        assert!(celsius.contains("degC"), "{celsius}");
        let noise = reason(500.0, |k| 260.0 + 20.0 * f64::sin(1e3 * (k * k) as f64));
        assert!(noise.unwrap().contains("nothing but noise"));
        let stuck = reason(5_000.0, |_| 288.15).unwrap();
        assert!(stuck.contains("it never changes"), "{stuck}");
    }
}
