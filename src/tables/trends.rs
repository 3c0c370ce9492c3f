//! Tables of trends: derivatives across angle of attack.

use crate::schema::table;

table! {
    /// Least-squares trends across angle of attack, and means where maneuvers are too few for a trend.
    pub struct TrendRow in "trends" per "derivative, group and angle of attack" {
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Group of `trend: groups:`, whose trend is flight's value, or a class alone, named as the
        /// class.
        pub group: String,
        /// Angle of attack: multiples of 5° (`alpha_step_deg`) and the tunnel's breakpoints within
        /// the flown range. Up to 0.5° (`alpha_reach_deg`) beyond it the row has the value at the
        /// last maneuver. Of a mean, that of its maneuvers.
        pub alpha_deg: f64 ["deg"],
        /// Value of the polynomial or spline, in the column `unit`.
        pub value: f64,
        /// Standard error of the trend, in the column `unit`, from the observed residuals. It
        /// includes the uncertainty of the order and the lack of fit at the flown angles of attack.
        pub standard_error: f64,
        /// Lower end of the trend's 95 % interval, in the column `unit`: Student's t with the
        /// residuals' degrees of freedom.
        pub lower_95: f64,
        /// Upper end of the trend's 95 % interval, in the column `unit`.
        pub upper_95: f64,
        /// Lower end of the 95 % prediction interval for one more maneuver with the median bound,
        /// in the column `unit`. It contains the trend's error, the scatter of maneuvers at one
        /// angle of attack, and the bound.
        pub prediction_lower_95: f64,
        /// Upper end of the 95 % interval for one more maneuver's estimate, in the column `unit`.
        pub prediction_upper_95: f64,
        /// Number of maneuvers through which the trend is fitted. Fewer than three have a mean at each
        /// flown angle of attack, with the normal interval.
        pub maneuvers: usize ["maneuvers"],
        /// Number of maneuvers far from the trend: rows of `outliers`.
        pub outliers: usize ["maneuvers"],
        /// `mean`, `polynomial`, or `spline` with its knots: `knots_deg` of all trends or of a group, else
        /// flown angles of attack.
        pub curve: String,
        /// Order of the polynomial, or of the spline between its knots, chosen by the criterion
        /// (`aicc` or `bic`) up to `max_order`.
        pub order: usize ["1"],
        /// Standard deviation τ between maneuvers beyond their bounds, in the column `unit`, of the
        /// median maneuver; a class of eight or more has its own. Weights are
        /// 1/(`bound_corrected`² + τ²), less for outliers.
        pub scatter: f64,
    }
}

table! {
    /// Estimates far from the trend of their group.
    pub struct OutlierRow in "outliers" per "maneuver far from its group's trend" {
        /// Name of the derivative in the model.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Group of the trend.
        pub group: String,
        /// Maneuver.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Estimate of the maneuver, in the column `unit`.
        pub value: f64,
        /// Corrected bound of the estimate, in the column `unit`.
        pub bound: f64,
        /// Value of the trend at that angle of attack, in the column `unit`.
        pub trend: f64,
        /// Value minus trend over its standard deviation √(bound² + τ²), allowing for the pull of
        /// the estimate on the trend; rows have more than 3 (`outlier_z`).
        pub z: f64 ["1"],
        /// Remaining share of the maneuver's weight in the trend; 1 for a maneuver that is no
        /// outlier.
        pub weight_share: f64 ["1"],
    }
}
