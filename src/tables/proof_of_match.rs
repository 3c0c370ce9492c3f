//! Tables of the proof of match: each maneuver flown again by a simulator.

use crate::aero::Axis;
use crate::schema::{table, words};

words! {
    /// Source of the derivatives that fly a maneuver again.
    pub enum ModelSource {
        /// The campaign's posterior.
        Posterior = "posterior",
        /// The trends across angle of attack; the tunnel for derivatives without a trend.
        Trend = "trend",
        /// The wind-tunnel database.
        Tunnel = "tunnel",
        /// The database of the key `database`; the tunnel where it has no table.
        Database = "database",
    }
}

words! {
    /// Quantity that a tolerance is about.
    pub enum MatchedQuantity {
        /// Reading of the α vane.
        AlphaVane = "alpha_vane_deg",
        /// Reading of the β vane.
        BetaVane = "beta_vane_deg",
        /// True airspeed.
        Velocity = "velocity_ft_s",
        /// Roll rate.
        RollRate = "p_deg_s",
        /// Pitch rate.
        PitchRate = "q_deg_s",
        /// Yaw rate.
        YawRate = "r_deg_s",
        /// Pitch attitude.
        PitchAttitude = "theta_deg",
        /// Bank angle.
        Bank = "phi_deg",
        /// Normal acceleration at its sensor.
        NormalAcceleration = "an_g",
        /// Axial acceleration at its sensor.
        AxialAcceleration = "ax_g",
        /// Lateral acceleration at its sensor.
        LateralAcceleration = "ay_g",
        /// Period of the Dutch roll.
        DutchRollPeriod = "dutch_roll_period",
        /// Time in which the Dutch roll falls to half its amplitude, or doubles it.
        DutchRollHalving = "dutch_roll_half_time",
        /// Damping ratio of the Dutch roll.
        DutchRollDamping = "dutch_roll_damping",
    }
}

impl MatchedQuantity {
    /// `true` for a quantity of the Dutch roll, which is one number per maneuver.
    #[must_use]
    pub fn is_of_dutch_roll(self) -> bool {
        matches!(
            self,
            MatchedQuantity::DutchRollPeriod
                | MatchedQuantity::DutchRollHalving
                | MatchedQuantity::DutchRollDamping
        )
    }

    /// Axis whose equations it belongs to.
    #[must_use]
    pub fn axis(self) -> Axis {
        match self {
            MatchedQuantity::AlphaVane
            | MatchedQuantity::Velocity
            | MatchedQuantity::PitchRate
            | MatchedQuantity::PitchAttitude
            | MatchedQuantity::NormalAcceleration
            | MatchedQuantity::AxialAcceleration => Axis::Longitudinal,
            MatchedQuantity::BetaVane
            | MatchedQuantity::RollRate
            | MatchedQuantity::YawRate
            | MatchedQuantity::Bank
            | MatchedQuantity::LateralAcceleration
            | MatchedQuantity::DutchRollPeriod
            | MatchedQuantity::DutchRollHalving
            | MatchedQuantity::DutchRollDamping => Axis::Lateral,
        }
    }

    /// Unit of its values.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            MatchedQuantity::AlphaVane
            | MatchedQuantity::BetaVane
            | MatchedQuantity::PitchAttitude
            | MatchedQuantity::Bank => "deg",
            MatchedQuantity::Velocity => "ft/s",
            MatchedQuantity::RollRate | MatchedQuantity::PitchRate | MatchedQuantity::YawRate => {
                "deg/s"
            }
            MatchedQuantity::NormalAcceleration
            | MatchedQuantity::AxialAcceleration
            | MatchedQuantity::LateralAcceleration => "g",
            MatchedQuantity::DutchRollPeriod | MatchedQuantity::DutchRollHalving => "s",
            MatchedQuantity::DutchRollDamping => "-",
        }
    }
}

words! {
    /// Verdict of a tolerance.
    pub enum MatchVerdict {
        /// The simulator matches the aircraft.
        Inside = "inside",
        /// It does not.
        Outside = "outside",
        /// The maneuver was not flown again; the reason names why.
        NotFlown = "not flown",
    }
}

table! {
    /// Proof of match: each maneuver flown again by a six-degree-of-freedom simulator with the
    /// recorded surfaces and thrust, with its margins to the tolerances of `match.yaml`.
    pub struct MatchRow in "match" per "maneuver, model and tolerance" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Id of the flight; a later stretch of a flight has a number, `flight_001.2`.
        pub flight_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Source of the derivatives.
        pub model: ModelSource,
        /// Number of the test in the standard.
        pub test: String,
        /// Subject of the test.
        pub subject: String,
        /// Number of the requirement within its test: rows with the same number are alternatives, of
        /// which one has to be met.
        pub requirement: usize ["1"],
        /// Quantity.
        pub quantity: MatchedQuantity,
        /// Unit of the quantity.
        pub unit: String,
        /// Tolerance either way, in the column `unit`. With a percentage the larger of the two holds
        /// at each sample.
        pub tolerance: Option<f64>,
        /// Tolerance in per cent of the measured value.
        pub tolerance_pct: Option<f64> ["%"],
        /// Value of the flight by the maneuver's own estimates; empty for a time history.
        pub flight_value: Option<f64>,
        /// Value of the model; empty for a time history, and where it does not oscillate.
        pub model_value: Option<f64>,
        /// Number of samples that count: those that ingest repaired do not.
        pub samples: usize ["samples"],
        /// Share of the samples inside the tolerance.
        pub inside_pct: f64 ["%"],
        /// Largest distance of the difference beyond the tolerance, in the column `unit`; negative where
        /// all is inside. Empty where the simulated aircraft departs.
        pub largest_excess: Option<f64>,
        /// Time of the largest excess on the record's clock.
        pub largest_excess_s: Option<f64> ["s"],
        /// One less a ratio: the difference over the tolerance that the required share of samples
        /// does not exceed. 1 for a perfect match, 0 on the limit, negative beyond. Empty where the
        /// simulated aircraft departs.
        pub margin: Option<f64> ["1"],
        /// Verdict.
        pub verdict: MatchVerdict,
        /// Probability that a repeat flight is inside: over the posterior's derivatives, the matched start
        /// and the sensors' noise, in still air. Empty without a posterior of the axis.
        pub repeat_pct: Option<f64> ["%"],
    }
}

table! {
    /// Verdicts of the proof of match: a maneuver passes where every requirement of its tests is met.
    pub struct MatchVerdictRow in "match_verdicts" per "maneuver and model" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Source of the derivatives.
        pub model: ModelSource,
        /// Verdict.
        pub verdict: MatchVerdict,
        /// Smallest margin over the requirements, of each the best alternative; empty where the
        /// simulated aircraft departs or the maneuver was not flown again.
        pub margin: Option<f64> ["1"],
        /// Test and quantity with the smallest margin.
        pub decided_by: String,
        /// Probability that a repeat flight meets every requirement.
        pub repeat_pct: Option<f64> ["%"],
        /// 1 where a surface of the model moves after the last input, as feedback moves it. The
        /// maneuver is judged with the recorded surfaces, so the feedback is not simulated. Empty where
        /// the inputs are not known.
        pub closed_loop: Option<usize> ["1"],
        /// Reason why the maneuver was not flown again.
        pub reason: String,
    }
}
