//! Where the parameters stand in the processor's vectors. Those that the integration feels,
//! derivatives and initial states, lie in lanes side by side; a bias shifts an output and never
//! meets a state.
//!
//! The derivatives of one coefficient form a group and fill whole vectors, so that what a
//! coefficient does is one number for all of a vector's lanes; those along a state come first, in
//! the order of the states, so that they are the same lanes of each group, and the groups of all
//! coefficients are equally long. Initial states are the last group. Two lanes that are left over
//! hold the residual and a one when sums are taken.
//!
//! What the derivatives multiply stands in rows, point by point. Where the columns of all
//! coefficients together need no more room than the widest group, all groups read the same stretch
//! of a row: most derivatives come three at a time, one of each coefficient, along the same
//! surface. Lanes that nobody asked for are then computed too, and never read.

use std::collections::BTreeSet;
use std::ops::Range;

use super::build_up::Acting;
use crate::dynamics::COEFFICIENTS;
use crate::numerics::simd::VECTOR;

/// Groups of lanes: one per coefficient, and the initial states.
const GROUPS: usize = COEFFICIENTS + 1;

/// The layout of one case.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Lanes {
    pub groups: [Range<usize>; GROUPS],
    /// The lane of each parameter in order, without the biases.
    pub places: Vec<usize>,
    /// Lanes left over: for the residual and a one when sums are taken, for the biases when
    /// sensitivities are kept.
    pub residual: usize,
    pub one: usize,
    pub biases: Vec<usize>,
    /// Lanes in use of each vector, from its first.
    pub used: Vec<usize>,
    /// Where the regressors of each group of derivatives begin in a row of them, and how long a row
    /// is.
    pub regressors: [usize; COEFFICIENTS],
    pub row: usize,
    /// Which column stands where in a row: (place, column).
    pub columns: Vec<(usize, usize)>,
}

fn padded(count: usize) -> usize {
    count.next_multiple_of(VECTOR)
}

impl Lanes {
    /// The layout for these derivatives, sorted by coefficient, and this number of free initial
    /// states. `followed` are the states that derivatives can be along.
    pub fn new(acting: &[Acting], followed: &[usize], initial: usize, biases: usize) -> Lanes {
        let of = |k: usize| -> Vec<usize> {
            acting
                .iter()
                .filter(|a| a.coefficient == k && a.along.is_none())
                .map(|a| a.column)
                .collect()
        };
        let all: Vec<usize> = (0..COEFFICIENTS)
            .flat_map(of)
            .collect::<BTreeSet<usize>>()
            .into_iter()
            .collect();
        let room = |columns: &[usize]| padded(followed.len() + columns.len());
        let widest = (0..COEFFICIENTS)
            .map(|k| room(&of(k)))
            .max()
            .filter(|_| !acting.is_empty())
            .unwrap_or(0);
        let shared = room(&all) <= widest;
        let slots: [Vec<usize>; COEFFICIENTS] =
            std::array::from_fn(|k| if shared { all.clone() } else { of(k) });
        let mut lanes = Lanes {
            row: if shared {
                widest
            } else {
                COEFFICIENTS * widest
            },
            ..Lanes::default()
        };
        for k in 0..COEFFICIENTS {
            lanes.groups[k] = k * widest..(k + 1) * widest;
            lanes.regressors[k] = if shared { 0 } else { k * widest };
        }
        for a in acting {
            let along = a
                .along
                .and_then(|state| followed.iter().position(|f| *f == state));
            let beside = || {
                slots[a.coefficient]
                    .iter()
                    .position(|column| *column == a.column)
            };
            let slot = along
                .or_else(|| beside().map(|slot| followed.len() + slot))
                .unwrap_or(0);
            lanes.places.push(lanes.groups[a.coefficient].start + slot);
            lanes
                .columns
                .push((lanes.regressors[a.coefficient] + slot, a.column));
        }
        lanes.columns.sort_unstable();
        lanes.columns.dedup();
        let first = COEFFICIENTS * widest;
        lanes.groups[COEFFICIENTS] = first..first + padded(initial);
        lanes.places.extend(first..first + initial);
        let left_over: Vec<usize> = (0..)
            .filter(|lane| !lanes.places.contains(lane))
            .take(biases.max(2))
            .collect();
        (lanes.residual, lanes.one) = (left_over[0], left_over[1]);
        lanes.biases = left_over[..biases].to_vec();
        let last = lanes
            .places
            .iter()
            .chain(&left_over)
            .copied()
            .max()
            .unwrap_or(0);
        let last_of = |vector: usize| {
            let lanes = lanes
                .places
                .iter()
                .copied()
                .chain([lanes.residual, lanes.one]);
            lanes
                .filter(|lane| lane / VECTOR == vector)
                .map(|lane| lane % VECTOR + 1)
                .max()
                .unwrap_or(0)
        };
        lanes.used = (0..=last / VECTOR).map(last_of).collect();
        lanes
    }

    /// All lanes, a whole number of vectors.
    pub fn width(&self) -> usize {
        VECTOR * self.used.len().max(self.groups[COEFFICIENTS].end / VECTOR)
    }

    /// Those of the derivatives; the first of the free initial states follows.
    pub fn derivatives(&self) -> usize {
        self.groups[COEFFICIENTS].start
    }
}
