//! Corrections of the surfaces' delays, and their remaining uncertainty.

use serde::{Deserialize, Serialize};

use super::evidence::SurfaceDelay;
use super::settings::Settings;
use crate::flight::Correction;
use crate::ingest::compatibility::Action;

/// Step of the grid to which the corrections are rounded, s. A correction affects every estimate of
/// the campaign. A further flight that changes a delay by less than a step therefore leaves all
/// estimates as they are. The rounding is part of the remaining uncertainty.
const GRID_S: f64 = 5e-4;

/// Steps to which the remaining uncertainty is rounded up, s, each √2 times the one before. A bound
/// falls with the root of the number of flights, so the uncertainty stays on one step until the
/// number of flights has doubled.
const UNCERTAINTIES_S: [f64; 16] = [
    0.5e-3, 0.7e-3, 1e-3, 1.4e-3, 2e-3, 2.8e-3, 4e-3, 5.6e-3, 8e-3, 11e-3, 16e-3, 23e-3, 32e-3,
    45e-3, 64e-3, 90e-3,
];

/// Bound above which the campaign does not determine a surface's delay, s: a recorder's usual delay
/// is no larger.
const UNDETERMINED_S: f64 = 5e-3;

/// Correction of a surface's delay in every maneuver of the campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DelayCorrection {
    pub surface: String,
    /// Delay by which the surface is shifted; zero for a delay that is not certain.
    pub delay_s: f64,
    /// Standard deviation of the remaining delay.
    pub uncertainty_s: f64,
}

impl DelayCorrection {
    /// Correction of the record; `None` for a surface that stays as recorded.
    #[must_use]
    pub fn of_record(&self) -> Option<Correction> {
        (self.delay_s != 0.0).then(|| Correction::of_delay(&self.surface, self.delay_s))
    }
}

impl SurfaceDelay {
    /// `true` if the data determine the delay.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        self.bound_s <= UNDETERMINED_S
    }
}

/// Corrections of a campaign's surfaces.
#[must_use]
pub fn corrections(delays: &[SurfaceDelay], settings: &Settings) -> Vec<DelayCorrection> {
    delays.iter().map(|d| correction(d, settings)).collect()
}

fn correction(delay: &SurfaceDelay, settings: &Settings) -> DelayCorrection {
    let size_s = delay.delay_s.abs();
    let is_sure = delay.is_determined()
        && size_s >= settings.least_delay_s
        && size_s >= settings.standard_errors * delay.bound_s;
    let applied_s = if is_sure && settings.delay == Action::Apply {
        GRID_S * (delay.delay_s / GRID_S).round()
    } else {
        0.0
    };
    let uncertainty_s = if delay.is_determined() {
        delay.bound_s.hypot(delay.delay_s - applied_s)
    } else {
        settings.least_delay_s
    };
    DelayCorrection {
        surface: delay.surface.clone(),
        delay_s: applied_s,
        uncertainty_s: stepped_s(uncertainty_s),
    }
}

/// Smallest step of the remaining uncertainty that is not below a value.
fn stepped_s(uncertainty_s: f64) -> f64 {
    let steps = UNCERTAINTIES_S.into_iter();
    let larger = steps.clone().find(|step| *step >= uncertainty_s);
    larger.or(steps.last()).unwrap_or(uncertainty_s)
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    fn corrected(delay_ms: f64, bound_ms: f64, settings: &Settings) -> (f64, f64) {
        let delay = SurfaceDelay {
            surface: "da".to_owned(),
            delay_s: 1e-3 * delay_ms,
            bound_s: 1e-3 * bound_ms,
        };
        let correction = correction(&delay, settings);
        (1e3 * correction.delay_s, 1e3 * correction.uncertainty_s)
    }

    fn assert_corrected(given: (f64, f64), expected: (f64, f64), settings: &Settings) {
        let found = corrected(given.0, given.1, settings);
        assert_abs_diff_eq!(found.0, expected.0, epsilon = 1e-9);
        assert_abs_diff_eq!(found.1, expected.1, epsilon = 1e-9);
    }

    #[test]
    fn a_sure_delay_is_corrected_on_the_grid_and_its_bound_stays() {
        let settings = Settings::default();
        assert_corrected((10.2, 0.5), (10.0, 0.7), &settings);
        assert_corrected((-8.9, 0.9), (-9.0, 1.0), &settings);
    }

    #[test]
    fn a_small_or_doubtful_delay_stays_and_counts_as_unknown() {
        let settings = Settings::default();
        assert_corrected((2.9, 0.5), (0.0, 4.0), &settings);
        assert_corrected((3.9, 1.0), (0.0, 5.6), &settings);
    }

    #[test]
    fn an_undetermined_delay_has_the_size_of_an_ordinary_one() {
        assert_corrected((40.0, 9.0), (0.0, 4.0), &Settings::default());
    }

    #[test]
    fn report_corrects_nothing() {
        let report = Settings {
            delay: Action::Report,
            ..Settings::default()
        };
        assert_corrected((10.2, 0.5), (0.0, 11.0), &report);
    }

    #[test]
    fn a_further_flight_within_the_grid_changes_nothing() {
        let settings = Settings::default();
        assert_eq!(
            corrected(10.05, 0.55, &settings),
            corrected(10.11, 0.54, &settings)
        );
    }
}
