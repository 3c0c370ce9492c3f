//! Tables of maneuvers' estimates: fits, derivatives, correlations, joint estimation.

use std::collections::BTreeMap;

use crate::maneuver::{Maneuver, Status};
use crate::schema::{table, words};

table! {
    /// Outcome of each maneuver's estimation, and of its prediction from other maneuvers.
    ///
    /// Rows of maneuvers estimated together (`estimate: joint:`) follow, with `maneuver_id`
    /// `joint/<class>/<mean α>`.
    pub struct FitRow in "fits" per "maneuver" {
        /// Maneuver, or group of maneuvers estimated together.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Outcome of the estimation; only converged fits go into trends, predictions and joint
        /// estimates.
        pub outcome: Outcome,
        /// Cause of the outcome: what makes the fit doubtful, what ended the iteration, which
        /// derivatives are undetermined, or what was missing. With `hold: evidence` also the
        /// undetermined derivatives that have no tunnel value to be held at.
        pub reason: String,
        /// Starting values of the iteration that led to the outcome: the configured ones, or the
        /// alternative if these do not converge.
        pub start: Option<StartingValues>,
        /// Number of steps of the iteration.
        pub iterations: usize ["1"],
        /// Cost J of eq. 1.2 at the start of output error, weights on residuals in deg, deg/s and g. None
        /// for maneuvers that filter error estimates together.
        pub initial_cost: Option<f64> ["1"],
        /// Cost J of eq. 1.2 at the end of output error, also where filter error follows. Like the
        /// initial cost it has the weights of the class's table, whatever weights the fit has. None
        /// for maneuvers that filter error estimates together.
        pub final_cost: Option<f64> ["1"],
        /// Condition number of the information matrix scaled to unit diagonal; beyond 10¹⁰ the fit
        /// is `unidentifiable`.
        pub condition_number: Option<f64> ["1"],
        /// Share of the output samples that the cost leaves out: bridged, despiked or missing.
        pub left_out: Option<f64> ["1"],
        /// Square root of the condition number; empty if a direction is not determined at all.
        pub largest_condition_index: Option<f64> ["1"],
        /// Groups of nearly collinear parameters, worst first, `; ` between groups. A group has a
        /// condition index of 30 or more and half or more of the variance of two or more
        /// parameters (Belsley). A constant with its slope, biases and initial states are
        /// collinear by nature; a group of control derivatives calls for other inputs.
        pub confounded: Option<String>,
        /// Method of the estimates.
        pub method: Option<EstimationMethod>,
        /// Gust speed across the flight path, rms, by filter error: `w_g` of a longitudinal, `v_g`
        /// of a lateral maneuver. Filter error estimates the high-frequency intensity of the flow
        /// angle; it is converted to a speed with a turbulence scale of 1,750 ft (Dryden). Of
        /// maneuvers estimated together the root mean square.
        pub gust_ft_s: Option<f64> ["ft/s"],
        /// Rotary gust, rms: `q_g`, or the larger one of `p_g` and `r_g`. Of maneuvers estimated together
        /// the root mean square.
        pub rotary_gust_deg_s: Option<f64> ["deg/s"],
        /// Corner of the rotary gusts; none for maneuvers estimated together, each of which has its own.
        pub gust_corner_rad_s: Option<f64> ["rad/s"],
        /// Correlation of neighbouring residuals, or innovations, of the output with the largest one.
        /// White noise has none.
        pub autocorrelation: Option<f64> ["1"],
        /// Log-likelihood that filter error gained over output error; none for maneuvers estimated
        /// together.
        pub likelihood_gain: Option<f64> ["1"],
        /// Distance of the derivatives from equation error, √(dᵀ C⁻¹ d / n). d are the differences
        /// of the n derivatives that both methods estimate, C is the sum of the two covariances.
        /// Around or below one if they agree: the methods use the same data, so that C is rather
        /// too large.
        pub equation_error_distance: Option<f64> ["1"],
    }
}

