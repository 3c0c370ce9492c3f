//! Tables of the study of bounds on simulated maneuvers (`harvest lab validate`).

use crate::schema::table;

table! {
    /// Coverage of the bounds: one simulated maneuver recorded many times with other noise.
    pub struct CoverageRow in "coverage"
        per "class, angle of attack, noise, weights and derivative" {
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Noise of the records: `white` or `coloured` for the outputs, or `noise on every channel`.
        pub residuals: String,
        /// Weights of the cost: `table` or `estimated`.
        pub weights: String,
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
        /// Starting values: `twice the truth`, `half the truth` or `surfaces without effect`.
        pub start: String,
        /// Number of records.
        pub records: usize ["records"],
        /// Number of records whose iteration reached the minimum from these values.
        pub alone: usize ["records"],
        /// Number of records that reached the minimum with the other start tried as well: the
        /// equation-error solution where the first does not converge.
        pub reached: usize ["records"],
    }
}
