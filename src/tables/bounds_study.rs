//! Tables of the study of bounds on simulated maneuvers (`harvest lab validate`).

use crate::schema::{table, words};

table! {
    /// Coverage of the bounds: one simulated maneuver recorded many times with other noise.
    pub struct CoverageRow in "coverage"
        per "class, angle of attack, noise, weights and derivative" {
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Noise of the records.
        pub residuals: Residuals,
        /// Weights of the cost.
        pub weights: Weights,
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// True value, in the column `unit`.
        pub truth: f64,
        /// Number of records.
        pub realisations: usize ["records"],
        /// Number of records whose estimation converged.
        pub converged: usize ["records"],
        /// Mean of the estimates less the truth, in the column `unit`.
        pub bias: f64,
        /// Standard deviation of the estimates, in the column `unit`.
        pub scatter: f64,
        /// Bias over scatter.
        pub bias_over_scatter: f64 ["1"],
        /// Scatter over the root mean square of `bound`.
        pub scatter_over_bound: f64 ["1"],
        /// Share of the records whose interval ±1 `bound` contains the truth.
        pub coverage_68: f64 ["1"],
        /// Share of the records whose interval ±1.96 `bound` contains the truth.
        pub coverage_95: f64 ["1"],
        /// Scatter over the root mean square of `bound_corrected`.
        pub scatter_over_corrected: f64 ["1"],
        /// Share of the records whose interval ±1 `bound_corrected` contains the truth.
        pub corrected_coverage_68: f64 ["1"],
        /// Share of the records whose interval ±1.96 `bound_corrected` contains the truth.
        pub corrected_coverage_95: f64 ["1"],
    }
}

table! {
    /// Convergence from other starting values to the minimum that is reached from the truth.
    pub struct StartRow in "starts" per "class, angle of attack and starting values" {
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Starting values.
        pub start: StartVariant,
        /// Number of records.
        pub records: usize ["records"],
        /// Number of records whose iteration reached the minimum from these values.
        pub alone: usize ["records"],
        /// Number of records that reached the minimum with the other start tried as well: the
        /// equation-error solution where the first does not converge.
        pub reached: usize ["records"],
    }
}

words! {
    /// Noise of the records in the study of bounds.
    pub enum Residuals {
        /// White noise of the outputs.
        White = "white",
        /// Coloured noise of the outputs with the same standard deviation.
        Coloured = "coloured",
        /// White noise of every channel, including those that the estimator takes as exact:
        /// surfaces, airspeed, the other axis.
        EveryChannel = "noise on every channel",
    }
}

words! {
    /// Source of the weights on the residuals.
    pub enum Weights default Table {
        /// Tables 2 and 4.
        Table = "table",
        /// Inverse of the residuals' variances, re-estimated in alternation with the parameters
        /// until both settle.
        Estimated = "estimated",
    }
}

words! {
    /// Starting values relative to the true ones.
    pub enum StartVariant {
        /// Half of the true values.
        Half = "half the truth",
        /// True values, with the derivatives of surfaces zero.
        NoSurfaces = "surfaces without effect",
        /// Twice the true values.
        Double = "twice the truth",
    }
}
