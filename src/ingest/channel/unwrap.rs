//! Angles that wrap around made continuous.

use crate::flight::Channel;
use crate::ingest::settings::Settings;
use crate::numerics::series::sample_count::whole_steps;
use crate::units::{Quantity, Unit};

/// Smallest jump that counts as a wrap if the channel map states the period, as a fraction of the
/// period. No angle changes by half a circle in one sample.
const HALF_TURN: f64 = 0.5;

/// Smallest jump that counts as a wrap if the channel map states no period, as a fraction of the
/// circle. Only a jump of nearly a whole circle cannot be a fault.
const WHOLE_TURN: f64 = 0.9;

/// Unwrapping state of one channel, in the recorder's unit.
#[derive(Clone, Debug)]
pub struct Unwrapper {
    period: f64,
    /// Least jump that is a wrap, as a share of the period.
    wrap_share: f64,
    /// `true` for an attitude or a flow angle, which begins within half a turn of zero; `false` for
    /// a heading.
    is_about_zero: bool,
    /// Longest gap in samples across which turns are counted. After a longer one the angle begins
    /// anew.
    longest_gap: usize,
    missing: usize,
    turns: f64,
    /// The last unwrapped value.
    last: f64,
    wraps: usize,
}

impl Unwrapper {
    /// Unwrapper of a channel that is an angle or states a period. Turns are counted across gaps of
    /// at least `least_gap` samples.
    pub fn of(
        channel: &Channel,
        step_s: f64,
        least_gap: usize,
        settings: &Settings,
    ) -> Option<Unwrapper> {
        let stated = channel.wraps_at.map(|period| (period, HALF_TURN));
        let circle = || Some((full_circle(&channel.unit)?, WHOLE_TURN));
        let (period, wrap_share) = stated.or_else(circle)?;
        Some(Unwrapper {
            period,
            wrap_share,
            is_about_zero: channel.wraps_at.is_none(),
            longest_gap: whole_steps(settings.longest_bridge_s, step_s).max(least_gap),
            missing: 0,
            turns: 0.0,
            last: f64::NAN,
            wraps: 0,
        })
    }

    /// Number of wraps so far.
    pub fn wraps(&self) -> usize {
        self.wraps
    }

    /// `true` if the turns of the next value do not follow from the values before it.
    fn begins_anew(&self) -> bool {
        self.is_about_zero && (self.last.is_nan() || self.missing > self.longest_gap)
    }

    fn is_wrap(&self, jump: f64) -> bool {
        jump.abs() > self.wrap_share * self.period
    }

    /// Unwraps the next value.
    pub fn unwrap_value(&mut self, value: f64) -> f64 {
        if !value.is_finite() {
            self.missing += 1;
            return value;
        }
        if self.begins_anew() {
            self.begin(value);
        }
        self.missing = 0;
        let jump = value + self.turns * self.period - self.last;
        if self.is_wrap(jump) {
            self.turns -= (jump / self.period).round();
            self.wraps += 1;
        }
        self.last = value + self.turns * self.period;
        self.last
    }

    /// Begins with a value within half a turn of zero. A value beyond a whole turn belongs to no
    /// wrapped angle and stays as it is.
    fn begin(&mut self, value: f64) {
        self.turns = if value.abs() <= self.period {
            0.0 - (value / self.period).round()
        } else {
            0.0
        };
        self.last = value + self.turns * self.period;
        self.wraps += usize::from(self.turns != 0.0);
    }

    /// Offset that unwraps all values, if there is no gap and no wrap among them, as nearly always.
    /// Otherwise `None`, and nothing is changed.
    pub fn common_offset(&mut self, values: &[f64]) -> Option<f64> {
        if self.begins_anew() {
            return None;
        }
        let offset = self.turns * self.period;
        let (first, last) = (values.first()?, values.last()?);
        // Folds without an early exit compile to vector instructions.
        let are_finite = values.iter().fold(true, |all, v| all & v.is_finite());
        let are_continuous = values
            .windows(2)
            .fold(true, |all, pair| all & !self.is_wrap(pair[1] - pair[0]));
        if !are_finite || !are_continuous || self.is_wrap(first - (self.last - offset)) {
            return None;
        }
        self.last = last + offset;
        self.missing = 0;
        Some(offset)
    }
}

/// 360° in a unit; `None` if the unit is not of an angle.
fn full_circle(unit: &str) -> Option<f64> {
    let unit = Unit::parse(unit).ok()?;
    if unit.quantity != Quantity::Angle {
        return None;
    }
    Some(360.0 * Unit::of_signal("_deg").factor_to(unit)?)
}
