//! Both sides of the kinematic relations in every window of a record.

use super::block_means::BlockMeans;
use super::block_motion::{BlockMotion, Motions};
use super::relations::{Relation, Side};
use crate::aircraft::Aircraft;
use crate::ingest::settings::Checks;
use crate::numerics::series::sample_count::whole_steps;

/// Both sides of a relation in one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowPair {
    /// Number of the window in the record.
    pub window: usize,
    pub predicted: f64,
    pub measured: f64,
}

/// Both sides of a relation in the windows of the checks, and in those of one block where gusts disturb it.
#[derive(Clone, Debug, Default)]
pub struct RelationPairs {
    pub windows: Vec<WindowPair>,
    pub steps: Vec<WindowPair>,
}

/// Computes the sides of each relation in every window in which both are defined.
///
/// The motion is kept for a window: that of a whole flight would be the largest object in memory.
pub fn relation_pairs(
    relations: &[Relation],
    blocks: &BlockMeans,
    aircraft: &Aircraft,
    settings: &Checks,
) -> Vec<RelationPairs> {
    let length = whole_steps(settings.window_s, blocks.block_s).max(1);
    let mut pairs = vec![RelationPairs::default(); relations.len()];
    let motions = Motions::new(blocks, aircraft, settings);
    let mut motion: Vec<Option<BlockMotion>> = Vec::with_capacity(length + 1);
    for block in 0..blocks.count {
        motion.push(motions.in_block(block));
        if let [.., Some(before), Some(now)] = motion.as_slice() {
            for (relation, pairs) in relations.iter().zip(&mut pairs) {
                if relation.disturbed_by_gusts().is_some() {
                    let own = pair(relation, block - 1, &[before, now], blocks.block_s);
                    pairs.steps.extend(own);
                }
            }
        }
        if motion.len() <= length {
            continue;
        }
        let whole: Option<Vec<&BlockMotion>> = motion.iter().map(Option::as_ref).collect();
        if let Some(whole) = whole {
            for (relation, pairs) in relations.iter().zip(&mut pairs) {
                let own = pair(relation, block / length - 1, &whole, blocks.block_s);
                pairs.windows.extend(own);
            }
        }
        // The last block of a window is the first of the next.
        motion.drain(..length);
    }
    pairs
}

/// Both sides of a relation over the blocks of a window; `None` if one is not defined.
fn pair(
    relation: &Relation,
    window: usize,
    motion: &[&BlockMotion],
    block_s: f64,
) -> Option<WindowPair> {
    let side = |side: &Side| mean_rate(side, motion, block_s);
    Some(WindowPair {
        window,
        predicted: side(&relation.predicted)? * relation.unit,
        measured: side(&relation.measured)? * relation.unit,
    })
}

/// A side over a window of blocks, per second: the change of its state plus the trapezoidal
/// integral of its rate. `None` if it is not finite.
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
