//! Minimum of the cost of filter error, or the reason why none was found.

use std::cmp::Ordering;
use std::fmt;

use crate::filter_error::bounds::FilterBounds;
use crate::filter_error::scoring::Scored;

/// Minimum of a filter's cost with its bounds.
pub(in crate::estimate) struct Minimum {
    pub scored: Scored,
    pub bounds: FilterBounds,
}

impl Minimum {
    /// −log of the likelihood.
    pub fn cost(&self) -> f64 {
        self.scored.response.cost
    }

    /// Orders by cost.
    pub fn by_cost(&self, other: &Minimum) -> Ordering {
        self.scored.by_cost(&other.scored)
    }
}

/// Reason why a start leads to no estimates by filter error.
pub(in crate::estimate) enum NoMinimum {
    /// The state leaves its bounds, or the filter has no finite gain.
    Diverges,
    /// The iteration ends at this point, before a minimum.
    NotConverged(Box<Scored>),
    /// The data determine no covariance at the minimum.
    Undetermined(Box<Scored>),
}

impl NoMinimum {
    /// End of the iteration; `None` if the filter diverges.
    pub fn end(&self) -> Option<&Scored> {
        match self {
            NoMinimum::Diverges => None,
            NoMinimum::NotConverged(end) | NoMinimum::Undetermined(end) => Some(end),
        }
    }

    /// Orders by the cost at the end; one that diverges is last.
    pub fn by_cost(&self, other: &NoMinimum) -> Ordering {
        match (self.end(), other.end()) {
            (Some(end), Some(other)) => end.by_cost(other),
            (end, other) => end.is_none().cmp(&other.is_none()),
        }
    }
}

impl fmt::Display for NoMinimum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            NoMinimum::Diverges => "filter error diverges",
            NoMinimum::NotConverged(_) => "filter error does not converge",
            NoMinimum::Undetermined(_) => "filter error does not determine all that it estimates",
        })
    }
}
