//! Outcome of each kinematic relation in one flight: slope, correlation and verdict.

use std::collections::BTreeSet;

use super::block_means::BlockMeans;
use super::disturbance::{Disturbance, disturbance};
use super::gusts::Gusts;
use super::line_fit::{LineFit, fit};
use super::relations::{self, GustEffect, Relation, Selection};
use super::window_selection::{find_jumps, select_excited};
use super::windows::{WindowPair, relation_pairs};
use crate::aircraft::Aircraft;
use crate::ingest::settings::Checks;
use crate::tables::{CheckRow, CheckVerdict};

/// Smallest change of the gust velocity at which a relation that gusts excite is checked, ft/s². It
/// is that of turbulence of 1 ft/s, ten times the apparent value in still air.
const LEAST_GUST_FT_S2: f64 = 0.75;

/// Error of a relation that biases may cause, as a share of the level above which it counts as
/// excited. The levels of [`crate::ingest::Excitation`] are twice that error.
const BIAS_SHARE: f64 = 0.5;

/// Least number of windows from which a slope has a standard error.
const LEAST_FOR_FIT: usize = 2;

/// Outcome of one relation in one flight.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    pub relation: Relation,
    pub verdict: CheckVerdict,
    pub fit: Option<LineFit>,
    /// Number of windows in which the record jumps.
    pub jumps: usize,
}

impl Check {
    pub fn row(&self, flight_id: &str) -> CheckRow {
        CheckRow {
            flight_id: flight_id.to_owned(),
            relation: self.relation.name.to_owned(),
            signals: self.relation.signals.join(" "),
            slope: self.fit.map(|f| f.slope),
            correlation: self.fit.map(|f| f.correlation),
            verdict: self.verdict,
        }
    }
}

/// Checks all relations whose signals the record has, with the gusts that disturb them.
pub fn check_relations(
    blocks: &BlockMeans,
    aircraft: &Aircraft,
    settings: &Checks,
) -> (Vec<Check>, Gusts) {
    let relations = relations::recorded(blocks, settings);
    let pairs = relation_pairs(&relations, blocks, aircraft, settings);
    let gusts = Gusts::of(&relations, &pairs, (blocks.block_s, settings.window_s));
    let windows: Vec<RelationWindows> = relations
        .into_iter()
        .zip(pairs)
        .map(|(relation, pairs)| RelationWindows::of(relation, pairs.windows, &gusts, settings))
        .collect();
    // A relation that gusts excite mistakes a maneuver for a jump.
    let jumped: BTreeSet<usize> = windows
        .iter()
        .filter(|w| w.relation.gusts != GustEffect::Excite)
        .flat_map(|w| &w.jumps)
        .copied()
        .collect();
    let checks = windows.iter().map(|w| w.check(&jumped, settings));
    (checks.collect(), gusts)
}

/// Signals that some relation confirms.
pub fn confirmed_signals(checks: &[Check]) -> Vec<&'static str> {
    let good = checks.iter().filter(|c| c.verdict == CheckVerdict::Ok);
    good.flat_map(|c| c.relation.dominant()).copied().collect()
}

/// Windows in which a relation is compared.
struct RelationWindows {
    relation: Relation,
    /// Windows in which it is excited.
    pairs: Vec<WindowPair>,
    /// Numbers of the windows in which the record jumps.
    jumps: Vec<usize>,
    disturbance: Disturbance,
}

impl RelationWindows {
    fn of(
        relation: Relation,
        pairs: Vec<WindowPair>,
        gusts: &Gusts,
        settings: &Checks,
    ) -> RelationWindows {
        let disturbance = disturbance(&relation, &pairs, gusts);
        let is_blown = gusts.largest_change_ft_s2() > LEAST_GUST_FT_S2;
        let pairs = if relation.gusts == GustEffect::Excite && !is_blown {
            Vec::new()
        } else {
            select_excited(&relation, pairs, settings)
        };
        let jumps = find_jumps(&relation, &pairs, settings);
        RelationWindows {
            relation,
            pairs,
            jumps,
            disturbance,
        }
    }