impl FitRow {
    /// Row of a maneuver with this outcome, and no numbers.
    #[must_use]
    pub fn without_numbers(maneuver_id: &str, class: &str, outcome: Outcome) -> FitRow {
        FitRow {
            maneuver_id: maneuver_id.to_owned(),
            class: class.to_owned(),
            outcome,
            reason: String::new(),
            start: None,
            iterations: 0,
            initial_cost: None,
            final_cost: None,
            condition_number: None,
            left_out: None,
            largest_condition_index: None,
            confounded: None,
            method: None,
            gust_ft_s: None,
            rotary_gust_deg_s: None,
            gust_corner_rad_s: None,
            autocorrelation: None,
            likelihood_gain: None,
            equation_error_distance: None,
        }
    }
}

words! {
    /// Method of estimation.
    pub enum EstimationMethod {
        /// Still air: the outputs of the integrated equations are matched to the measured ones.
        OutputError = "output error",
        /// Moving air: the states are corrected by the measurements, sample by sample.
        FilterError = "filter error",
    }
}

words! {
    /// Outcome of an estimation.
    pub enum Outcome {
        /// The iteration reached the minimum.
        Converged = "converged",
        /// The iteration reached the minimum, and the fit is not credible; the reason names why
        /// (`estimate: expert: doubt:`). With `estimate: doubtful: use` such a fit is `converged`.
        Doubtful = "doubtful",
        /// The iteration stopped before the minimum; the reason names the cause.
        NotConverged = "not_converged",
        /// The data do not determine some direction of the parameters; the reason names the
        /// derivatives.
        Unidentifiable = "unidentifiable",
        /// The maneuver was not estimated.
        Rejected = "rejected",
    }
}

words! {
    /// Starting values of the iteration.
    pub enum StartingValues {
        /// Derivatives that the measured accelerations imply.
        EquationError = "equation error",
        /// The wind tunnel's derivatives.
        WindTunnel = "wind tunnel",
        /// Weighted mean of the maneuvers' own estimates, for a joint estimation.
        SingleEstimates = "single estimates",
    }
}

