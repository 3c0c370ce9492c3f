//! Order of the parameters in the lanes of the kernel's vectors.
//!
//! Terms of this file:
//!
//! - A *vector* is [`VECTOR`] numbers that the processor computes at once. A *lane* is the place of
//!   one number, counted through all vectors. Each lane holds the sensitivities to one parameter.
//! - A *group* is the lanes of one coefficient's derivatives, in whole vectors.
//! - A *slot* is a place within a group. The same slot of each group has the same kind of
//!   regressor.
//! - A *row* is the regressors of one point in time; a *column* is one regressor over all points.
//!
//! # Lanes
//!
//! Lanes are, in order:
//!
//! 1. the group of each coefficient. All groups have the same number of lanes. A vector thus
//!    contains derivatives of one coefficient only, and needs one factor ∂(rates)/∂(coefficient).
//!    The first slots are derivatives along a state, in the order of the states, then derivatives
//!    along a state times a measured signal, then those along measured signals;
//! 2. the group of the parameters without a regressor, such as initial states.
//!
//! A bias shifts an output and not the states, so it needs no lane in the integration. Two lanes
//! without a parameter hold the residual and the number one while sums are taken.
//!
//! # Regressors
//!
//! Usually each surface has one derivative in each of the three coefficients. Their regressor is
//! the same column. All groups read one row of shared columns if the columns of all coefficients
//! fit into the widest group. A slot without a derivative is computed and ignored. In a *dense*
//! layout each group has its own row, with zero in the slots without a derivative. Parameters
//! without a regressor take these slots.

use std::collections::BTreeSet;
use std::ops::Range;

use super::build_up::BuildUpTerm;
use crate::dynamics::COEFFICIENTS;
use crate::numerics::vectors::simd::VECTOR;

/// Largest number of products of states that are regressors of an axis: with the states themselves
/// they fit into one vector.
pub const MOST_PRODUCTS: usize = VECTOR - MOST_STATES;

/// Largest number of states of an axis that regressors are proportional to.
const MOST_STATES: usize = 3;

/// Groups of lanes: one per coefficient, and the initial states.
const GROUPS: usize = COEFFICIENTS + 1;

/// Lanes of the parameters of one case, and the regressors that each group reads.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LaneLayout {
    /// Lanes of each group: one per coefficient, then the parameters without a regressor.
    pub groups: [Range<usize>; GROUPS],
    /// Lane of each parameter in order, without the biases.
    pub parameter_lanes: Vec<usize>,
    /// Spare lane that holds the residual while sums are taken.
    pub residual_lane: usize,
    /// Spare lane that holds a one while sums are taken.
    pub one_lane: usize,
    /// Spare lanes that hold the biases' sensitivities where these are kept.
    pub biases: Vec<usize>,
    /// Number of lanes of each vector that are computed, counted from its first lane.
    pub lanes_used: Vec<usize>,
    /// Index in a row of the first regressor of each coefficient's group; equal where groups share
    /// columns.
    pub regressors: [usize; COEFFICIENTS],
    /// Number of regressors in a row.
    pub row_length: usize,
    /// Columns of regressors in a row: (index in the row, column).
    pub columns: Vec<(usize, usize)>,
    /// Slots of derivatives along a state times a measured signal: (slot in each group, state).
    pub products: Vec<(usize, usize)>,
}

impl LaneLayout {
    /// Layout for the derivatives `terms`, sorted by coefficient, and for this number of initial
    /// states and biases. `followed` are the states of the axis that regressors can be proportional
    /// to.
    pub fn new(
        terms: &[BuildUpTerm],
        followed: &[usize],
        initial_states: usize,
        biases: usize,
    ) -> LaneLayout {
        let slots = GroupSlots::new(terms, followed);
        let mut layout = LaneLayout::with_terms(terms, followed, &slots);
        layout.append_parameters(initial_states);
        layout.place_spare_lanes(biases);
        layout
    }

