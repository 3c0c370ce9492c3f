//! Prior of the size and length of a derivative's difference from the tunnel: both are lognormal.

use crate::tables::Knowledge;

/// Standard deviation of the logarithm of the size.
pub(super) const SPREAD_OF_SIZE: f64 = 0.8;

/// Standard deviation of the logarithm of the size of a table with stated uncertainties.
const SPREAD_OF_STATED_SIZE: f64 = 0.4;

/// Standard deviation of the logarithm of the length.
const SPREAD_OF_LENGTH: f64 = 0.5;

/// Size and length of a difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Size of the difference over the size of the table, or over the stated uncertainty.
    pub size: f64,
    pub length_deg: f64,
}

/// Prior of size and length.
#[derive(Clone, Copy, Debug)]
pub struct ScalePrior {
    pub centre: Scale,
    /// Standard deviations of the logarithms of size and length.
    spreads: [f64; 2],
}

/// Minus the log of the prior of a scale, with its first and second derivatives by the logarithms
/// of size and length. The mixed derivatives are zero.
#[derive(Clone, Copy, Debug)]
pub struct Penalty {
    pub value: f64,
    pub gradient: [f64; 2],
    pub curvature: [f64; 2],
}

impl ScalePrior {
    #[must_use]
    pub fn new(centre: Scale, known: Knowledge) -> ScalePrior {
        let size = match known {
            Knowledge::TableWithUncertainty => SPREAD_OF_STATED_SIZE,
            Knowledge::Table | Knowledge::Magnitude => SPREAD_OF_SIZE,
        };
        ScalePrior {
            centre,
            spreads: [size, SPREAD_OF_LENGTH],
        }
    }

    #[must_use]
    pub fn penalty(&self, scale: &Scale) -> Penalty {
        let size = (scale.size / self.centre.size).ln();
        let length = (scale.length_deg / self.centre.length_deg).ln();
        let curvature = self.spreads.map(|spread| 1.0 / (spread * spread));
        let gradient = [size * curvature[0], length * curvature[1]];
        Penalty {
            value: 0.5 * (size * gradient[0] + length * gradient[1]),
            gradient,
            curvature,
        }
    }
}
