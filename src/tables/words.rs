//! Words of the published tables: outcomes, verdicts and kinds, each with its meaning.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::schema::{Entry, Words, words};

words! {
    /// Outcome of an estimation.
    pub enum Outcome {
        /// The iteration reached the minimum.
        Converged = "converged",
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
        /// The derivatives that the measured accelerations imply.
        EquationError = "equation error",
        /// The wind tunnel's derivatives.
        WindTunnel = "wind tunnel",
        /// The weighted mean of the maneuvers' own estimates, for a joint estimation.
        SingleEstimates = "single estimates",
    }
}

words! {
    /// Whether a maneuver was predicted with the derivatives of others.
    pub enum PredictionStatus {
        /// The maneuver was predicted.
        Predicted = "predicted",
    }
    or text {
        /// The reason why it was not.
        NotPredicted
    }
}

words! {
    /// Whether a maneuver takes part in a joint estimation.
    pub enum Participation {
        /// The maneuver takes part.
        Joined = "joined",
    }
    or text {
        /// The reason why it was left out.
        LeftOut
    }
}

words! {
    /// Quantities between which a correlation is computed.
    pub enum CorrelationKind {
        /// Two regressors, by their histories over the maneuver.
        Regressors = "regressors",
        /// Two estimates, by the inverse of the information matrix.
        Estimates = "estimates",
    }
}

words! {
    /// Verdict on a channel.
    pub enum ChannelVerdict {
        /// A relation between channels confirms it.
        Ok = "ok",
        /// No relation can confirm it.
        NotChecked = "not checked",
    }
    or text {
        /// The fault; after `suspect:` where another channel may be the faulty one.
        Fault
    }
}

impl ChannelVerdict {
    /// True unless the channel has a fault.
    #[must_use]
    pub fn passed(&self) -> bool {
        !matches!(self, ChannelVerdict::Fault(_))
    }
}

words! {
    /// Verdict on a kinematic relation between channels.
    pub enum CheckVerdict {
        /// The relation holds.
        Ok = "ok",
        /// The flight moves too little for a verdict.
        NotExcited = "not excited",
        /// The slope is negative.
        WrongSign = "wrong sign",
        /// The slope is positive and far from one.
        WrongScale = "wrong scale",
        /// The two sides hardly correlate.
        DoesNotAgree = "does not agree",
    }
}

impl CheckVerdict {
    /// True unless the relation is violated.
    #[must_use]
    pub fn passed(self) -> bool {
        matches!(self, CheckVerdict::Ok | CheckVerdict::NotExcited)
    }
}

words! {
    /// Verdict on an instrument.
    pub enum InstrumentVerdict {
        /// No error beyond its limit.
        Ok = "ok",
        /// No error beyond its limit; the flight moves it too little to estimate its delay.
        NoDelay = "ok; its delay is not told",
        /// The flight moves it too little to estimate any error.
        NotExcited = "not excited",
    }
    or text {
        /// The fault; also a row of `problems`.
        Fault
    }
}

impl InstrumentVerdict {
    /// True unless the instrument has a fault.
    #[must_use]
    pub fn passed(&self) -> bool {
        !matches!(self, InstrumentVerdict::Fault(_))
    }
}

words! {
    /// Verdict on an event of the analyst's list, or on a maneuver that the list lacks.
    pub enum EventVerdict {
        /// The class agrees, and both times within 1 s.
        Agrees = "agrees",
        /// The maneuver was found as another class.
        OtherClass = "other class",
        /// The class agrees; start or end differs by more than 1 s.
        OtherTimes = "other times",
        /// No maneuver was found there.
        NotFound = "not found",
        /// The list does not have the maneuver.
        NotGiven = "not given",
    }
}

words! {
    /// Verdict on flight against the wind tunnel.
    pub enum TunnelVerdict {
        /// The difference is within `agreement_z` in z or within `agreement_pct`.
        Agrees = "agrees",
        /// Flight is higher, in the algebraic sense.
        FlightHigher = "flight higher",
        /// Flight is lower, in the algebraic sense: −0.3 is lower than −0.2.
        FlightLower = "flight lower",
        /// The values are on different sides of zero, each by more than its uncertainty.
        SignDiffers = "sign differs",
        /// The table has no value, or `not_comparable` names the derivative.
        NoTunnelValue = "no tunnel value",
    }
}

words! {
    /// Verdict on flight against an earlier campaign.
    pub enum ChangeVerdict {
        /// The difference is within `agreement_z` in z or within `agreement_pct`.
        Agrees = "agrees",
        /// The value is higher now, in the algebraic sense.
        Higher = "higher than before",
        /// The value is lower now, in the algebraic sense.
        Lower = "lower than before",
        /// The values are on different sides of zero, each by more than its uncertainty.
        SignDiffers = "sign differs",
        /// The earlier campaign has no trend at this angle of attack.
        NotThereBefore = "not there before",
    }
}

/// Verdict of `comparison` or of `changes`, for the tables that hold both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Tunnel(TunnelVerdict),
    Change(ChangeVerdict),
}

impl Words for Verdict {
    const ENTRIES: &'static [Entry] = &[];

    fn word(&self) -> &str {
        match self {
            Verdict::Tunnel(verdict) => verdict.name(),
            Verdict::Change(verdict) => verdict.name(),
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

impl Serialize for Verdict {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.word())
    }
}

words! {
    /// What the tunnel's tables return beyond their ends.
    pub enum Treatment {
        /// The value at the end of the table.
        Clamped = "clamped",
        /// No value.
        Refused = "refused",
    }
}
