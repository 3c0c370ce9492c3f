//! Check of the engines' channels, which no kinematic relation contains.

use super::block_means::BlockMeans;
use crate::flight::signal;
use crate::units::G0_FT_S2;

/// Signals of the engines.
pub const ENGINE_SIGNALS: [&str; 3] = [signal::THRUST, signal::RPM_LEFT, signal::RPM_RIGHT];

/// Largest median change from one block of a fifth of a second to the next, as a share of the median.
/// An engine takes seconds from idle to its maximum, and rests most of the time. White noise reaches the
/// share with a deviation of half the median; below that the bounds of the derivatives contain it.
const LIVELIEST_SHARE: f64 = 0.2;

/// Change of the thrust that no derivative shows, as a share of the weight.
const SMALL_SHARE_OF_WEIGHT: f64 = 0.01;

/// Change of the rotational speed that no derivative shows, rpm: a hundredth of a jet engine's.
const SMALL_RPM: f64 = 100.0;

/// Finds a signal of an engine that is nothing but noise, and not by small changes about zero.
pub fn unusable_engine_signal(blocks: &BlockMeans, name: &str) -> Option<String> {
    let size = blocks.median(name)?.abs();
    let small = if name == signal::THRUST {
        SMALL_SHARE_OF_WEIGHT * G0_FT_S2 * blocks.median(signal::MASS)?
    } else {
        SMALL_RPM
    };
    let typical = blocks.median_change(name)?;
    (typical > small.max(LIVELIEST_SHARE * size)).then(|| {
        format!(
            "it changes by {typical:.0} from one {:.1} s to the next, and its median is {size:.0}: it is nothing \
             but noise",
            blocks.block_s
        )
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::block_means::BlockAverager;
    use super::*;
    use crate::ingest::settings::Checks;
    use crate::numerics::statistics::random::RandomStream;

    const BLOCKS: usize = 500;
    const SAMPLES_PER_BLOCK: usize = 8;

    fn reason(mut thrust: impl FnMut(usize) -> f64) -> Option<String> {
        let settings = Checks::default();
        let step_s = settings.block_s / SAMPLES_PER_BLOCK as f64;
        let mut averager = BlockAverager::of(signal::THRUST, step_s, &settings)?;
        let samples = BLOCKS * SAMPLES_PER_BLOCK;
        (0..samples).for_each(|k| averager.push(&[thrust(k)]));
        let mass = BlockAverager::constant(signal::MASS, 1_000.0, samples, step_s, &settings)?;
        let means = BTreeMap::from([
            (signal::THRUST.to_owned(), averager),
            (signal::MASS.to_owned(), mass),
        ]);
        let blocks = BlockMeans::of(means, samples, step_s, &settings);
        unusable_engine_signal(&blocks, signal::THRUST)
    }

    #[test]
    fn a_thrust_of_noise_is_found_and_a_live_engine_is_not() {
        let mut random = RandomStream::new(4, "thrust");
        let mut noisy = |share: f64| reason(|_| 9_000.0 * (1.0 + share * random.normal()));
        assert!(noisy(1.0).is_some_and(|reason| reason.contains("nothing but noise")));
        assert_eq!(noisy(0.2), None);
        // From idle to the maximum and back, all the time, in periods of six seconds.
        assert_eq!(
            reason(|k| 6_000.0 + 5_000.0 * (k as f64 / 40.0).sin()),
            None
        );
        let mut idle = RandomStream::new(5, "idle");
        assert_eq!(reason(|_| 10.0 * idle.normal()), None);
        assert_eq!(reason(|_| f64::NAN), None);
    }
}
