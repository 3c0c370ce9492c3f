//! Table of the flight-updated derivatives for simulators.

use crate::schema::table;

table! {
    /// Flight-updated derivatives for simulators, in the columns of a tunnel database: the trend
    /// where flight has data, the tunnel elsewhere.
    ///
    /// `harvest export` writes them into `export/` as CSV, Parquet, DAVE-ML and a JSBSim section.
    /// Where the tunnel depends on Mach, the lowest and highest Mach number flown are breakpoints:
    /// flight stands between them. Where flight has a sum (`CN_ba = CN_0 + CN_alpha α`) and its
    /// slope, the constant is the sum less the slope's part. The simulator then reproduces the sum,
    /// which flight determines best. The constant's uncertainty is that of both as if independent.
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
        /// Source of the value: flight with its trend, or the tunnel's own source.
        pub source: String,
        /// 1 where the value is flight's, 0 where it is the tunnel's.
        pub is_flight: usize ["1"],
    }
}

impl ExportRow {
    /// Declared name of the column that is published under the third variable's name.
    pub const THIRD: &str = "third";
}
