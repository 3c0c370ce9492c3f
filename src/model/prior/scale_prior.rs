//! Prior of the size and length of a derivative's difference from the tunnel: both are lognormal.

use crate::tables::PriorSource;

/// Standard deviation of the logarithm of the size.
pub(in crate::model) const DEVIATION_OF_LOG_SIZE: f64 = 0.8;

/// Standard deviation of the logarithm of the size of a table with stated uncertainties.
const DEVIATION_OF_LOG_STATED_SIZE: f64 = 0.4;

/// Standard deviation of the logarithm of the length.
const DEVIATION_OF_LOG_LENGTH: f64 = 0.5;

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
    log_deviations: [f64; 2],
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
    pub fn new(centre: Scale, source: PriorSource) -> ScalePrior {
        let size = match source {
            PriorSource::TableWithUncertainty => DEVIATION_OF_LOG_STATED_SIZE,
            PriorSource::Table | PriorSource::Magnitude => DEVIATION_OF_LOG_SIZE,
        };
        ScalePrior {
            centre,
            log_deviations: [size, DEVIATION_OF_LOG_LENGTH],
        }
    }

    #[must_use]
    pub fn penalty(&self, scale: &Scale) -> Penalty {
        let size = (scale.size / self.centre.size).ln();
        let length = (scale.length_deg / self.centre.length_deg).ln();
        let curvature = self
            .log_deviations
            .map(|deviation| 1.0 / (deviation * deviation));
        let gradient = [size * curvature[0], length * curvature[1]];
        Penalty {
            value: 0.5 * (size * gradient[0] + length * gradient[1]),
            gradient,
            curvature,
        }
    }
}