    /// Layout for many parameters without a regressor (`others`). They take the slots of the groups
    /// that have no derivative; the rest follows in the last group.
    pub fn dense(terms: &[BuildUpTerm], followed: &[usize], others: usize) -> LaneLayout {
        let slots = GroupSlots::new(terms, followed).with_own_columns(terms);
        let mut layout = LaneLayout::with_terms(terms, followed, &slots);
        let free = (0..layout.groups[COEFFICIENTS - 1].end)
            .filter(|lane| !layout.parameter_lanes.contains(lane))
            .take(others);
        let free: Vec<usize> = free.collect();
        layout.parameter_lanes.extend(&free);
        layout.append_parameters(others - free.len());
        layout.place_spare_lanes(0);
        layout
    }

    fn with_terms(terms: &[BuildUpTerm], followed: &[usize], slots: &GroupSlots) -> LaneLayout {
        let mut layout = LaneLayout::with_groups(slots);
        let products = slots.along_states.iter().enumerate().skip(followed.len());
        layout.products = products.map(|(slot, (state, _))| (slot, *state)).collect();
        layout.place_terms(terms, slots);
        layout
    }

    fn with_groups(slots: &GroupSlots) -> LaneLayout {
        let width = slots.width;
        let mut layout = LaneLayout {
            row_length: if slots.shared {
                width
            } else {
                COEFFICIENTS * width
            },
            ..LaneLayout::default()
        };
        for k in 0..COEFFICIENTS {
            layout.groups[k] = k * width..(k + 1) * width;
            layout.regressors[k] = if slots.shared { 0 } else { k * width };
        }
        layout
    }

    fn place_terms(&mut self, terms: &[BuildUpTerm], slots: &GroupSlots) {
        for term in terms {
            let slot = slots.slot(term);
            let group = &self.groups[term.coefficient];
            self.parameter_lanes.push(group.start + slot);
            let place = self.regressors[term.coefficient] + slot;
            self.columns.push((place, term.column));
        }
        self.columns.sort_unstable();
        self.columns.dedup();
    }

    /// Appends `count` parameters without a regressor in the last group.
    fn append_parameters(&mut self, count: usize) {
        let first = self.groups[COEFFICIENTS - 1].end;
        self.groups[COEFFICIENTS] = first..first + whole_vectors(count);
        self.parameter_lanes.extend(first..first + count);
    }

    fn place_spare_lanes(&mut self, biases: usize) {
        let spare: Vec<usize> = (0..)
            .filter(|lane| !self.parameter_lanes.contains(lane))
            .take(biases.max(2))
            .collect();
        (self.residual_lane, self.one_lane) = (spare[0], spare[1]);
        self.biases = spare[..biases].to_vec();
        let lanes = self.parameter_lanes.iter().chain(&spare);
        let vectors = lanes.max().map_or(0, |last| last / VECTOR + 1);
        self.lanes_used = (0..vectors).map(|v| self.count_used_lanes(v)).collect();
    }

    fn count_used_lanes(&self, vector: usize) -> usize {
        let lanes = self
            .parameter_lanes
            .iter()
            .chain([&self.residual_lane, &self.one_lane]);
        lanes
            .filter(|lane| **lane / VECTOR == vector)
            .map(|lane| lane % VECTOR + 1)
            .max()
            .unwrap_or(0)
    }

    /// Number of lanes: whole vectors.
    pub fn width(&self) -> usize {
        VECTOR
            * self
                .lanes_used
                .len()
                .max(self.groups[COEFFICIENTS].end / VECTOR)
    }

    /// First lane of the initial states, which follow the derivatives.
    pub fn first_initial_state(&self) -> usize {
        self.groups[COEFFICIENTS].start
    }
}

fn whole_vectors(count: usize) -> usize {
    count.next_multiple_of(VECTOR)
}

/// Slots that all groups have in common: derivatives along a state, along a state times a measured
/// signal, then along measured signals.
struct GroupSlots {
    /// First slots of every group: a state, and the column of the signal that multiplies the state;
    /// `None` while no derivative needs the slot.
    along_states: Vec<(usize, Option<usize>)>,
    columns: [Vec<usize>; COEFFICIENTS],
    /// Lanes of a group.
    width: usize,
    /// `true` if all groups have the columns of all coefficients, and read one row.
    shared: bool,
}

