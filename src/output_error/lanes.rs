//! Where the parameters stand in the processor's vectors. Those that the integration feels, derivatives and initial
//! states, lie in lanes side by side; a bias shifts an output and never meets a state.
//!
//! The derivatives of one coefficient form a group and fill whole vectors, so that what a coefficient does is one number
//! for all of a vector's lanes. Initial states are the last group. What goes to the normal equations is packed again.

use std::ops::Range;

use super::case::Acting;
use crate::dynamics::COEFFICIENTS;

/// Groups of lanes: one per coefficient, and the initial states.
pub(super) const GROUPS: usize = COEFFICIENTS + 1;

/// A group is padded to a multiple of this many lanes: the widest vector of doubles there is.
pub(super) const PADDED_TO: usize = 8;

/// The layout of one case.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Lanes {
    /// The lanes of each group with its padding.
    pub groups: [Range<usize>; GROUPS],
    /// Where each group begins when packed.
    pub packed: [usize; GROUPS],
    /// Packed lanes that are parameters: the derivatives, then the initial states.
    pub driven: usize,
    /// All packed lanes, with room for the padding of the last group.
    pub width: usize,
    /// State by state one in the lanes of derivatives along it; first of all one in those along none.
    pub along: Vec<Vec<f64>>,
}

fn padded(count: usize) -> usize {
    count.next_multiple_of(PADDED_TO)
}

impl Lanes {
    /// The layout for these derivatives of each coefficient and this number of free initial states.
    pub fn new(ranges: &[Range<usize>; COEFFICIENTS], initial: usize) -> Lanes {
        let mut lanes = Lanes::default();
        let counts = ranges.iter().map(ExactSizeIterator::len).chain([initial]);
        let mut padded_end = 0;
        for (group, count) in counts.enumerate() {
            lanes.groups[group] = padded_end..padded_end + padded(count);
            lanes.packed[group] = lanes.driven;
            padded_end += padded(count);
            lanes.width = lanes.width.max(padded(lanes.driven + padded(count)));
            lanes.driven += count;
        }
        lanes
    }

    /// All lanes with their padding.
    pub fn padded(&self) -> usize {
        self.groups[GROUPS - 1].end
    }

    /// Those of the derivatives.
    pub fn derivatives(&self) -> usize {
        self.groups[GROUPS - 1].start
    }

    /// The lane of the first free initial state.
    pub fn initial(&self) -> usize {
        self.groups[GROUPS - 1].start
    }

    /// The lane of a derivative, the parameters being counted over all coefficients.
    fn lane(&self, derivative: usize, coefficient: usize) -> usize {
        self.groups[coefficient].start + derivative - self.packed[coefficient]
    }

    /// The regressors of the derivatives point by point in the order of the lanes, zero in the padding; also notes which
    /// lanes follow which state.
    pub fn spread(&mut self, acting: &[Acting], columns: &[Vec<f64>], points: usize, states: usize) -> Vec<f64> {
        let width = self.derivatives();
        let mut rows = vec![0.0; points * width];
        self.along = vec![vec![0.0; width]; states + 1];
        for (j, a) in acting.iter().enumerate() {
            let lane = self.lane(j, a.coefficient);
            self.along[a.along.map_or(0, |state| state + 1)][lane] = 1.0;
            for (row, r) in rows.chunks_exact_mut(width).zip(&columns[a.column]) {
                row[lane] = *r;
            }
        }
        rows
    }
}