table! {
    /// Derivatives and biases of each maneuver.
    ///
    /// `bound`, `bound_held` and `bound_calibration` are standard deviations (one sigma).
    /// `bound_corrected` is the half width of a 95 % interval over 1.96.
    ///
    /// - `bound` is the Cramér-Rao bound with the effect G P Gᵀ of the held values: the root of the
    ///   diagonal of a covariance. In output error the covariance is
    ///   H⁻¹ [Σ Sᵀ W R̂ W S] H⁻¹ + G P Gᵀ for any weights W. S are the sensitivities of the
    ///   outputs, H = Σ Sᵀ W S, and R̂ the variances of the residuals. In filter error it is
    ///   H⁻¹ + G P Gᵀ, with H the information matrix of the innovations. Both assume that residuals
    ///   or innovations are white.
    /// - `bound_held` is the root of the diagonal of G P Gᵀ: the effect of the uncertainty P of the
    ///   held values on the estimates. G = −H⁻¹ Σ Sᵀ W S_h, with W the inverse covariance of the
    ///   innovations in filter error. S_h are the sensitivities to the held values. Inactive
    ///   derivatives that act at the tunnel's value count as held. P is the tunnel table's
    ///   `uncertainty`, or 20 % (`held_uncertainty_pct`) of the root mean square of the
    ///   derivative's table. Maneuvers that hold the same value share its error: it does not
    ///   average out.
    /// - `bound_corrected` allows for coloured residuals, or innovations in filter error: the
    ///   autocovariance of an autoregressive process per output replaces their variances. It also
    ///   counts noise of the measured surfaces and errors of calibration. Student's t accounts for
    ///   the few seconds from which the autocovariance is estimated. `bound_corrected` is never
    ///   below `bound`, and contains `bound_held`. `docs/coverage.md` has the measured coverage of
    ///   its intervals.
    /// - `bound_calibration` is the effect of each instrument's `uncertainty` in `aircraft.yaml`.
    ///   It is the root sum of squares of the estimates' changes with one standard deviation of
    ///   each signal's bias and scale error. It does not average out over maneuvers with the same
    ///   instruments.
    ///
    /// No bound contains errors of signals without such an `uncertainty` (as shipped: mass, c.g.,
    /// inertias). None contains noise of signals other than the five outputs and the surfaces.
    ///
    /// With `estimate: held_values: posterior` the stage `model` replaces the held values and their
    /// uncertainty P by those of the posterior of the other flights. It changes `value`, `bound`,
    /// `bound_held` and `bound_corrected`.
    ///
    /// Rows of maneuvers estimated together follow, with `flight_id` `joint`. They have the shared
    /// derivatives only. Trends, comparison and report use the single maneuvers alone, so that the
    /// same data do not count twice. To count maneuvers, leave out `flight_id` `joint`.
    pub struct EstimateRow in "estimates" per "maneuver and derivative or bias of its axis" {
        /// Maneuver, or group of maneuvers estimated together.
        pub maneuver_id: String,
        /// Flight, or stretch of a flight; `joint` for a group.
        pub flight_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Mean Mach number of the maneuver.
        pub mach: f64 ["1"],
        /// Name of the derivative in the model, or of the bias.
        pub derivative: String,
        /// Unit of the derivative or bias.
        pub unit: String,
        /// Status of the derivative in this maneuver.
        pub status: Status,
        /// Estimate, also of a fit that did not converge; the value it was held at; empty if
        /// inactive. Held values are the tunnel's, from the stage `model` on those of the posterior of
        /// the other flights (`estimate: held_values`). In the column `unit`.
        pub value: Option<f64>,
        /// Cramér-Rao bound, with the uncertainty of the held values; empty unless estimated and
        /// determined by the data. In the column `unit`.
        pub bound: Option<f64>,
        /// Part of `bound` and `bound_corrected` that comes from the held values, in the column
        /// `unit`.
        pub bound_held: Option<f64>,
        /// Part of `bound_corrected` that comes from the errors that remain in the signals, and from the
        /// remaining uncertainty of the surfaces' delays, in the column `unit`; empty where all count as
        /// exact.
        pub bound_calibration: Option<f64>,
        /// Bound for coloured residuals, noisy surfaces and errors of calibration: the one to use.
        /// In the column `unit`.
        pub bound_corrected: Option<f64>,
        /// Tunnel's value at the maneuver's α and Mach number, in the column `unit`.
        pub wind_tunnel: Option<f64>,
        /// H_jj (H⁻¹)_jj: factor by which the other parameters raise the variance. Above 10 it is
        /// flagged; empty if the data do not determine it.
        pub variance_inflation: Option<f64> ["1"],
        /// Root mean square of the regressor about its mean; empty for constants.
        pub excitation: Option<f64> ["deg, or rad of p b/2V, q c̄/2V or r b/2V"],
        /// Root mean square of derivative × regressor about its mean over that of the whole
        /// coefficient. Parts that cancel make more than 100.
        pub contribution_pct: Option<f64> ["%"],
        /// Second opinion: the same derivative by equation error in the frequency domain, in the
        /// column `unit`. It regresses the coefficients that the measured accelerations imply, from
        /// 0.1 to 2.5 Hz, without integration and without the table's weights. None for constants and
        /// biases, and where the data do not determine it. Noise in the regressors draws it towards
        /// zero.
        pub equation_error: Option<f64>,
        /// Standard error of `equation_error`, in the column `unit`: the half width of a 95 % interval
        /// over 1.96. It counts the residuals' spectrum and the uncertainty of held values, but no
        /// errors of calibration.
        pub equation_error_bound: Option<f64>,
        /// Reason why the maneuver holds it, with `hold: evidence`, or leaves it out, where its surface
        /// rests; empty where the class's table decides.
        pub held_because: Option<String>,
    }
}

/// `flight_id` of maneuvers estimated together.
pub const JOINT_FLIGHT: &str = "joint";

