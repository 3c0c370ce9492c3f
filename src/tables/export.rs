//! Table of the flight-updated derivatives for simulators.

use crate::schema::table;

table! {
    /// Flight-updated derivatives for simulators, in the columns of a tunnel database: the posterior.
    ///
    /// `harvest export` writes them into `export/` as CSV, Parquet, DAVE-ML and a JSBSim section.
    /// Constants that the posterior does not have are the tunnel's. Correlations are in
    /// `posterior_covariance` and, between derivatives, in the DAVE-ML file.
    pub struct ExportRow in "flight_updated" per "derivative and breakpoint of the export" {
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Mach number; empty where the table does not depend on it.
        pub mach: Option<f64> ["1"],
        /// Third variable of the tables. The column has the variable's name, and is absent without
        /// one.
        pub third: Option<f64> ["the variable's unit"],
        /// Value, in the column `unit`.
        pub value: f64,
        /// Unit of the derivative.
        pub unit: String,
        /// Standard uncertainty, in the column `unit`, where known.
        pub uncertainty: Option<f64>,
        /// Source of the value: the posterior, mostly flight or mostly wind tunnel; or the tunnel alone.
        pub source: String,
        /// 1 where flight gave half of the information or more, else 0.
        pub is_flight: usize ["1"],
    }
}

impl ExportRow {
    /// Declared name of the column that is published under the third variable's name.
    pub const THIRD: &str = "third";
}

table! {
    /// Models drawn from the posterior, for Monte Carlo in a simulator: `harvest export --draws N`.
    ///
    /// Each draw is a whole model; its values are correlated as the posterior's are.
    pub struct DrawRow in "draws" per "draw, derivative and breakpoint" {
        /// Number of the draw, from 1.
        pub draw: usize ["1"],
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Mach number; empty where the table does not depend on it.
        pub mach: Option<f64> ["1"],
        /// Third variable of the tables, in its unit; empty without one.
        pub third: Option<f64> ["the variable's unit"],
        /// Value, in the column `unit`.
        pub value: f64,
        /// Unit of the derivative.
        pub unit: String,
    }
}
