//! Experience with each class in the campaign: the share of usable maneuvers, their weight in the
//! posterior, and their noise relative to simulated maneuvers.

use std::collections::BTreeMap;

use crate::estimate::Covariance;
use crate::maneuver::Maneuver;
use crate::numerics::statistics::mean::finite_mean;
use crate::numerics::statistics::order_statistics::median;
use crate::output_error::error_effect::{ErrorEffect, SharedError};
use crate::tables::{ContributionRow, FitRow, Outcome};

/// Number of maneuvers for which the campaign's share counts in the mean with the class's own
/// maneuvers.
const PRIOR_MANEUVERS: f64 = 2.0;

/// Maneuvers of the campaign with their results, in one order.
#[derive(Clone, Copy, Debug)]
pub struct CampaignHistory<'a> {
    pub maneuvers: &'a [Maneuver],
    pub fits: &'a [FitRow],
    pub covariances: &'a [Option<Covariance>],
    pub contributions: &'a [ContributionRow],
}

/// Experience with one class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    /// Share of its maneuvers that converge.
    pub usable: f64,
    /// Mean weight of its maneuvers in the posterior.
    pub weight: f64,
    /// Colour of the noise: median ratio of the corrected variance to Cramér and Rao's, both
    /// without errors that maneuvers share; `None` without a converged maneuver.
    pub colour: Option<f64>,
}

impl CampaignHistory<'_> {
    /// Experience with a class. The share of usable maneuvers is averaged with the campaign's, as
    /// if of two maneuvers. Weight and colour are the campaign's if the class has none.
    #[must_use]
    pub fn of(&self, class: &str) -> Experience {
        let (usable, flown) = self.usable(Some(class));
        let (of_all, all) = self.usable(None);
        // One more maneuver counts as converged: without any maneuver a card is expected to
        // succeed.
        let ordinary = (of_all + 1.0) / (all + 1.0);
        Experience {
            usable: (usable + PRIOR_MANEUVERS * ordinary) / (flown + PRIOR_MANEUVERS),
            weight: self
                .weight(Some(class))
                .or_else(|| self.weight(None))
                .unwrap_or(1.0),
            colour: self.colour(Some(class)).or_else(|| self.colour(None)),
        }
    }

    /// Number of maneuvers that converged, and of all.
    fn usable(&self, class: Option<&str>) -> (f64, f64) {
        let own = self.maneuvers.iter().zip(self.fits);
        let own = own.filter(|(m, _)| class.is_none_or(|class| m.class == class));
        let all: Vec<bool> = own
            .map(|(_, fit)| fit.outcome == Outcome::Converged)
            .collect();
        let usable = all.iter().filter(|is_usable| **is_usable).count();
        (usable as f64, all.len() as f64)
    }

    fn weight(&self, class: Option<&str>) -> Option<f64> {
        let rows = self.contributions.iter();
        let own = rows.filter(|row| class.is_none_or(|class| row.class == class));
        finite_mean(own.map(|row| row.weight))
    }

    fn colour(&self, class: Option<&str>) -> Option<f64> {
        let all = self.maneuvers.iter().zip(self.fits).zip(self.covariances);
        let own = all.filter(|((m, fit), _)| {
            fit.outcome == Outcome::Converged && class.is_none_or(|class| m.class == class)
        });
        median(own.filter_map(|(_, covariance)| colour(covariance.as_ref()?)))
    }
}

/// Colour of the noise: median, over the parameters, of the ratio of the corrected variance to
/// Cramér and Rao's. Both are without errors that maneuvers share.
#[must_use]
pub fn colour(covariance: &Covariance) -> Option<f64> {
    let n = covariance.names.len();
    let held = |e: &&ErrorEffect| matches!(e.error, SharedError::Held(_));
    let square = |e: &ErrorEffect, i: usize| e.change[i] * e.change[i];
    let effects = || covariance.shared_errors.iter();
    median((0..n).filter_map(|i| {
        let of_held: f64 = effects().filter(held).map(|e| square(e, i)).sum();
        let of_all: f64 = effects().map(|e| square(e, i)).sum();
        let white = covariance.white.get(i * n + i)? - of_held;
        let corrected = covariance.corrected.get(i * n + i)? - of_all;
        (white > 0.0 && corrected > 0.0).then_some(corrected / white)
    }))
}

/// Covariance with its noise multiplied by a factor; errors that maneuvers share stay as they are.
#[must_use]
pub fn with_noise(covariance: &Covariance, factor: f64) -> Covariance {
    let n = covariance.names.len();
    let mut corrected = covariance.corrected.clone();
    for (k, value) in corrected.iter_mut().enumerate() {
        let (i, j) = (k / n, k % n);
        let effects = covariance.shared_errors.iter();
        let shared: f64 = effects.map(|e| e.change[i] * e.change[j]).sum();
        *value = factor * (*value - shared) + shared;
    }
    Covariance {
        corrected,
        ..covariance.clone()
    }
}

/// Factor by which the campaign's maneuvers of each class are noisier than simulated ones: the
/// ratio of their colours. It is one for a class that lacks either colour.
#[must_use]
pub fn noise_factors<'a>(
    history: &CampaignHistory,
    simulated: impl IntoIterator<Item = (&'a str, &'a Covariance)>,
) -> BTreeMap<&'a str, f64> {
    let mut colours: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (class, covariance) in simulated {
        colours.entry(class).or_default().extend(colour(covariance));
    }
    let factor = |class: &str, own: Vec<f64>| {
        let flown = history.of(class).colour;
        flown
            .zip(median(own))
            .map_or(1.0, |(flown, own)| flown / own)
    };
    let classes = colours.into_iter();
    classes
        .map(|(class, own)| (class, factor(class, own)))
        .collect()
}