impl EstimateRow {
    /// Rows of each maneuver, which are consecutive.
    #[must_use]
    pub fn by_maneuver(rows: &[EstimateRow]) -> BTreeMap<&str, &[EstimateRow]> {
        rows.chunk_by(|a, b| a.maneuver_id == b.maneuver_id)
            .map(|own| (own[0].maneuver_id.as_str(), own))
            .collect()
    }

    /// Reason why the maneuver's evidence holds the derivative.
    #[must_use]
    pub fn evidence_to_hold(&self) -> Option<&str> {
        self.held_because
            .as_deref()
            .filter(|_| self.status == Status::Held)
    }

    /// `true` for a row of maneuvers estimated together.
    #[must_use]
    pub fn is_joint(&self) -> bool {
        self.flight_id == JOINT_FLIGHT
    }

    /// Row of a maneuver's derivative without results.
    #[must_use]
    pub fn without_results(
        maneuver: &Maneuver,
        derivative: &str,
        unit: &str,
        status: Status,
    ) -> EstimateRow {
        EstimateRow {
            maneuver_id: maneuver.maneuver_id.clone(),
            flight_id: maneuver.flight_id.clone(),
            class: maneuver.class.clone(),
            alpha_deg: maneuver.alpha_deg,
            mach: maneuver.mach,
            derivative: derivative.to_owned(),
            unit: unit.to_owned(),
            status,
            value: None,
            bound: None,
            bound_held: None,
            bound_calibration: None,
            bound_corrected: None,
            wind_tunnel: None,
            variance_inflation: None,
            excitation: None,
            contribution_pct: None,
            equation_error: None,
            equation_error_bound: None,
            held_because: None,
        }
    }
}

table! {
    /// Correlations within each maneuver.
    ///
    /// Pairs of regressors are all those that the class estimates or holds. Pairs of estimates are
    /// those of at least 0.5 (`published_correlation`). The limits are settings: `estimate:
    /// identifiability:`.
    pub struct CorrelationRow in "correlations" per "maneuver and pair" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Kind of the pair.
        pub kind: CorrelationKind,
        /// Signal, `alpha` or `beta`; or derivative, bias or initial state.
        pub first: String,
        /// As `first`.
        pub second: String,
        /// Correlation coefficient; the report flags it beyond 0.9.
        pub correlation: f64 ["1"],
    }
}

words! {
    /// Kind of a correlated pair.
    pub enum CorrelationKind {
        /// Correlation of the time histories of two regressors over the maneuver (the paper's Figures
        /// 3, 10 and 11).
        Regressors = "regressors",
        /// Correlation of the errors of two estimates, from the inverse of the information matrix.
        Estimates = "estimates",
    }
}

table! {
    /// Maneuvers that are estimated together, where `estimate: joint:` asks for it.
    pub struct JointRow in "joint" per "group of maneuvers estimated together, and maneuver" {
        /// `maneuver_id` of the group's rows in `fits`, `estimates` and `combined`.
        pub joint_id: String,
        /// Class of the maneuvers.
        pub class: String,
        /// Mean angle of attack of the maneuvers that take part.
        pub joint_alpha_deg: f64 ["deg"],
        /// Mean Mach number of the maneuvers that take part.
        pub joint_mach: f64 ["1"],
        /// Number of maneuvers that take part.
        pub maneuvers: usize ["maneuvers"],
        /// Maneuver.
        pub maneuver_id: String,
        /// Flight of the maneuver.
        pub flight_id: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Mean Mach number of the maneuver.
        pub mach: f64 ["1"],
        /// Participation of the maneuver.
        pub part: Participation,
        /// Cost with the maneuver's own derivatives: J of eq. 1.2, or −log of the likelihood where filter
        /// error estimates the group. None for a maneuver that filter error cannot estimate alone.
        pub cost_alone: Option<f64> ["1"],
        /// Same cost with the shared derivatives; much larger where the maneuver does not share them.
        pub cost_joint: Option<f64> ["1"],
    }
}

words! {
    /// Participation of a maneuver in a joint estimation.
    pub enum Participation {
        /// The maneuver takes part.
        Joined = "joined",
    }
    or text {
        /// The reason why it was left out: it could not be estimated alone.
        LeftOut
    }
}
