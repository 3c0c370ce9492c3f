//! Does the iteration find the same minimum from elsewhere? The same record is estimated from the
//! true values, from values off by a factor of two, and from surfaces without effect.

use rayon::prelude::*;

use super::recordings::{Setting, Subject, tunnel_of_truth};
use crate::aero::{Buildup, WindTunnel};
use crate::estimate::{self, Basis, Estimated, Start};
use crate::lab::simulator::noise::seed_of;
use crate::lab::simulator::{Flown, TrueDerivative};
use crate::output_error::Outcome;
use crate::tables::{EstimateRow, StartRow, StartingValues};

/// The minimum is the same when no derivative differs by more than this share of its bound.
const SAME: f64 = 0.1;

/// What the true values are changed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum From {
    Double,
    Half,
    NoSurfaces,
}

impl From {
    fn name(self) -> &'static str {
        match self {
            From::Double => "twice the truth",
            From::Half => "half the truth",
            From::NoSurfaces => "surfaces without effect",
        }
    }

    fn table(self, flown: &Flown, buildup: &Buildup) -> WindTunnel {
        let surface = |name: &str| {
            buildup
                .derivatives
                .iter()
                .any(|d| d.name == name && d.regressor.surface().is_some())
        };
        let factor = |t: &TrueDerivative| match self {
            From::Double => 2.0,
            From::Half => 0.5,
            From::NoSurfaces => f64::from(u8::from(!surface(&t.derivative))),
        };
        let truth = flown
            .truth
            .iter()
            .map(|t| TrueDerivative {
                value: factor(t) * t.value,
                ..t.clone()
            })
            .collect();
        tunnel_of_truth(&Flown {
            truth,
            ..flown.clone()
        })
    }
}

/// A row per kind of start, over `realisations` records.
#[must_use]
pub fn starts(
    subject: &Subject,
    setting: Setting,
    realisations: usize,
    seed: u64,
) -> Vec<StartRow> {
    let truth = tunnel_of_truth(subject.flown);
    let reached = |from: From| -> Vec<(bool, bool)> {
        let elsewhere = from.table(subject.flown, subject.basis.buildup);
        let one = |i: usize| {
            let seed = seed_of(seed, &format!("start {i}"));
            let reference = subject.from(&truth, setting, seed);
            let found = subject.from(&elsewhere, setting, seed);
            let same = same(&reference, &found);
            (
                same && found.fit.start == Some(StartingValues::WindTunnel),
                same,
            )
        };
        (0..realisations).into_par_iter().map(one).collect()
    };
    let row = |from: From| {
        let reached = reached(from);
        StartRow {
            class: subject.class.name.clone(),
            alpha_deg: subject.flown.maneuver.alpha_deg,
            start: from.name().to_owned(),
            records: realisations,
            alone: reached.iter().filter(|r| r.0).count(),
            reached: reached.iter().filter(|r| r.1).count(),
        }
    };
    [From::Double, From::Half, From::NoSurfaces].map(row).into()
}

impl Subject<'_> {
    /// The estimate from one record whose iteration starts from the values of a table.
    fn from(&self, start: &WindTunnel, setting: Setting, seed: u64) -> Estimated {
        let settings = estimate::Settings {
            start: Start::WindTunnel,
            ..self.basis.settings.clone()
        };
        let basis = Basis {
            settings: &settings,
            start,
            ..self.basis
        };
        Subject {
            basis,
            ..self.clone()
        }
        .estimate(setting, seed)
    }
}

fn same(a: &Estimated, b: &Estimated) -> bool {
    let converged = |e: &Estimated| e.fit.outcome == Outcome::Converged;
    let near = |(a, b): (&EstimateRow, &EstimateRow)| match (a.value, b.value, a.bound) {
        (Some(at), Some(found), Some(bound)) => (at - found).abs() <= SAME * bound,
        // Held, or inactive.
        (at, found, _) => at == found,
    };
    converged(a) && converged(b) && a.estimates.iter().zip(&b.estimates).all(near)
}
