//! The information matrix (1.7): its inverse, or the direction that the data do not determine.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::numerics::symmetric::{inverse, scale, scaled};

/// Whether the data determine every parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Identified {
    Determined {
        inverse: DMatrix<f64>,
        condition_number: f64,
    },
    /// The parameters that take part in the least determined direction.
    Undetermined {
        condition_number: Option<f64>,
        parameters: Vec<usize>,
    },
}

/// A parameter takes part in a direction when its share of the unit vector's square is at least
/// this: the few that a reader is to be told of.
const TAKES_PART: f64 = 0.1;

/// Inverts the information matrix, or names what it does not determine.
#[must_use]
pub fn identified(information: &DMatrix<f64>, max_condition_number: f64) -> Identified {
    let silent: Vec<usize> = (0..information.nrows())
        .filter(|&i| information[(i, i)] <= 0.0)
        .collect();
    if !silent.is_empty() || !information.iter().all(|h| h.is_finite()) {
        return Identified::Undetermined {
            condition_number: None,
            parameters: silent,
        };
    }
    let scaled = scaled(information, &scale(information));
    let eigenvalues = scaled.symmetric_eigenvalues();
    let (smallest, most) = (eigenvalues.min(), eigenvalues.max());
    if let Some(inverse) = inverse(information).filter(|_| smallest > most / max_condition_number) {
        return Identified::Determined {
            inverse,
            condition_number: most / smallest,
        };
    }
    let eigen = SymmetricEigen::new(scaled);
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let parameters = (0..direction.len())
        .filter(|&j| direction[j] * direction[j] >= TAKES_PART)
        .collect();
    Identified::Undetermined {
        condition_number: (smallest > 0.0).then(|| most / smallest),
        parameters,
    }
}
