//! How each kinematic relation comes out in one flight: slope, correlation and a verdict in words.

use std::collections::BTreeSet;

use super::block_means::BlockMeans;
use super::block_motion::BlockMotion;
use super::relations::{self, Choice, Relation, Side};
use crate::aircraft::Aircraft;
use crate::ingest::sample_count::whole_steps;
use crate::ingest::settings::Checks;
use crate::tables::{CheckRow, CheckVerdict};

/// One relation of one flight.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    pub relation: Relation,
    pub verdict: CheckVerdict,
    pub fit: Option<Fit>,
    /// In how many windows the record jumps.
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

/// Both sides of a relation in one window.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair {
    /// Its number in the record.
    window: usize,
    predicted: f64,
    measured: f64,
}

/// The least-squares line through the origin, measured on predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    pub slope: f64,
    pub standard_error: f64,
    pub correlation: f64,
    /// Root mean square of the predicting side.
    pub size: f64,
    /// Root mean square of measured minus predicted over that of the larger side, where the record
    /// jumps too.
    pub misfit: f64,
}

/// All relations whose signals the record has.
pub fn check_relations(blocks: &BlockMeans, aircraft: &Aircraft, settings: &Checks) -> Vec<Check> {
    let possible = |r: &Relation| r.signals.iter().all(|s| blocks.has(s));
    let relations: Vec<Relation> = relations::all(settings)
        .into_iter()
        .filter(possible)
        .collect();
    let windows = windows(&relations, blocks, aircraft, settings);
    let sides: Vec<Sides> = relations
        .into_iter()
        .zip(windows)
        .map(|(relation, pairs)| Sides::of(relation, pairs, settings))
        .collect();
    let jumped: BTreeSet<usize> = sides.iter().flat_map(|s| &s.jumps).copied().collect();
    sides.iter().map(|s| s.check(&jumped, settings)).collect()
}

/// What a relation compares in a record.
struct Sides {
    relation: Relation,
    /// Of the windows that say something.
    pairs: Vec<Pair>,
    /// Those in which the record jumps.
    jumps: Vec<usize>,
}

impl Sides {
    fn of(relation: Relation, pairs: Vec<Pair>, settings: &Checks) -> Sides {
        let pairs = chosen(&relation, pairs, settings);
        let jumps = jumps(&relation, &pairs, settings);
        Sides {
            relation,
            pairs,
            jumps,
        }
    }

    /// How the relation comes out, `jumped` being the windows in which any relation sees the record
    /// jump: where it does so in what one compares, it does so in all. But a channel that is wrong
    /// makes jumps too, and must not hide in them where it shows its sign or its unit.
    fn check(&self, jumped: &BTreeSet<usize>, settings: &Checks) -> Check {
        let own = self.without(&self.jumps.iter().copied().collect(), settings);
        let disagrees = own.verdict == CheckVerdict::DoesNotAgree && own.fit.is_some();
        if disagrees {
            self.without(jumped, settings)
        } else {
            own
        }
    }

    /// How the relation comes out without some windows.
    fn without(&self, jumped: &BTreeSet<usize>, settings: &Checks) -> Check {
        let relation = self.relation;
        let pairs: Vec<Pair> = self
            .pairs
            .iter()
            .filter(|p| !jumped.contains(&p.window))
            .copied()
            .collect();
        let jumps = self.jumps.len();
        if pairs.len() < settings.least_windows.max(2) {
            return Check {
                relation,
                verdict: CheckVerdict::NotExcited,
                fit: None,
                jumps,
            };
        }
        let fit = fit(&pairs, &self.pairs);
        // A side of nothing but zeros has no slope: a dead channel where the other side is beyond a
        // level.
        let dead = match relation.choice {
            Choice::Above(_) => CheckVerdict::DoesNotAgree,
            Choice::Largest { .. } => CheckVerdict::NotExcited,
        };
        let verdict = fit.map_or(dead, |f| judge(&f, &relation, settings));
        Check {
            relation,
            verdict,
            fit,
            jumps,
        }
    }
}

/// The signals that some relation confirms.
pub fn confirmed_signals(checks: &[Check]) -> Vec<&'static str> {
    let good = checks.iter().filter(|c| c.verdict == CheckVerdict::Ok);
    good.flat_map(|c| c.relation.dominant()).copied().collect()
}

/// The sides of each relation in every window in which both are known. The motion is computed
/// window by window: that of a whole flight would be the largest thing in memory.
fn windows(
    relations: &[Relation],
    blocks: &BlockMeans,
    aircraft: &Aircraft,
    settings: &Checks,
) -> Vec<Vec<Pair>> {
    let length = whole_steps(settings.window_s, blocks.block_s).max(1);
    let mut pairs = vec![Vec::new(); relations.len()];
    let mut motion: Vec<Option<BlockMotion>> = Vec::new();
    for (window, start) in (0..blocks.count.saturating_sub(length))
        .step_by(length)
        .enumerate()
    {
        // The last block of a window is the first of the next.
        let last = motion
            .pop()
            .unwrap_or_else(|| BlockMotion::of(blocks, start, aircraft, settings));
        motion.clear();
        motion.push(last);
        motion.extend(
            (start + 1..=start + length).map(|k| BlockMotion::of(blocks, k, aircraft, settings)),
        );
        for (relation, pairs) in relations.iter().zip(&mut pairs) {
            let value =
                |side: &Side| over(side, &motion, blocks.block_s).map(|v| v * relation.unit);
            let sides = value(&relation.predicted).zip(value(&relation.measured));
            pairs.extend(sides.map(|(predicted, measured)| Pair {
                window,
                predicted,
                measured,
            }));
        }
    }
    pairs
}