    /// Checks the relation; `jumped` are the windows in which any relation finds a jump.
    ///
    /// A jump in one relation is in the record of all, so a relation that disagrees is checked
    /// again without the jumps of all. A wrong sign or unit also makes jumps, which must not hide
    /// it, so the relation is checked first without its own jumps only.
    fn check(&self, jumped: &BTreeSet<usize>, settings: &Checks) -> Check {
        let own = self.check_without(&self.jumps.iter().copied().collect(), settings);
        let disagrees = own.verdict == CheckVerdict::DoesNotAgree && own.fit.is_some();
        if disagrees {
            self.check_without(jumped, settings)
        } else {
            own
        }
    }

    /// Checks the relation without some windows.
    fn check_without(&self, left_out: &BTreeSet<usize>, settings: &Checks) -> Check {
        let pairs = self.pairs.iter();
        let pairs = pairs.filter(|p| !left_out.contains(&p.window));
        let pairs: Vec<WindowPair> = pairs.copied().collect();
        let is_excited = pairs.len() >= settings.least_windows.max(LEAST_FOR_FIT);
        let fit = is_excited.then(|| fit(&pairs, &self.pairs)).flatten();
        // A side of nothing but zeros has no slope. Where the other side exceeds a level, its
        // channel is dead.
        let verdict = match (fit, self.relation.selection) {
            (Some(fit), _) => verdict_of(&fit, &self.relation, self.disturbance, settings),
            (None, Selection::Above(_)) if is_excited => CheckVerdict::DoesNotAgree,
            (None, _) => CheckVerdict::NotExcited,
        };
        Check {
            relation: self.relation,
            verdict,
            fit,
            jumps: self.jumps.len(),
        }
    }
}

