//! Tables of the campaign's posterior: tunnel and flight as one answer.

use crate::schema::{table, words};

table! {
    /// Posterior of each derivative over the flight condition: the tunnel's table as prior, all
    /// converged maneuvers as evidence.
    ///
    /// It counts the maneuvers' whole covariances and the exact effect of the held values. It also
    /// counts errors common to a flight, a class or the campaign. Between the rows it is linear.
    /// The constant of a sum (`CN_ba = CN_0 + CN_alpha α`) is the sum less the slope's part, with
    /// both covariances counted. Constants without a table have no row.
    pub struct PosteriorRow in "posterior" per "derivative and flight condition" {
        /// Name of the derivative in the model, or of a sum.
        pub derivative: String,
        /// Unit of the derivative.
        pub unit: String,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Mach number; empty where the tunnel's table does not depend on it.
        pub mach: Option<f64> ["1"],
        /// Third variable of the tunnel's tables, in its unit; empty without one.
        pub third: Option<f64> ["the variable's unit"],
        /// Mean of the posterior, in the column `unit`.
        pub value: f64,
        /// Standard deviation of the posterior, in the column `unit`.
        pub standard_deviation: f64,
        /// Lower end of the 95 % interval, in the column `unit`.
        pub lower_95: f64,
        /// Upper end of the 95 % interval, in the column `unit`.
        pub upper_95: f64,
        /// Tunnel's value, in the column `unit`; empty without a table.
        pub wind_tunnel: Option<f64>,
        /// Standard deviation of the prior, in the column `unit`. Its size follows from all flights
        /// (table `hyperparameters`).
        pub prior_deviation: f64,
        /// Share of the information that flight gave: 1 − posterior variance over prior variance.
        pub flight_share_pct: Option<f64> ["%"],
        /// Number of maneuvers that estimate the derivative within the length of its difference from
        /// the tunnel; with none, flight acts through other derivatives alone.
        pub maneuvers: usize ["maneuvers"],
    }
}

table! {
    /// Covariances of the posterior within each coefficient, each pair once, at the tunnel's breakpoints.
    ///
    /// Different coefficients are independent. The constant of a sum follows from sum and slope.
    pub struct CovarianceRow in "posterior_covariance" per "pair of derivatives and breakpoints" {
        /// Derivative or sum.
        pub first: String,
        /// Angle of attack of `first`.
        pub first_alpha_deg: f64 ["deg"],
        /// Mach number of `first`.
        pub first_mach: Option<f64> ["1"],
        /// Third variable of `first`.
        pub first_third: Option<f64> ["the variable's unit"],
        /// Derivative or sum.
        pub second: String,
        /// Angle of attack of `second`.
        pub second_alpha_deg: f64 ["deg"],
        /// Mach number of `second`.
        pub second_mach: Option<f64> ["1"],
        /// Third variable of `second`.
        pub second_third: Option<f64> ["the variable's unit"],
        /// Covariance of the two values.
        pub covariance: f64 ["product of both derivatives' units"],
    }
}

words! {
    /// Source of the prior of a derivative.
    pub enum PriorSource {
        /// Tunnel table.
        Table = "table",
        /// Tunnel table that states its uncertainty.
        TableWithUncertainty = "table with uncertainty",
        /// Its order of magnitude alone.
        Magnitude = "order of magnitude",
    }
}

table! {
    /// Size and length of each derivative's difference from the tunnel: the most probable ones given
    /// all flights.
    pub struct ScaleRow in "hyperparameters" per "derivative" {
        /// Name of the derivative in the model, or of a sum.
        pub derivative: String,
        /// Knowledge about the derivative before flight.
        pub knowledge: PriorSource,
        /// Standard deviation of the difference, divided by the root mean square of the tunnel's
        /// table, by its stated uncertainty, or by the order of magnitude of the estimates.
        pub size: f64 ["1"],
        /// Angle of attack over which the difference changes.
        pub length_deg: f64 ["deg"],
    }
}

table! {
    /// Maneuvers in the posterior.
    pub struct ContributionRow in "contributions" per "maneuver and coefficient" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Coefficient.
        pub coefficient: String,
        /// Weight of the maneuver: 1, or less where all other maneuvers contradict it (Student's t).
        pub weight: f64 ["1"],
    }
}

table! {
    /// Lift and drag of each maneuver whose normal and axial force are estimated, from the rows of
    /// `estimates`. C_L = C_N cos α − C_A sin α; C_D = C_N sin α + C_A cos α.
    ///
    /// Row `total` has the coefficients in the mean flight condition. The other rows have their slopes along
    /// a regressor, at that condition; along α the axes turn as well.
    pub struct LiftAndDragRow in "lift_and_drag" per "maneuver and regressor" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Mean Mach number.
        pub mach: f64 ["1"],
        /// Regressor as in `model.yaml`, or `total`.
        pub regressor: String,
        /// Unit of lift and drag.
        pub unit: String,
        /// C_L or its slope, in the column `unit`.
        pub lift: f64,
        /// Standard deviation of `lift`, with the uncertainty of what the maneuver holds, in the column `unit`.
        pub lift_bound: f64,
        /// C_D or its slope, in the column `unit`.
        pub drag: f64,
        /// Standard deviation of `drag`, in the column `unit`.
        pub drag_bound: f64,
        /// Correlation of the errors of `lift` and `drag`.
        pub correlation: Option<f64> ["1"],
    }
}

words! {
    /// Part of the campaign that is left out.
    pub enum LeftOutKind {
        /// A flight, predicted by the others.
        Flight = "flight",
        /// A class of maneuvers, predicted by the others.
        Class = "class",
    }
}

table! {
    /// Check of the posterior without truth: each flight as the other flights predict it, each
    /// class as the other classes predict it.
    ///
    /// This check cannot find an error that all flights share.
    pub struct SelfCheckRow in "self_check" per "flight or class left out, and coefficient" {
        /// Kind of what is left out.
        pub left_out: LeftOutKind,
        /// Flight or class.
        pub item: String,
        /// Coefficient.
        pub coefficient: String,
        /// Number of its estimates.
        pub estimates: usize ["estimates"],
        /// Share of the estimates inside the 95 % interval of their prediction.
        pub inside_95_pct: f64 ["%"],
        /// Log density of the estimates under their prediction, each in its own unit.
        pub log_density: f64 ["1"],
    }
}
