//! Character of a channel over a spell of samples: update rate, noise, quantisation, and the length
//! from which an unchanged run counts as stuck.
//!
//! A spell is a fixed number of samples. The character of a channel therefore does not depend on
//! the pieces in which a flight is read. If a spell does not decide, the character of the previous
//! spell stays.

use super::quantisation::quantisation;
use super::repeats::{StuckRun, stuck_run};
use super::spikes;
use super::update_rate::UpdateRate;
use crate::ingest::settings::Stuck;

/// Samples of a spell: some minutes of a usual recorder, long enough for statistics, short against
/// a flight.
pub const SPELL: usize = 1 << 14;

/// Character of a channel over one spell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Character {
    pub rate: UpdateRate,
    /// Level that a spike is compared with: the standard deviation of the noise or of the rounding,
    /// whichever is larger.
    pub noise_floor: f64,
    /// Standard deviation of the noise, in the signal's unit.
    pub noise: f64,
    /// Quantisation step, where the values have one.
    pub quantisation: Option<f64>,
    /// Number of equal recorded values in a row from which the channel is stuck.
    pub stuck_run: Option<usize>,
}

impl Character {
    /// Character before the first spell.
    pub const UNKNOWN: Character = Character {
        rate: UpdateRate::FULL,
        noise_floor: 0.0,
        noise: f64::NAN,
        quantisation: None,
        stuck_run: None,
    };

    /// Character of a spell that begins at sample `first`, after a spell with character `before`.
    pub fn of(
        values: &[f64],
        first: usize,
        step_s: f64,
        before: &Character,
        settings: &Stuck,
    ) -> Character {
        let rate = UpdateRate::infer(values, first).unwrap_or(before.rate);
        let own: Vec<f64>;
        let recorded = if rate == UpdateRate::FULL {
            values
        } else {
            own = rate.recorded(values, first).map(|(_, v)| v).collect();
            &own
        };
        let (noise_floor, noise) = spikes::noise_levels(recorded);
        let quantisation = quantisation(recorded);
        let noise_floor = noise_floor.max(0.5 * quantisation.unwrap_or(0.0));
        let stuck_run = if settings.find {
            match stuck_run(recorded, step_s * rate.period as f64, settings) {
                StuckRun::AtLeast(samples) => Some(samples),
                StuckRun::Never => None,
                StuckRun::Undecided => before.stuck_run,
            }
        } else {
            None
        };
        Character {
            rate,
            noise_floor,
            noise,
            quantisation,
            stuck_run,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: usize = SPELL / 2;

    /// Uniform noise between −1 and 1, the same on every run.
    fn noise(k: usize) -> f64 {
        let mut state = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        state = (state ^ (state >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn spell(value: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..SPELL).map(value).collect()
    }

    fn character(values: &[f64]) -> Character {
        Character::of(values, 0, 0.025, &Character::UNKNOWN, &Stuck::default())
    }

    #[test]
    fn a_rate_is_known_by_nulls_or_by_repeated_values() {
        let nulls = spell(|k| if k % 4 == 3 { noise(k) } else { f64::NAN });
        assert_eq!(
            character(&nulls).rate,
            UpdateRate {
                period: 4,
                held_phase: None
            }
        );
        let held = spell(|k| noise((k + 5) / 8));
        assert_eq!(
            character(&held).rate,
            UpdateRate {
                period: 8,
                held_phase: Some(3)
            }
        );
        let lost = spell(|k| if k % 97 == 5 { f64::NAN } else { noise(k) });
        assert_eq!(character(&lost).rate, UpdateRate::FULL);
    }

    #[test]
    fn a_coarse_channel_that_changes_at_equal_distances_is_at_full_rate() {
        assert_eq!(
            character(&spell(|k| (k / 400) as f64)).rate,
            UpdateRate::FULL
        );
    }

    #[test]
    fn quantisation_is_the_step_of_the_numbers() {
        let coarse = character(&spell(|k| (20.0 * noise(k)).round() * 0.02 + 7.0));
        assert!((coarse.quantisation.unwrap() - 0.02).abs() < 1e-9);
        assert_eq!(character(&spell(noise)).quantisation, None);
    }

    #[test]
    fn only_noise_makes_a_stand_still_suspicious() {
        let rounded = |k: usize, by: f64| (noise(k) / by).round() * by;
        let noisy = character(&spell(|k| rounded(k, 0.2)));
        assert!(
            noisy.stuck_run.is_some_and(|n| (40..80).contains(&n)),
            "{noisy:?}"
        );
        assert_eq!(character(&spell(|k| rounded(k, 2.5))).stuck_run, None);
        assert_eq!(
            character(&spell(|k| (k as f64 * 0.01).sin())).stuck_run,
            None
        );
        // A spell that is stuck throughout is like the one before.
        let after = Character::of(&spell(|_| 3.0), SPELL, 0.025, &noisy, &Stuck::default());
        assert_eq!(after.stuck_run, noisy.stuck_run);
        let often = spell(|k| if k % 1000 < 100 { 0.4 } else { rounded(k, 0.2) });
        assert_eq!(character(&often).stuck_run, None);
        let once = spell(|k| {
            if (HALF..HALF + 100).contains(&k) {
                0.4
            } else {
                rounded(k, 0.2)
            }
        });
        assert!(character(&once).stuck_run.is_some());
        // Where nothing was recorded between the test points, nothing stands still.
        let points = spell(|k| {
            if k % 2000 < 1200 {
                f64::NAN
            } else {
                rounded(k, 0.2)
            }
        });
        assert_eq!(character(&points).stuck_run, noisy.stuck_run);
    }
}
