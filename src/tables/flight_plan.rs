//! Tables of the next flight: the cards with their information, and the goals before and after.

use crate::schema::{table, words};

words! {
    /// Kind of a goal.
    pub enum GoalKind {
        /// A derivative's standard deviation is to fall.
        Derivative = "derivative",
        /// The level of a mode's quantity is to be decided.
        Level = "level",
        /// The proof of match of a flown maneuver is to be decided.
        Match = "match",
    }
}

table! {
    /// Cards that the next flight may fly, with their information and their minutes.
    ///
    /// `harvest next` writes it into `next/` of the reports. The cards of the flight come first, in the
    /// order of flying; the others follow by information per minute, refused cards last.
    /// Information is in nats: each nat divides the standard deviations of the goals by e, in their
    /// weighted mean.
    pub struct NextCardRow in "next_cards" per "candidate card" {
        /// Place in the order of flying; empty for a card that is not flown.
        pub place: Option<usize> ["1"],
        /// Number of times that it is flown.
        pub times: usize ["1"],
        /// Class of the maneuver.
        pub class: String,
        /// Angle of attack of the card.
        pub alpha_deg: f64 ["deg"],
        /// Scale of the inputs of the class's program.
        pub scale: f64 ["1"],
        /// Altitude of the card.
        pub altitude_ft: f64 ["ft"],
        /// Time of the card once, with its trim and recovery.
        pub minutes: f64 ["min"],
        /// Share of the class's maneuvers that are usable.
        pub usable_pct: f64 ["%"],
        /// Information of the card flown once and alone; empty for a card that is refused, as in the
        /// columns that follow.
        pub information: Option<f64> ["nat"],
        /// Information per minute.
        pub information_per_minute: Option<f64> ["nat/min"],
        /// Information that the flight loses without the card; empty for a card that is not flown.
        pub loss_without: Option<f64> ["nat"],
        /// Lowest angle of attack over the card, as the vane reads it.
        pub lowest_alpha_deg: Option<f64> ["deg"],
        /// Highest angle of attack over the card.
        pub highest_alpha_deg: Option<f64> ["deg"],
        /// Lowest normal acceleration over the card.
        pub lowest_an_g: Option<f64> ["g"],
        /// Highest normal acceleration over the card.
        pub highest_an_g: Option<f64> ["g"],
        /// Highest dynamic pressure over the card.
        pub highest_qbar_psf: Option<f64> ["lbf/ft²"],
        /// Mach number of the card in trim.
        pub mach: Option<f64> ["1"],
        /// Calibrated airspeed of the card in trim.
        pub calibrated_airspeed_kt: Option<f64> ["kt"],
        /// Goals to which the card alone adds most, with the change of their standard deviations.
        pub informs: String,
        /// Reason why the card is refused; empty for one that may be flown.
        pub refused: String,
    }
}

table! {
    /// Goals of the next flight, with their standard deviations before and after it.
    ///
    /// Without a file of goals all derivatives of the posterior are goals. The columns from `value` are of
    /// goals that are to be decided: a flight moves the mean by chance, so it decides with a probability.
    pub struct NextGoalRow in "next_goals" per "goal and angle of attack" {
        /// Kind of the goal.
        pub kind: GoalKind,
        /// Derivative or sum; quantity of the mode; class of the maneuver.
        pub goal: String,
        /// Airframe of a level; simulator of a match; empty for a derivative.
        pub of: String,
        /// Maneuver and quantity that decide a match; empty for other goals.
        pub decided_by: String,
        /// Unit of the goal; a match is in tolerances.
        pub unit: String,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Standard deviation by the posterior of tonight, in the column `unit`.
        pub before: f64,
        /// Expected standard deviation after the flight, in the column `unit`.
        pub after: f64,
        /// Wanted standard deviation, in the column `unit`. Empty where each reduction counts. Also
        /// empty where none counts: the goal is decided already, or no flight can decide it.
        pub wanted: Option<f64>,
        /// Mean by the posterior of tonight, in the column `unit`.
        pub value: Option<f64>,
        /// Lower limit of the most probable interval, in the column `unit`; empty without one.
        pub lower_limit: Option<f64>,
        /// Upper limit of the most probable interval, in the column `unit`; empty without one.
        pub upper_limit: Option<f64>,
        /// Probability of that interval by the posterior of tonight.
        pub probability_pct: Option<f64> ["%"],
        /// Probability that the goal is decided after the flight.
        pub decided_pct: Option<f64> ["%"],
    }
}
