//! Settings of the estimation.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::aero::Output;
use crate::dynamics::motion::MassProperties;
use crate::filter_error::scoring;
use crate::output_error::calibration_errors::Calibration;
use crate::output_error::estimation::Weights;
use crate::output_error::identifiability;
use crate::output_error::{InitialState, newton_raphson};
use crate::settings::{settings, single_values};
use crate::surfaces;
use crate::tables::StartingValues;

/// Effect of an inactive surface that moves a little all the same because feedback stays closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InactiveSurfaces {
    /// Its motion acts at the wind tunnel's value, where there is one. Without it, feedback motion
    /// in step with a rate would be charged to that rate's derivative.
    #[default]
    WindTunnel,
    /// None (the paper).
    Absent,
}

/// Starting values of the iteration; the other ones are tried where it does not converge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// The derivatives that the measured accelerations imply. From the tunnel's values an airframe
    /// that is unstable without its feedback diverges within seconds; from these it does not.
    #[default]
    EquationError,
    /// The tunnel's values (the paper).
    WindTunnel,
}

/// Source of the values that a maneuver holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeldValues {
    /// The wind tunnel (the paper).
    Tunnel,
    /// The posterior of the other flights.
    #[default]
    Posterior,
}

/// Use of doubtful fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Doubtful {
    /// They enter no trend, prediction or joint estimate.
    #[default]
    LeaveOut,
    /// They count as converged, with their doubts as the reason.
    Use,
}

/// Choice of the derivatives that are held at the tunnel's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// By the class (Tables 1 and 3). Joint estimation needs it: the maneuvers must hold the same.
    #[default]
    Table,
    /// By the maneuver: derivatives that the tunnel determines better than the maneuver can.
    Evidence,
}

/// Method of estimation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Filter error: the air moves.
    #[default]
    FilterError,
    /// Output error, and filter error where its residuals are coloured.
    Auto,
    /// Output error: the air is still (the paper).
    OutputError,
}

impl Hold {
    /// Warning that goes with a choice.
    #[must_use]
    pub fn warning(self) -> Option<&'static str> {
        let warning = "estimate: hold: evidence: intervals cover less than with `table` if the tunnel is worse than stated: \
                       state its uncertainty";
        (self == Hold::Evidence).then_some(warning)
    }
}

impl From<Start> for StartingValues {
    fn from(start: Start) -> StartingValues {
        match start {
            Start::EquationError => StartingValues::EquationError,
            Start::WindTunnel => StartingValues::WindTunnel,
        }
    }
}

