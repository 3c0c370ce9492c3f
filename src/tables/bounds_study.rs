//! Tables of the study of bounds on simulated maneuvers (`harvest lab validate`).

use crate::schema::{table, words};

table! {
    /// Errors of all estimates of a condition. Constants are left out.
    pub struct ConditionRow in "conditions" per "condition and class" {
        /// Condition of the study, by its name in the cards.
        pub condition: String,
        /// Class of the maneuvers; `all` for the classes together.
        pub class: String,
        /// Number of records.
        pub records: usize ["records"],
        /// Number of records whose estimation converged; only these count below.
        pub converged: usize ["records"],
        /// Median number of steps of the iteration.
        pub iterations: Option<f64> ["1"],
        /// Number of estimated derivatives in all records.
        pub estimates: usize ["estimates"],
        /// Share of the estimates whose interval ±1.96 `bound` contains the truth.
        pub coverage_95: f64 ["1"],
        /// Share of the estimates whose interval ±1.96 `bound_corrected` contains the truth.
        pub corrected_coverage_95: f64 ["1"],
        /// Median magnitude of the error over the derivative's size: the root mean square of its true
        /// table.
        pub error_pct: Option<f64> ["%"],
        /// Median of `bound_corrected` over the derivative's size.
        pub corrected_bound_pct: Option<f64> ["%"],
        /// Median of `bound_corrected` over `bound`.
        pub correction: Option<f64> ["1"],
    }
}

table! {
    /// Coverage of the bounds: one simulated maneuver flown and recorded many times.
    pub struct CoverageRow in "coverage"
        per "condition, class, angle of attack and derivative" {
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Condition of the study, by its name in the cards.
        pub condition: String,
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
