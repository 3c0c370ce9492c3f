//! Both sides of the kinematic relations in every window of a record.

use super::block_means::BlockMeans;
use super::block_motion::BlockMotion;
use super::relations::{Relation, Side};
use crate::aircraft::Aircraft;
use crate::ingest::settings::Checks;
use crate::numerics::sample_count::whole_steps;

/// Both sides of a relation in one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowPair {
    /// Number of the window in the record.
    pub window: usize,
    pub predicted: f64,
    pub measured: f64,
}

/// Computes the sides of each relation in every window in which both are defined.
///
/// The motion is computed window by window: that of a whole flight would be the largest object in
/// memory.
pub fn window_pairs(
    relations: &[Relation],
    blocks: &BlockMeans,
    aircraft: &Aircraft,
    settings: &Checks,
) -> Vec<Vec<WindowPair>> {
    let length = whole_steps(settings.window_s, blocks.block_s).max(1);
    let motion_of = |block: usize| BlockMotion::of(blocks, block, aircraft, settings);
    let mut pairs = vec![Vec::new(); relations.len()];
    let mut motion: Vec<Option<BlockMotion>> = Vec::new();
    let starts = (0..blocks.count.saturating_sub(length)).step_by(length);
    for (window, start) in starts.enumerate() {
        // The last block of a window is the first of the next.
        let first = motion.pop().unwrap_or_else(|| motion_of(start));
        motion.clear();
        motion.push(first);
        motion.extend((start + 1..=start + length).map(motion_of));
        let Some(motion) = motion
            .iter()
            .map(Option::as_ref)
            .collect::<Option<Vec<_>>>()
        else {
            continue;
        };
        for (relation, pairs) in relations.iter().zip(&mut pairs) {
            let side = |side: &Side| mean_rate(side, &motion, blocks.block_s);
            let sides = side(&relation.predicted).zip(side(&relation.measured));
            pairs.extend(sides.map(|(predicted, measured)| WindowPair {
                window,
                predicted: predicted * relation.unit,
                measured: measured * relation.unit,
            }));
        }
    }
    pairs
}

/// A side over a window of blocks, per second: the change of its state plus the trapezoidal
/// integral of its rate. `None` where it is not finite.
///
/// The mean over a block smooths states and rates alike, so the two stay consistent.
fn mean_rate(side: &Side, window: &[&BlockMotion], block_s: f64) -> Option<f64> {
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
