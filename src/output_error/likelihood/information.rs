//! The information matrix (1.7): its inverse, or the direction that the data do not determine.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::numerics::linear_algebra::symmetric::{inverse, scale, scaled};

/// Identifiability of the parameters together.
#[derive(Clone, Debug, PartialEq)]
pub enum Identification {
    /// The data determine every parameter.
    Determined {
        inverse: DMatrix<f64>,
        condition_number: f64,
    },
    /// The data do not determine a direction; `parameters` take part in it.
    Undetermined {
        condition_number: Option<f64>,
        parameters: Vec<usize>,
    },
}

/// Share of a direction's unit square above which a parameter is named: the few that matter to a
/// reader.
const NAMED_SHARE: f64 = 0.1;

impl Identification {
    /// Inverts an information matrix, or finds the least determined direction.
    #[must_use]
    pub fn identify(information: &DMatrix<f64>, max_condition_number: f64) -> Identification {
        let unexcited: Vec<usize> = (0..information.nrows())
            .filter(|&i| information[(i, i)] <= 0.0)
            .collect();
        if !unexcited.is_empty() || !information.iter().all(|h| h.is_finite()) {
            return Identification::Undetermined {
                condition_number: None,
                parameters: unexcited,
            };
        }
        let scaled = scaled(information, &scale(information));
        let eigenvalues = scaled.symmetric_eigenvalues();
        let (least, most) = (eigenvalues.min(), eigenvalues.max());
        match inverse(information).filter(|_| least > most / max_condition_number) {
            Some(inverse) => Identification::Determined {
                inverse,
                condition_number: most / least,
            },
            None => Identification::Undetermined {
                condition_number: (least > 0.0).then(|| most / least),
                parameters: named_parameters(&least_determined_direction(scaled)),
            },
        }
    }
}

fn least_determined_direction(information: DMatrix<f64>) -> DVector<f64> {
    let eigen = SymmetricEigen::new(information);
    let least = eigen.eigenvalues.imin();
    eigen.eigenvectors.column(least).into_owned()
}

fn named_parameters(direction: &DVector<f64>) -> Vec<usize> {
    let shares = direction.iter().map(|v| v * v).enumerate();
    shares
        .filter(|(_, share)| *share >= NAMED_SHARE)
        .map(|(j, _)| j)
        .collect()
}
