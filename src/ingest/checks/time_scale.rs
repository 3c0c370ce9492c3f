//! Time in a wrong unit or at a wrong rate. Every change of the motion is too fast or too slow by
//! one factor, which no single channel explains.

use super::agreement::Check;
use super::mass_properties::ImpossibleSignal;
use crate::flight::signal;
use crate::tables::CheckVerdict;

/// First signals of two kinds of relations. One kind compares the change of an attitude with rates,
/// the other that of altitude or speed with flight path or accelerations.
const OF_ATTITUDE: [&str; 3] = [signal::THETA, signal::PHI, signal::PSI];
const OF_PATH: [&str; 2] = [signal::ALTITUDE, signal::VELOCITY];

/// Least correlation of a relation whose slope counts. A slope has the relative standard error √(1/r² − 1)/√n:
/// with r = 0.9 and n = 25 windows 10 %, which [`ONE_SLOPE`] allows.
const LEAST_CORRELATION: f64 = 0.9;

/// Least number of relations that have one slope; the fault of a channel gives at most two
/// relations the same slope.
const FEWEST: usize = 3;

/// Largest ratio of slopes that count as equal: biases and gusts change them by a few percent.
const ONE_SLOPE: f64 = 1.1;

/// Least factor of a wrong time; slopes of good flights differ from one by a few percent.
const LEAST_FACTOR: f64 = 1.1;

/// Units of time with the seconds that a channel in them counts for each second.
const UNITS: [(&str, f64); 5] = [
    ("h", 1.0 / 3600.0),
    ("min", 1.0 / 60.0),
    ("ms", 1e3),
    ("us", 1e6),
    ("ns", 1e9),
];

/// Finds a time that runs too fast or too slow.
pub fn find_time_scale_fault(checks: &[Check]) -> Option<ImpossibleSignal> {
    let slopes = |signals: &[&str]| -> Vec<f64> {
        let of = checks.iter().filter(|check| {
            let first = check.relation.signals.first();
            check.verdict != CheckVerdict::NotExcited
                && first.is_some_and(|first| signals.contains(first))
        });
        let fits = of.filter_map(|check| check.fit);
        let sure = fits.filter(|fit| fit.correlation >= LEAST_CORRELATION && fit.slope > 0.0);
        sure.map(|fit| fit.slope).collect()
    };
    let (attitudes, paths) = (slopes(&OF_ATTITUDE), slopes(&OF_PATH));
    let all: Vec<f64> = attitudes.iter().chain(&paths).copied().collect();
    if attitudes.is_empty() || paths.is_empty() || all.len() < FEWEST {
        return None;
    }
    let (least, most) = all
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(least, most), slope| {
            (least.min(*slope), most.max(*slope))
        });
    let slope = (least * most).sqrt();
    let is_one = most <= ONE_SLOPE * least;
    let is_wrong = slope.ln().abs() > LEAST_FACTOR.ln();
    (is_one && is_wrong).then(|| {
        let seconds = 1.0 / slope;
        let is_unit = |(_, own): &&(&str, f64)| (seconds / own).ln().abs() < ONE_SLOPE.ln();
        let unit = UNITS.iter().find(is_unit);
        let unit = unit.map_or_else(|| ".".to_owned(), |(name, _)| format!(": is it in {name}?"));
        ImpossibleSignal {
            signal: signal::TIME,
            reason: format!(
                "it counts {seconds:.4} s for each second of the motion: attitudes, altitude and speed change {slope:.3} \
                 times as fast as rates and accelerations imply, in {} relations{unit} Correct its unit in the channel map, \
                 or leave the flight out",
                all.len()
            ),
        }
    })
}