/// A side over a window of blocks, per second: the change of its state plus the trapezoidal
/// integral of its rate. The mean over a block smooths states and rates alike, so the two stay
/// consistent.
fn over(side: &Side, window: &[Option<BlockMotion>], block_s: f64) -> Option<f64> {
    let window: Vec<&BlockMotion> = window.iter().map(Option::as_ref).collect::<Option<_>>()?;
    let (first, last) = (window.first()?, window.last()?);
    let steps = (window.len() - 1) as f64;
    let change = side.state.map_or(0.0, |state| {
        (state(last) - state(first)) / (steps * block_s)
    });
    let integral = side.rate.map_or(0.0, |rate| {
        let sum: f64 = window.iter().map(|m| rate(m)).sum();
        (sum - 0.5 * (rate(first) + rate(last))) / steps
    });
    Some(change + integral).filter(|v| v.is_finite())
}

/// Where the largest windows are chosen, so many times the least number of them are wanted.
const SEVERAL: usize = 5;

/// The windows that say something. Where they are the largest of the predicting side, both sides
/// lose their medians: a bias would otherwise be the largest thing there is.
fn chosen(relation: &Relation, mut pairs: Vec<Pair>, settings: &Checks) -> Vec<Pair> {
    match relation.choice {
        Choice::Above(level) => pairs.retain(|p| p.predicted.abs().max(p.measured.abs()) > level),
        Choice::Largest { share, .. } => {
            let predicted = median(pairs.iter().map(|p| p.predicted).collect());
            let measured = median(pairs.iter().map(|p| p.measured).collect());
            for pair in &mut pairs {
                pair.predicted -= predicted;
                pair.measured -= measured;
            }
            pairs.sort_by(|a, b| b.predicted.abs().total_cmp(&a.predicted.abs()));
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of the length"
            )]
            let count = (pairs.len() as f64 * share).ceil().max(0.0) as usize;
            // Of a short flight more than the share, or too few decide.
            pairs.truncate(count.max(SEVERAL * settings.least_windows));
        }
    }
    pairs
}

/// How far a window is off the line through the middle of all, in robust standard deviations, when
/// it holds a jump.
const JUMP_DEVIATIONS: f64 = 10.0;

/// The windows that hold a jump of the record: frames lost without a trace, parts that were put
/// together. What a wrong channel does it does in every window, so where too many windows are off
/// none holds a jump.
fn jumps(relation: &Relation, pairs: &[Pair], settings: &Checks) -> Vec<usize> {
    let slope = middle_slope(pairs);
    let off = |p: &Pair| (p.measured - slope * p.predicted).abs() / (1.0 + slope * slope).sqrt();
    let spread = 1.4826 * median(pairs.iter().map(off).collect());
    let limit = (JUMP_DEVIATIONS * spread).max(relation.choice.level());
    let jumps: Vec<usize> = pairs
        .iter()
        .filter(|p| off(p) > limit)
        .map(|p| p.window)
        .collect();
    let few = slope.is_finite() && jumps.len() as f64 <= settings.jumps_share * pairs.len() as f64;
    if few { jumps } else { Vec::new() }
}