settings! {
    /// Settings of the estimation, of all classes.
    pub struct Settings {
        /// Method. `filter_error` estimates the motion of the air with the derivatives.
        /// `output_error` assumes still air, as the paper does. `auto` uses filter error where the
        /// residuals of output error are coloured. In gusts `output_error` charges them to the
        /// derivatives.
        pub method: Method = Method::default(),
        /// Weights of the residuals: `table` takes each class's own (Tables 2 and 4), `estimated` the
        /// inverse of the residuals' variances. `estimated` changes every estimate and its bound.
        pub weights: Weights = Weights::default(),
        /// Initial state of a maneuver: `estimated` with the derivatives, or `measured`, the first
        /// sample, whose noise then enters the estimates.
        pub initial_state: InitialState = InitialState::default(),
        /// Mass, centre of gravity and inertias: `recorded` sample by sample, or `mean`, one value
        /// per maneuver as in the paper.
        pub mass_properties: MassProperties = MassProperties::default(),
        /// Small feedback motion of surfaces that a class does not excite: `wind_tunnel` applies the
        /// tunnel's derivatives to it, `absent` ignores it as in the paper. `absent` charges motion
        /// in step with a rate to that rate's derivative.
        pub inactive_surfaces: InactiveSurfaces = InactiveSurfaces::default(),
        /// Start of the iteration: `equation_error`, or `wind_tunnel` as in the paper. The other
        /// start is tried where the iteration does not converge.
        pub start: Start = Start::default(),
        /// Choice of the derivatives that are held at the tunnel's value. `table` takes those of
        /// the class (Tables 1 and 3). `evidence` holds what the tunnel determines better than the
        /// maneuver. The intervals of `evidence` cover less than those of `table`.
        pub hold: Hold = Hold::default(),
        /// Use of fits that converged and are not credible by the limits of `expert: doubt:`.
        /// `leave_out` excludes them from trends, predictions and joint estimates, with the outcome
        /// `doubtful`. `use` counts them as `converged`.
        pub doubtful: Doubtful = Doubtful::default(),
        /// Standard uncertainty of a held derivative whose table states none, percent of the root
        /// mean square of the table. Larger: wider `bound_corrected`, and `evidence` holds fewer
        /// derivatives.
        pub held_uncertainty_pct: f64 = 20.0,
        /// Source of the held values in the tables from the stage `model` on. `posterior` takes
        /// them from the posterior of the other flights, `tunnel` from the wind tunnel, as in the
        /// paper. Trends are of the estimates as published, the posterior of those with the
        /// tunnel's values.
        #[serde(skip_serializing)]
        pub held_values: HeldValues = HeldValues::default(),
        /// Delays of the surfaces, estimated from all maneuvers of the campaign.
        #[serde(skip_serializing)]
        pub surfaces: surfaces::Settings = surfaces::Settings::default(),
        /// Joint estimation of maneuvers of one class and angle of attack, besides each alone. It
        /// adds rows and changes none; it needs `hold: table`.
        #[serde(skip_serializing)]
        pub joint: Option<JointSettings> = None,
        /// Prediction of each maneuver with derivatives from the others of its class and angle of
        /// attack; `null` turns it off. It changes no estimate.
        #[serde(skip_serializing)]
        pub prediction: Option<PredictionSettings> = Some(PredictionSettings::default()),
    }
    expert {
        /// Smallest standard deviation of each output with `weights: estimated`, deg, deg/s or g.
        /// Larger: outputs of coarse resolution weigh less.
        pub resolution: BTreeMap<Output, f64> = BTreeMap::new(),
        /// End of the iteration.
        pub iteration: newton_raphson::Settings = newton_raphson::Settings::default(),
        /// Constants (`CN_0`) that joined or predicting maneuvers share. `true` charges each flight's
        /// zero error of vanes and surfaces to the slopes; `false` lets each maneuver keep its own.
        #[serde(skip_serializing)]
        pub share_constants: bool = false,
        /// End of the iteration of filter error.
        pub filter: scoring::Settings = scoring::Settings::default(),
        /// Limits of the identifiability measures.
        pub identifiability: identifiability::CollinearityLimits = identifiability::CollinearityLimits::default(),
        /// Limits beyond which a fit is doubtful.
        pub doubt: DoubtLimits = DoubtLimits::default(),
    }
    elsewhere {
        /// Ordinary bias of each output's instrument: `instruments:` of aircraft.yaml.
        pub ordinary_bias: BTreeMap<Output, f64> = BTreeMap::new(),
        /// Uncertainty that calibration leaves of each signal: `instruments:` of aircraft.yaml.
        /// Signals without an entry count as exact, unless the flight itself determines their errors.
        pub calibration: BTreeMap<String, Calibration> = BTreeMap::new(),
        /// Largest share of marked samples over the outputs together, and in each surface:
        /// `segment: quality: marked_share`.
        pub max_marked_share: f64 = 0.2,
        /// Angle of attack over which an error of the tunnel changes, deg: `model: expert: length_deg`.
        pub tunnel_error_length_deg: f64 = 15.0,
    }
}
single_values!(Weights, Method, InitialState, MassProperties, InactiveSurfaces, Start, Hold, HeldValues, Doubtful, BTreeMap<Output, f64>);

settings! {
    /// Limits beyond which a fit that converged is doubtful.
    #[derive(Copy)]
    pub struct DoubtLimits {
        /// Least share of an output's measured variance that the fit explains, of outputs that move
        /// by more than an instrument's ordinary bias. At 0 a fit is doubtful where a constant would
        /// do better. Larger: more fits are doubtful.
        pub r_squared: f64 = 0.0,
        /// Smallest probability of a distance from the equation-error derivatives as large as the
        /// fit's, if both methods are right; below it the fit is doubtful. Larger: more fits are doubtful; at 0 none by this.
        pub contradiction: f64 = 1e-6,
        /// Largest bias, and largest difference of an initial state from the measured one, in
        /// ordinary biases of the instrument (`instruments: ordinary` of aircraft.yaml). Larger:
        /// fewer fits are doubtful.
        pub ordinary_biases: f64 = 5.0,
    }
}

settings! {
    /// Settings of joint estimation.
    pub struct JointSettings {
        /// Widest spread of the mean angles of attack of joined maneuvers, deg. The default is half
        /// the usual distance of test points. Larger: smaller bounds, and the change of derivatives
        /// over the spread becomes an error.
        pub alpha_bin_deg: f64 = 2.5,
        /// Angles of attack around which maneuvers are joined, each within half of `alpha_bin_deg`.
        /// Without any, maneuvers are parted at their widest gaps.
        pub centres_deg: Vec<f64> = Vec::new(),
    }
    elsewhere {
        /// Constants shared by joined maneuvers: `estimate: expert: share_constants`.
        pub share_constants: bool = false,
    }
}

settings! {
    /// Settings of prediction.
    pub struct PredictionSettings {
        /// Largest difference of mean angles of attack between a maneuver and those that predict it,
        /// deg. The default is half the usual distance of test points. Larger: more maneuvers are
        /// predicted, from derivatives further away.
        pub alpha_distance_deg: f64 = 2.5,
    }
    elsewhere {
        /// Constants taken from the predicting maneuvers: `estimate: expert: share_constants`.
        pub share_constants: bool = false,
    }
}
