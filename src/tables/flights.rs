//! Tables of flights: times and gusts, channels, relations between channels, instruments, events.

use crate::schema::{table, words};

table! {
    /// Flights that ingest accepted, with the gusts of each.
    ///
    /// The gusts are the difference between the motion through the air and the inertial motion,
    /// without what changes more slowly than in some eight seconds. In still air, imperfections of
    /// the instruments appear as gusts of up to half a foot per second.
    pub struct FlightRow in "flights" per "flight" {
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// First sample.
        pub start_s: f64 ["s"],
        /// Time from the first sample to the last.
        pub duration_s: f64 ["s"],
        /// Gusts along the body's forward axis, root mean square. This and the next two columns are
        /// empty for a short flight.
        pub gust_u_ft_s: Option<f64> ["ft/s"],
        /// Gusts to the side, root mean square.
        pub gust_v_ft_s: Option<f64> ["ft/s"],
        /// Gusts along the body's downward axis, root mean square.
        pub gust_w_ft_s: Option<f64> ["ft/s"],
    }
}

table! {
    /// Repairs of the channels, and their verdicts.
    ///
    /// A flight whose clock restarts or has a long gap is several stretches. Each stretch is a
    /// flight of its own in all tables: `007`, then `007.2`, `007.3`. The table `problems` has
    /// their starts and reasons.
    pub struct ChannelRow in "channels" per "flight and mapped channel" {
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// Column of the archive's file.
        pub channel: String,
        /// Signal that the channel is mapped to.
        pub signal: String,
        /// Number of samples on the record's clock.
        pub samples: usize ["samples"],
        /// Rate at which the channel is recorded; the record's own rate or a slower one.
        pub rate_hz: Option<f64> ["Hz"],
        /// Samples interpolated between two samples of a slower channel; no cost counts them.
        pub between: usize ["samples"],
        /// Samples bridged by a straight line over short dropouts; of the clock: lost frames.
        pub bridged: usize ["samples"],
        /// Single-sample spikes replaced.
        pub despiked: usize ["samples"],
        /// Samples of longer gaps, left missing.
        pub missing: usize ["samples"],
        /// Samples excluded because the value stood still for longer than its noise allows.
        pub stuck: usize ["samples"],
        /// Number of times the value wrapped around; the record has it continuous.
        pub wraps: usize ["1"],
        /// Step of the recorder's numbers; empty where they have none.
        pub quantisation: Option<f64> ["the signal's unit"],
        /// Standard deviation of the noise from sample to sample, without that of the rounding to
        /// `quantisation`: 0 where the step is coarser than the noise. Of the clock: jitter of the
        /// time stamps in s.
        pub noise: Option<f64> ["the signal's unit"],
        /// Worst verdict of the relations and instrument checks that name this channel.
        pub verdict: ChannelVerdict,
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
    /// `true` unless the channel has a fault.
    #[must_use]
    pub fn passed(&self) -> bool {
        !matches!(self, ChannelVerdict::Fault(_))
    }
}

table! {
    /// Kinematic relations between channels.
    pub struct CheckRow in "checks" per "flight and relation between channels" {
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// Relation in words: `theta rate against q and r`.
        pub relation: String,
        /// Signals of the relation, separated by spaces.
        pub signals: String,
        /// Least-squares slope of the measured side on the side predicted from the other signals:
        /// 1 where units and signs are right. Of the side force against side gusts, the aircraft's side
        /// force by sideslip over −0.6 per rad.
        pub slope: Option<f64> ["1"],
        /// Correlation of the two sides.
        pub correlation: Option<f64> ["1"],
        /// Verdict on the relation.
        pub verdict: CheckVerdict,
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
    /// `true` unless the relation is violated.
    #[must_use]
    pub fn passed(self) -> bool {
        matches!(self, CheckVerdict::Ok | CheckVerdict::NotExcited)
    }
}

table! {
    /// Errors of the instruments: reading = `scale` × truth(t − `delay_s`) + `bias`.
    ///
    /// Errors of rates, accelerations, attitudes and air data come from the kinematic equations
    /// alone, delays and signs of the surfaces from the equations of motion. An error that the
    /// flight does not determine is empty.
    pub struct InstrumentRow in "instruments" per "flight and instrument, and surface of all flights" {
        /// Flight, or stretch of a flight; `all` for a surface's delay from all flights together, by
        /// which the surface is corrected.
        pub flight_id: String,
        /// Column of the archive's file.
        pub channel: String,
        /// Signal that the channel is mapped to.
        pub signal: String,
        /// Unit of the bias and its bound.
        pub unit: String,
        /// Constant error of the reading, in the column `unit`.
        pub bias: Option<f64>,
        /// Standard deviation of the bias, in the column `unit`.
        pub bias_bound: Option<f64>,
        /// Scatter of the bias within the flight beyond the noise, such as a drift, in the column `unit`.
        pub bias_scatter: Option<f64>,
        /// Scale factor of the reading: 1 where right.
        pub scale: Option<f64> ["1"],
        /// Standard deviation of the scale factor.
        pub scale_bound: Option<f64> ["1"],
        /// Scatter of the scale factor within the flight beyond the noise.
        pub scale_scatter: Option<f64> ["1"],
        /// Delay against the other channels; negative: ahead of them.
        pub delay_s: Option<f64> ["s"],
        /// Standard deviation of the delay.
        pub delay_bound_s: Option<f64> ["s"],
        /// Errors by which the record is corrected, separated by spaces: `bias`, `scale`, `delay`.
        /// The settings are `ingest: compatibility:`, of surfaces `estimate: surfaces:`.
        pub applied: String,
        /// Verdict on the instrument.
        pub verdict: InstrumentVerdict,
    }
}

words! {
    /// Kind of an instrument's error.
    pub enum InstrumentError {
        /// Constant error of the reading.
        Bias = "bias",
        /// Error of the scale factor.
        Scale = "scale",
        /// Delay against the other channels.
        Delay = "delay",
    }
}

impl InstrumentRow {
    /// Row of an instrument whose flight determines none of its errors.
    #[must_use]
    pub fn undetermined(
        flight_id: &str,
        channel: &str,
        signal: &str,
        unit: &str,
        verdict: InstrumentVerdict,
    ) -> InstrumentRow {
        InstrumentRow {
            flight_id: flight_id.to_owned(),
            channel: channel.to_owned(),
            signal: signal.to_owned(),
            unit: unit.to_owned(),
            bias: None,
            bias_bound: None,
            bias_scatter: None,
            scale: None,
            scale_bound: None,
            scale_scatter: None,
            delay_s: None,
            delay_bound_s: None,
            applied: String::new(),
            verdict,
        }
    }

    /// An error with its bound, the scale as a difference from one; `None` where it is not determined.
    #[must_use]
    pub fn error(&self, error: InstrumentError) -> Option<(f64, f64)> {
        match error {
            InstrumentError::Bias => self.bias.zip(self.bias_bound),
            InstrumentError::Scale => self.scale.map(|scale| scale - 1.0).zip(self.scale_bound),
            InstrumentError::Delay => self.delay_s.zip(self.delay_bound_s),
        }
    }

    /// Scatter of an error within the flight; zero where it is not determined.
    #[must_use]
    pub fn scatter(&self, error: InstrumentError) -> f64 {
        let scatter = match error {
            InstrumentError::Bias => self.bias_scatter,
            InstrumentError::Scale => self.scale_scatter,
            InstrumentError::Delay => None,
        };
        scatter.unwrap_or(0.0)
    }

    /// Sets an error with its bound, the scale as a difference from one.
    pub fn set_error(&mut self, error: InstrumentError, value: f64, bound: f64) {
        let (own, own_bound, value) = match error {
            InstrumentError::Bias => (&mut self.bias, &mut self.bias_bound, value),
            InstrumentError::Scale => (&mut self.scale, &mut self.scale_bound, 1.0 + value),
            InstrumentError::Delay => (&mut self.delay_s, &mut self.delay_bound_s, value),
        };
        (*own, *own_bound) = (Some(value), Some(bound));
    }

    /// `true` where the record is corrected by an error.
    #[must_use]
    pub fn is_applied(&self, error: InstrumentError) -> bool {
        self.applied.split(' ').any(|word| word == error.name())
    }

    /// Sets whether the record is corrected by an error.
    pub fn set_applied(&mut self, error: InstrumentError, is_applied: bool) {
        let applied = InstrumentError::ALL.into_iter().filter(|other| {
            if *other == error {
                is_applied
            } else {
                self.is_applied(*other)
            }
        });
        let names: Vec<&str> = applied.map(InstrumentError::name).collect();
        self.applied = names.join(" ");
    }
}

table! {
    /// Each error of each instrument over the flights, in the order of the flights' ids.
    ///
    /// The flights draw an error from one distribution: a mean that belongs to the recorder, and a scatter
    /// between flights. The unit of an error and of its bounds is in the column `unit`.
    pub struct InstrumentTrendRow in "instrument_trends" per "channel and kind of error" {
        /// Column of the archive's file.
        pub channel: String,
        /// Signal that the channel is mapped to.
        pub signal: String,
        /// Kind of the error.
        pub error: InstrumentError,
        /// Unit of the error.
        pub unit: String,
        /// Number of flights with evidence on the error.
        pub flights: usize ["flights"],
        /// Mean over the flights, without those in `far_flights`; of a scale the factor, 1 where right.
        pub mean: Option<f64>,
        /// Standard deviation of the mean.
        pub mean_bound: Option<f64>,
        /// Standard deviation of the error between flights, beside the bounds of the flights.
        pub scatter: Option<f64>,
        /// Verdict on the mean. A wrong one has a row in `problems`.
        pub common: CommonErrorVerdict,
        /// Flights whose error is far from the others', separated by spaces. No record is corrected by it.
        pub far_flights: String,
        /// Number of flights that do not determine the error by themselves and take it from the others.
        pub completed_flights: usize ["flights"],
        /// Verdict on the order of the flights.
        pub verdict: InstrumentTrend,
        /// First flight of a step or drift, also of a possible one.
        pub since: Option<String>,
        /// Largest step, or drift from the first flight to the last: the less probable of the two.
        pub change: Option<f64>,
        /// Standard deviation of the change.
        pub change_bound: Option<f64>,
        /// Probability of so large a change by chance.
        pub probability: Option<f64> ["1"],
    }
}

words! {
    /// Verdict on the error that all flights have in common.
    pub enum CommonErrorVerdict {
        /// An ordinary error.
        Ordinary = "ordinary",
        /// Surely larger than ordinary errors are.
        Wrong = "wrong in every flight",
        /// Fewer than four flights.
        TooFewFlights = "too few flights",
    }
}

words! {
    /// Verdict on an error in the order of the flights.
    pub enum InstrumentTrend {
        /// Chance explains the differences between flights.
        Steady = "steady",
        /// The error is another since a flight.
        Step = "step",
        /// The error changes from flight to flight.
        Drift = "drift",
        /// The error may be another since a flight: too small a step to be sure. One campaign in four has
        /// a possible step or drift by chance.
        PossibleStep = "possible step",
        /// The error may change from flight to flight.
        PossibleDrift = "possible drift",
        /// Fewer than six flights.
        TooFewFlights = "too few flights",
    }
}

/// `flight_id` of what all flights give together.
pub const ALL_FLIGHTS: &str = "all";

words! {
    /// Verdict on an instrument.
    pub enum InstrumentVerdict {
        /// No error beyond its limit.
        Ok = "ok",
        /// No error beyond its limit; the flight moves it too little to determine its delay.
        NoDelay = "ok; delay not excited",
        /// The flight moves it too little; its errors are those of the other flights.
        FromOthers = "ok; taken from the other flights",
        /// No error beyond its limit in this flight. An error common to all flights is certainly
        /// larger than ordinary, and has a row in `problems`.
        WrongInEveryFlight = "wrong in every flight",
        /// The flight moves it too little to determine any error.
        NotExcited = "not excited",
        /// No part of the flight is long enough for a reconstruction.
        NotExamined = "not examined",
    }
    or text {
        /// The fault, which has a row in `problems` too.
        Fault
    }
}

impl InstrumentVerdict {
    /// `true` unless the instrument has a fault, in this flight or in every flight.
    #[must_use]
    pub fn passed(&self) -> bool {
        use InstrumentVerdict::{Fault, WrongInEveryFlight};
        !matches!(self, Fault(_) | WrongInEveryFlight)
    }

    /// `true` if the flight determines no error of the instrument.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        matches!(
            self,
            InstrumentVerdict::NotExcited | InstrumentVerdict::NotExamined
        )
    }
}

table! {
    /// The analyst's events against the maneuvers found in the record; without a list of events
    /// the table has no rows.
    pub struct EventRow in "events" per "event of the analyst's list, and maneuver that it lacks" {
        /// Flight, or stretch of a flight.
        pub flight_id: String,
        /// Class in the list.
        pub given_class: Option<String>,
        /// Start in the list.
        pub given_start_s: Option<f64> ["s"],
        /// End in the list.
        pub given_end_s: Option<f64> ["s"],
        /// Class found in the record.
        pub found_class: Option<String>,
        /// Start found in the record.
        pub found_start_s: Option<f64> ["s"],
        /// End found in the record.
        pub found_end_s: Option<f64> ["s"],
        /// Verdict on the event.
        pub verdict: EventVerdict,
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
