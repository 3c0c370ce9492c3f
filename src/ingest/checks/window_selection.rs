//! Windows of a relation: those in which it is excited, and those in which the record jumps.

use super::line_fit::median_slope;
use super::relations::{GustEffect, Relation, Selection};
use super::windows::WindowPair;
use crate::ingest::settings::Checks;
use crate::numerics::statistics::order_statistics::{SIGMA_PER_MAD, upper_median};

/// Number of windows that a relation of the kind `Largest` selects in a short flight, as a multiple
/// of the smallest number for a verdict. They suffice for the slope of a relation whose noise
/// reaches its level.
const LEAST_SELECTED: usize = 5;

/// Distance of a window from the line through all windows above which the window contains a jump of
/// the record, in robust standard deviations. It is far beyond noise, gusts and turbulence.
const JUMP_DEVIATIONS: f64 = 10.0;

/// Distance of a window, in standard deviations, above which it contains the motion of a control, for a relation
/// that only gusts excite. Normal gusts exceed it in one window of 370, which are lost for the slope.
const MANEUVER_DEVIATIONS: f64 = 3.0;

/// Selects the windows in which a relation is excited. If they are the largest of the predicted
/// side, both sides first lose their medians: otherwise a bias would be the largest of all.
pub fn select_excited(
    relation: &Relation,
    mut pairs: Vec<WindowPair>,
    settings: &Checks,
) -> Vec<WindowPair> {
    match relation.selection {
        Selection::Above(level) => {
            pairs.retain(|p| p.predicted.abs().max(p.measured.abs()) > level);
        }
        Selection::Largest { share, .. } => {
            let predicted = upper_median(pairs.iter().map(|p| p.predicted)).unwrap_or_default();
            let measured = upper_median(pairs.iter().map(|p| p.measured)).unwrap_or_default();
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
            pairs.truncate(count.max(LEAST_SELECTED * settings.least_windows));
        }
    }
    pairs
}

/// Finds the windows that contain a jump of the record: frames lost without a trace, or parts that
/// were joined. A wrong channel is wrong in every window, so if too many windows are off the line
/// none contains a jump.
pub fn find_jumps(relation: &Relation, pairs: &[WindowPair], settings: &Checks) -> Vec<usize> {
    let slope = median_slope(pairs);
    let distance =
        |p: &WindowPair| (p.measured - slope * p.predicted).abs() / (1.0 + slope * slope).sqrt();
    let deviation = SIGMA_PER_MAD * upper_median(pairs.iter().map(distance)).unwrap_or_default();
    let limit = match relation.gusts {
        GustEffect::Excite => MANEUVER_DEVIATIONS * deviation,
        GustEffect::Slight | GustEffect::Disturb { .. } => {
            (JUMP_DEVIATIONS * deviation).max(relation.selection.level())
        }
    };
    let jumps: Vec<usize> = pairs
        .iter()
        .filter(|p| distance(p) > limit)
        .map(|p| p.window)
        .collect();
    let are_few = jumps.len() as f64 <= settings.jumps_share * pairs.len() as f64;
    if slope.is_finite() && are_few {
        jumps
    } else {
        Vec::new()
    }
}