impl GroupSlots {
    fn new(terms: &[BuildUpTerm], followed: &[usize]) -> GroupSlots {
        let along_states = slots_along_states(terms, followed);
        let own: [Vec<usize>; COEFFICIENTS] = std::array::from_fn(|k| columns_of(terms, k));
        let all: BTreeSet<usize> = own.iter().flatten().copied().collect();
        let room = |columns: usize| whole_vectors(along_states.len() + columns);
        let widest = own.iter().map(Vec::len).max().map_or(0, room);
        let width = if terms.is_empty() { 0 } else { widest };
        let shared = room(all.len()) <= width;
        let columns = if shared {
            std::array::from_fn(|_| all.iter().copied().collect())
        } else {
            own
        };
        GroupSlots {
            along_states,
            columns,
            width,
            shared,
        }
    }

    /// Same slots, but each group has its own columns.
    fn with_own_columns(self, terms: &[BuildUpTerm]) -> GroupSlots {
        GroupSlots {
            columns: std::array::from_fn(|k| columns_of(terms, k)),
            shared: false,
            ..self
        }
    }

    fn slot(&self, term: &BuildUpTerm) -> usize {
        let slot = match term.state {
            Some(state) => {
                let own = (state, Some(term.column));
                self.along_states.iter().position(|slot| *slot == own)
            }
            None => self.columns[term.coefficient]
                .iter()
                .position(|column| *column == term.column)
                .map(|slot| self.along_states.len() + slot),
        };
        slot.unwrap_or(0)
    }
}

/// Slots of derivatives along a state. Each followed state has one slot, which the first derivative
/// along this state takes with its column. A derivative along the same state with another column
/// adds a slot.
fn slots_along_states(terms: &[BuildUpTerm], followed: &[usize]) -> Vec<(usize, Option<usize>)> {
    let mut slots: Vec<(usize, Option<usize>)> = followed.iter().map(|s| (*s, None)).collect();
    for term in terms {
        let Some(state) = term.state else { continue };
        let own = (state, Some(term.column));
        if slots.contains(&own) {
            continue;
        }
        match slots.iter_mut().find(|slot| **slot == (state, None)) {
            Some(free) => *free = own,
            None => slots.push(own),
        }
    }
    slots
}

/// Columns of one coefficient's derivatives along measured signals alone.
fn columns_of(terms: &[BuildUpTerm], coefficient: usize) -> Vec<usize> {
    let own = terms
        .iter()
        .filter(|term| term.coefficient == coefficient && term.state.is_none());
    own.map(|term| term.column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_dense_layout_other_parameters_stand_where_no_regressor_is() {
        let term = |coefficient, state, column| BuildUpTerm {
            coefficient,
            state,
            column,
        };
        let terms = [
            term(0, Some(0), 0),
            term(0, None, 1),
            term(0, None, 2),
            term(1, Some(3), 3),
            term(1, None, 2),
            term(2, None, 4),
        ];
        for others in [3, 30] {
            let layout = LaneLayout::dense(&terms, &[0, 3], others);
            let mut lanes = layout.parameter_lanes.clone();
            assert_eq!(lanes.len(), terms.len() + others);
            lanes.sort_unstable();
            lanes.dedup();
            assert_eq!(lanes.len(), terms.len() + others);
            assert!(lanes.iter().all(|lane| *lane < layout.width()));
            for lane in &layout.parameter_lanes[terms.len()..] {
                let group = layout.groups.iter().position(|g| g.contains(lane)).unwrap();
                let Some(first) = layout.regressors.get(group) else {
                    continue;
                };
                let place = first + lane - layout.groups[group].start;
                assert!(layout.columns.iter().all(|(taken, _)| *taken != place));
            }
        }
        // Three lanes are spare in the first group alone.
        let few = LaneLayout::dense(&terms, &[0, 3], 3);
        assert!(few.groups[COEFFICIENTS].is_empty());
    }
}