/// The slope that half of what the predicting sides weigh lies below. None weighs more than the
/// middle one: a jump of the predicting side would otherwise speak for all.
fn middle_slope(pairs: &[Pair]) -> f64 {
    let most = median(pairs.iter().map(|p| p.predicted.abs()).collect());
    let moved = pairs.iter().filter(|p| p.predicted != 0.0);
    let mut slopes: Vec<(f64, f64)> = moved
        .map(|p| (p.measured / p.predicted, p.predicted.abs().min(most)))
        .collect();
    slopes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * slopes.iter().map(|s| s.1).sum::<f64>();
    let mut sum = 0.0;
    let reaches = |s: &&(f64, f64)| {
        sum += s.1;
        sum >= half
    };
    slopes.iter().find(reaches).map_or(f64::NAN, |s| s.0)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Of the windows without jumps, the misfit of all; none where one side is nothing but zeros.
fn fit(pairs: &[Pair], all: &[Pair]) -> Option<Fit> {
    let sum_of = |pairs: &[Pair], term: &dyn Fn(f64, f64) -> f64| {
        pairs
            .iter()
            .map(|p| term(p.predicted, p.measured))
            .sum::<f64>()
    };
    let sum = |term: &dyn Fn(f64, f64) -> f64| sum_of(pairs, term);
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let slope = xy / xx;
    let residual = sum(&|x, y| (y - slope * x).powi(2));
    let (all_xx, all_yy) = (sum_of(all, &|x, _| x * x), sum_of(all, &|_, y| y * y));
    let fit = Fit {
        slope,
        standard_error: (residual / (pairs.len() - 1) as f64 / xx).sqrt(),
        correlation: xy / (xx * yy).sqrt(),
        size: (xx / pairs.len() as f64).sqrt(),
        misfit: (sum_of(all, &|x, y| (y - x).powi(2)) / all_xx.max(all_yy)).sqrt(),
    };
    [fit.slope, fit.standard_error, fit.correlation, fit.misfit]
        .iter()
        .all(|v| v.is_finite())
        .then_some(fit)
}

/// What biases may leave of a relation, as a share of the level from which it counts as excited.
const BIAS: f64 = 0.5;

/// A verdict needs the slope to be wrong by several standard errors and by more than biases can
/// make it. Correlation counts only where the windows were chosen by a level that noise does not
/// reach.
fn judge(fit: &Fit, relation: &Relation, settings: &Checks) -> CheckVerdict {
    let margin =
        settings.standard_errors * fit.standard_error + BIAS * relation.choice.level() / fit.size;
    let (low, high) = (fit.slope - margin, fit.slope + margin);
    let level = matches!(relation.choice, Choice::Above(_));
    if level && fit.correlation.abs() < relation.correlation {
        CheckVerdict::DoesNotAgree
    } else if high < 0.0 {
        CheckVerdict::WrongSign
    } else if fit.slope < 0.0 {
        CheckVerdict::NotExcited
    } else if low > settings.slope_factor || high < 1.0 / settings.slope_factor {
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

    fn verdict(choice: Choice, slope: f64, standard_error: f64, correlation: f64) -> CheckVerdict {
        let settings = Checks::default();
        let relation = Relation {
            choice,
            correlation: 0.5,
            ..relations::all(&settings)[0]
        };
        judge(
            &Fit {
                slope,
                standard_error,
                correlation,
                size: 10.0,
                misfit: 0.1,
            },
            &relation,
            &settings,
        )
    }

    #[test]
    fn verdicts_need_several_standard_errors() {
        let level = Choice::Above(1.0);
        assert_eq!(verdict(level, 0.98, 0.01, 0.99), CheckVerdict::Ok);
        assert_eq!(verdict(level, -1.0, 0.01, -0.99), CheckVerdict::WrongSign);
        assert_eq!(verdict(level, 57.3, 0.5, 0.99), CheckVerdict::WrongScale);
        assert_eq!(verdict(level, 0.02, 0.001, 0.99), CheckVerdict::WrongScale);
        assert_eq!(verdict(level, 0.1, 0.1, 0.1), CheckVerdict::DoesNotAgree);
        assert_eq!(verdict(level, 0.6, 0.05, 0.8), CheckVerdict::Ok);
        let weak = Choice::Largest {
            share: 0.05,
            level: 0.01,
        };
        assert_eq!(verdict(weak, 0.4, 0.15, 0.3), CheckVerdict::NotExcited);
        assert_eq!(verdict(weak, 0.9, 0.1, 0.7), CheckVerdict::Ok);
        assert_eq!(verdict(weak, -0.9, 0.1, -0.7), CheckVerdict::WrongSign);
    }

    fn pairs(sides: &[(f64, f64)]) -> Vec<Pair> {
        let pair = |(window, (predicted, measured)): (usize, &(f64, f64))| Pair {
            window,
            predicted: *predicted,
            measured: *measured,
        };
        sides.iter().enumerate().map(pair).collect()
    }

    /// Windows of a relation that holds within noise.
    fn windows(slope: f64) -> Vec<Pair> {
        let sides = (0..200)
            .map(|k| f64::from(k % 21) - 10.0)
            .map(|x| (x, slope * x + 0.01 * (7.0 * x).sin()));
        pairs(&sides.collect::<Vec<_>>())
    }

    #[test]
    fn a_few_jumps_of_the_record_decide_nothing_and_a_wrong_channel_is_no_jump() {
        let settings = Checks::default();
        let relation = Relation {
            choice: Choice::Above(1.0),
            ..relations::all(&settings)[0]
        };
        let found = |pairs: &[Pair]| jumps(&relation, pairs, &settings);
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
            choice: Choice::Above(1.0),
            ..relations::all(&settings)[0]
        };
        let compared = |slope: f64| {
            let sides: Vec<(f64, f64)> = (0..12)
                .map(|k| f64::from(k % 5) - 2.0)
                .map(|x| (x, slope * x + 9.0 * (3.0 * x).cos()))
                .collect();
            Sides::of(
                relation,
                if slope < 0.0 {
                    windows(slope)
                } else {
                    pairs(&sides)
                },
                &settings,
            )
        };
        let verdicts = |sides: &Sides| {
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