/// Verdict on a fit. The relation fails if the slope is wrong by several standard errors, and by
/// more than biases and gusts can cause. Correlation counts only if the windows are selected by a
/// level that noise does not reach, and only as far as gusts leave it.
fn verdict_of(
    fit: &LineFit,
    relation: &Relation,
    disturbance: Disturbance,
    settings: &Checks,
) -> CheckVerdict {
    let bias = BIAS_SHARE * relation.selection.level() / fit.predicted_rms;
    let gusts = disturbance.slope_error(fit.predicted_rms);
    let margin = settings.standard_errors * fit.standard_error + bias + gusts;
    let (low, high) = (fit.slope - margin, fit.slope + margin);
    let least_correlation = match relation.selection {
        Selection::Above(level) => {
            relation.correlation * disturbance.least_correlation(fit.predicted_rms, level)
        }
        Selection::Largest { .. } => 0.0,
    };
    if fit.correlation.abs() < least_correlation {
        CheckVerdict::DoesNotAgree
    } else if high < 0.0 {
        CheckVerdict::WrongSign
    } else if fit.slope < 0.0 {
        CheckVerdict::NotExcited
    } else if low > relation.slope_factor || high < 1.0 / relation.slope_factor {
        CheckVerdict::WrongScale
    } else if low <= 0.0 {
        CheckVerdict::NotExcited
    } else {
        CheckVerdict::Ok
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict_in(
        disturbance: Disturbance,
        selection: Selection,
        slope: f64,
        standard_error: f64,
        correlation: f64,
    ) -> CheckVerdict {
        let settings = Checks::default();
        let relation = Relation {
            selection,
            correlation: 0.5,
            ..relations::all(&settings)[0]
        };
        verdict_of(
            &LineFit {
                slope,
                standard_error,
                correlation,
                predicted_rms: 10.0,
                misfit: 0.1,
            },
            &relation,
            disturbance,
            &settings,
        )
    }

    fn verdict(
        selection: Selection,
        slope: f64,
        standard_error: f64,
        correlation: f64,
    ) -> CheckVerdict {
        let still = Disturbance::default();
        verdict_in(still, selection, slope, standard_error, correlation)
    }

    #[test]
    fn a_slope_that_gusts_may_make_is_no_fault_and_a_larger_error_is() {
        let gusts = |gust, response| Disturbance { gust, response };
        let level = Selection::Above(1.0);
        // The predicted side has an rms of 10: gusts of 20 turn its slope by 2 at most.
        let weak = gusts(20.0, f64::INFINITY);
        let of = |slope| verdict_in(weak, level, slope, 0.01, -0.1);
        assert_eq!(of(-1.0), CheckVerdict::NotExcited);
        assert_eq!(of(-9.8), CheckVerdict::WrongSign);
        assert_eq!(of(9.8), CheckVerdict::WrongScale);
        // Of the predicted side a tenth is response to gusts: they turn the slope by 0.2.
        let strong = |slope| verdict_in(gusts(20.0, 1.0), level, slope, 0.01, 0.4);
        assert_eq!(strong(-1.0), CheckVerdict::WrongSign);
        assert_eq!(strong(1.0), CheckVerdict::Ok);
        assert_eq!(verdict(level, 1.0, 0.01, 0.4), CheckVerdict::DoesNotAgree);
    }

    #[test]
    fn gusts_lower_the_correlation_that_a_right_relation_has() {
        let least = |gust, response| Disturbance { gust, response }.least_correlation(10.0, 5.0);
        assert!((least(0.0, 0.0) - 1.0).abs() < 1e-12);
        // Gusts beside a motion of maneuvers alone: 10/√(10² + 1).
        assert!((least(1.0, 0.0) - 10.0 / 101.0_f64.sqrt()).abs() < 1e-12);
        // From a third of the level on they select windows: 10/√(10² + 5²).
        assert!((least(2.0, 0.0) - 10.0 / 125.0_f64.sqrt()).abs() < 1e-12);
        // A response of 6 to gusts of 8: (100 − 48)/(10 √(100 − 96 + 64)).
        assert!((least(8.0, 6.0) - 52.0 / 6800.0_f64.sqrt()).abs() < 1e-12);
        // A response of the gusts' size leaves √(1 − 0.8²), a larger one nothing less.
        assert!((least(8.0, 9.0) - 0.6).abs() < 1e-12);
        assert!(least(20.0, f64::INFINITY).abs() < 1e-12);
        // A missing correlation is found in light gusts, but not in strong ones to which the
        // aircraft responds.
        let of = |gust, response| {
            let disturbance = Disturbance { gust, response };
            verdict_in(disturbance, Selection::Above(5.0), 0.9, 0.2, 0.3)
        };
        assert_eq!(of(2.0, 1.0), CheckVerdict::DoesNotAgree);
        assert_eq!(of(9.0, 9.0), CheckVerdict::NotExcited);
    }

    #[test]
    fn verdicts_need_several_standard_errors() {
        let level = Selection::Above(1.0);
        assert_eq!(verdict(level, 0.98, 0.01, 0.99), CheckVerdict::Ok);
        assert_eq!(verdict(level, -1.0, 0.01, -0.99), CheckVerdict::WrongSign);
        assert_eq!(verdict(level, 57.3, 0.5, 0.99), CheckVerdict::WrongScale);
        assert_eq!(verdict(level, 0.02, 0.001, 0.99), CheckVerdict::WrongScale);
        assert_eq!(verdict(level, 0.1, 0.1, 0.1), CheckVerdict::DoesNotAgree);
        assert_eq!(verdict(level, 0.6, 0.05, 0.8), CheckVerdict::Ok);
        let weak = Selection::Largest {
            share: 0.05,
            level: 0.01,
        };
        assert_eq!(verdict(weak, 0.4, 0.15, 0.3), CheckVerdict::NotExcited);
        assert_eq!(verdict(weak, 0.9, 0.1, 0.7), CheckVerdict::Ok);
        assert_eq!(verdict(weak, -0.9, 0.1, -0.7), CheckVerdict::WrongSign);
    }

    fn pairs(sides: &[(f64, f64)]) -> Vec<WindowPair> {
        let pair = |(window, (predicted, measured)): (usize, &(f64, f64))| WindowPair {
            window,
            predicted: *predicted,
            measured: *measured,
        };
        sides.iter().enumerate().map(pair).collect()
    }

    /// Windows of a relation that holds within noise.
    fn windows(slope: f64) -> Vec<WindowPair> {
        let sides = (0..200)
            .map(|k| f64::from(k % 21) - 10.0)
            .map(|x| (x, slope * x + 0.01 * (7.0 * x).sin()));
        pairs(&sides.collect::<Vec<_>>())
    }

    #[test]
    fn a_few_jumps_of_the_record_decide_nothing_and_a_wrong_channel_is_no_jump() {
        let settings = Checks::default();
        let relation = Relation {
            selection: Selection::Above(1.0),
            ..relations::all(&settings)[0]
        };
        let found = |pairs: &[WindowPair]| find_jumps(&relation, pairs, &settings);
        let mut jumped = windows(1.0);
        for k in [20, 90, 150] {
            jumped[k].measured += 60.0;
        }
        assert_eq!(found(&jumped), [20, 90, 150]);
        // A flight put together from many parts: it jumps on either side of the relation.
        let mut patched = windows(1.0);
        patched
            .iter_mut()
            .step_by(5)
            .for_each(|p| p.measured += 60.0);
        patched
            .iter_mut()
            .skip(2)
            .step_by(10)
            .for_each(|p| p.predicted += 300.0);
        assert_eq!(found(&patched).len(), 60);
        let mut often = windows(1.0);
        often.iter_mut().step_by(2).for_each(|p| p.measured += 60.0);
        assert!(found(&often).is_empty());
        for slope in [-1.0, 57.3] {
            let wrong = windows(slope);
            assert!(found(&wrong).is_empty());
            assert!((fit(&wrong, &wrong).unwrap().slope / slope - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn a_relation_that_disagrees_only_where_others_jump_says_nothing_and_one_with_a_wrong_sign_is_not_excused()
     {
        let settings = Checks::default();
        let relation = Relation {
            selection: Selection::Above(1.0),
            ..relations::all(&settings)[0]
        };
        let compared = |slope: f64| {
            let sides: Vec<(f64, f64)> = (0..12)
                .map(|k| f64::from(k % 5) - 2.0)
                .map(|x| (x, slope * x + 9.0 * (3.0 * x).cos()))
                .collect();
            RelationWindows::of(
                relation,
                if slope < 0.0 {
                    windows(slope)
                } else {
                    pairs(&sides)
                },
                &Gusts::default(),
                &settings,
            )
        };
        let verdicts = |sides: &RelationWindows| {
            let jumped: BTreeSet<usize> = (0..200).collect();
            (
                sides.check(&BTreeSet::new(), &settings).verdict,
                sides.check(&jumped, &settings).verdict,
            )
        };
        let jumping = compared(0.0);
        assert!(jumping.jumps.is_empty(), "too many for jumps of its own");
        assert_eq!(
            verdicts(&jumping),
            (CheckVerdict::DoesNotAgree, CheckVerdict::NotExcited)
        );
        assert_eq!(
            verdicts(&compared(-1.0)),
            (CheckVerdict::WrongSign, CheckVerdict::WrongSign)
        );
    }

    #[test]
    fn a_fit_of_nothing_but_zeros_is_none() {
        for sides in [(0.0, 0.0), (1.0, 0.0)] {
            assert_eq!(fit(&pairs(&[sides; 10]), &pairs(&[sides; 10])), None);
        }
    }
}
