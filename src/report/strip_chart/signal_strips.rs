//! Signals of a record as strips over one time axis.

use super::envelope::{Columns, SampledSignal, envelope, flagged_spans};
use crate::flight::{Mark, Record};
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::strip::{FlaggedSpans, Strip, StripLine};
use crate::report::figure::style::{INK, MEASURED_COLOUR};
use crate::report::notation::without_unit;
use crate::tables::{History, HistoryOutput};
use crate::units::Unit;

/// Least and largest number of columns of a chart: pixels of a screen, dots of a page.
pub const LEAST_COLUMNS: f64 = 760.0;
pub const MOST_COLUMNS: f64 = 1000.0;

/// Share of its range within the core by which a scale grows for values outside the core and for
/// the computed response. A recovery or a divergent response would otherwise flatten the maneuver.
const SCALE_MARGIN: f64 = 0.5;

/// Appearance of a signal.
#[derive(Clone, Copy, Debug)]
pub struct StripStyle {
    height: f64,
    /// Approximate number of steps of the scale.
    steps: f64,
    colour: &'static str,
    width: f64,
    is_flag: bool,
}

pub const FLIGHT_SIGNAL: StripStyle = StripStyle {
    height: 50.0,
    steps: 2.0,
    colour: INK,
    width: 0.9,
    is_flag: false,
};
pub const INPUT: StripStyle = StripStyle {
    width: 1.1,
    ..FLIGHT_SIGNAL
};
pub const FLAG: StripStyle = StripStyle {
    height: 20.0,
    is_flag: true,
    ..INPUT
};
const OUTPUT: StripStyle = StripStyle {
    height: 72.0,
    steps: 3.0,
    ..INPUT
};
/// Style of a measured signal: wide, so that it is seen behind the computed response.
const MEASURED: StripStyle = StripStyle {
    colour: MEASURED_COLOUR,
    width: 2.6,
    ..OUTPUT
};
const RESIDUAL: StripStyle = StripStyle {
    height: 40.0,
    steps: 1.6,
    width: 0.8,
    ..OUTPUT
};

/// Maker of strips from one record over one time axis.
pub struct SignalStrips<'a> {
    pub record: &'a Record,
    pub time: Scale,
    pub columns: Columns,
    /// Interval (s) that the scales must show completely.
    core: (f64, f64),
}

impl SignalStrips<'_> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between LEAST_COLUMNS and MOST_COLUMNS"
    )]
    pub fn new(
        record: &Record,
        (from_s, to_s): (f64, f64),
        core: (f64, f64),
        columns: f64,
    ) -> SignalStrips<'_> {
        let to_s = to_s.max(from_s + record.step_s);
        SignalStrips {
            record,
            time: Scale {
                min: from_s,
                max: to_s,
                ..Scale::in_steps(from_s, to_s, 10.0)
            },
            columns: Columns {
                from_s,
                to_s,
                count: columns as usize,
            },
            core,
        }
    }

    /// Values of a signal within the core.
    pub fn within_core(&self, name: &str) -> impl Iterator<Item = f64> {
        self.between(name, self.core)
    }

    /// Values of a signal within an interval, with half a sample of slack.
    fn between(&self, name: &str, (from_s, to_s): (f64, f64)) -> impl Iterator<Item = f64> {
        let slack = 0.5 * self.record.step_s;
        self.record
            .values(name)
            .unwrap_or_default()
            .iter()
            .enumerate()
            .filter(move |(k, _)| (from_s - slack..=to_s + slack).contains(&self.record.time_s(*k)))
            .map(|(_, v)| *v)
    }

    /// Limits of a signal's scale: all of the core, and other values that do not flatten it.
    fn limits(&self, name: &str, computed: &[f64]) -> (f64, f64) {
        let all = || {
            self.between(name, (self.columns.from_s, self.columns.to_s))
                .chain(computed.iter().copied())
        };
        let core = extent(self.within_core(name)).or_else(|| extent(all()));
        let Some((low, high)) = core else {
            return (0.0, 1.0);
        };
        let margin = SCALE_MARGIN * (high - low);
        let near = all().filter(|v| (low - margin..=high + margin).contains(v));
        extent(near.chain([low, high])).unwrap_or((low, high))
    }

    fn scale(&self, name: &str, style: StripStyle, computed: &[f64]) -> Scale {
        let (low, high) = self.limits(name, computed);
        if style.is_flag {
            Scale {
                min: -0.25,
                max: high.max(1.0) + 0.25,
                step: high.max(1.0),
            }
        } else {
            scale_with_two_ticks(low, high, style.steps)
        }
    }

    /// One signal with its flags; `None` if the record lacks it. The scale has room for `computed`.
    pub fn strip(&self, name: &str, style: StripStyle, computed: &[f64]) -> Option<Strip> {
        let record = self.record;
        let series = record.signals.get(name)?;
        let spans = |mark| flagged_spans(series, record.start_s, record.step_s, mark, self.columns);
        let scale = self.scale(name, style, computed);
        let unit = if style.is_flag {
            "0/1"
        } else {
            Unit::of_signal(name).name
        };
        let line = self.line(record.start_s, &series.values, scale, style);
        let title = without_unit(name);
        let mut strip = Strip::of_lines(title, unit, style.height, scale, vec![line]);
        strip.flagged = FlaggedSpans {
            bridged: spans(Mark::Bridged),
            despiked: spans(Mark::Despiked),
            missing: [spans(Mark::Missing), spans(Mark::Stuck)].concat(),
        };
        strip.attributes = group_attributes(title);
        Some(strip)
    }

    /// The line through values from a start on, cut where it leaves the scale.
    fn line(&self, start_s: f64, values: &[f64], scale: Scale, style: StripStyle) -> StripLine {
        let inside: Vec<f64> = values
            .iter()
            .map(|v| if scale.contains(*v) { *v } else { f64::NAN })
            .collect();
        let signal = SampledSignal {
            start_s,
            step_s: self.record.step_s,
            values: &inside,
        };
        StripLine {
            pieces: envelope(signal, self.columns),
            ..StripLine::solid(vec![], style.colour, style.width)
        }
    }

    /// An output as measured; with a response also computed, and the residual in a strip below.
    pub fn output(&self, name: &str, response: Option<(&History, &HistoryOutput)>) -> Vec<Strip> {
        let Some((history, output)) = response else {
            return self.strip(name, OUTPUT, &[]).into_iter().collect();
        };
        let Some(mut measured) = self.strip(name, MEASURED, &output.computed) else {
            return vec![];
        };
        let start_s = self.core.0 + history.time_s.first().copied().unwrap_or(0.0);
        let computed = self.line(start_s, &output.computed, measured.scale, INPUT);
        measured.lines.push(computed);
        vec![measured, self.residual(name, start_s, output)]
    }

    /// Residual of an output. An excluded sample has no residual: it is a dot on the zero line.
    fn residual(&self, name: &str, start_s: f64, output: &HistoryOutput) -> Strip {
        let samples = output
            .measured
            .iter()
            .zip(&output.computed)
            .zip(&output.marked);
        let residuals: Vec<f64> = samples
            .map(|((z, y), marked)| if *marked { f64::NAN } else { z - y })
            .collect();
        let (low, high) = extent(residuals.iter().copied()).unwrap_or((-1.0, 1.0));
        let scale = scale_with_two_ticks(low.min(0.0), high.max(0.0), RESIDUAL.steps);
        let line = self.line(start_s, &residuals, scale, RESIDUAL);
        let unit = Unit::of_signal(name).name;
        let mut strip = Strip::of_lines("residual", unit, RESIDUAL.height, scale, vec![line]);
        strip.dots = output
            .marked
            .iter()
            .enumerate()
            .filter(|(_, marked)| **marked)
            .map(|(k, _)| (start_s + k as f64 * self.record.step_s, 0.0))
            .collect();
        strip.attributes = group_attributes("residual");
        strip
    }
}

fn group_attributes(signal: &str) -> Vec<(&'static str, String)> {
    vec![
        ("class", "strip".to_owned()),
        ("data-signal", signal.to_owned()),
    ]
}

/// Round scale with about `steps` steps and at least two tick labels: one alone gives no scale.
pub(super) fn scale_with_two_ticks(low: f64, high: f64, steps: f64) -> Scale {
    let scale = Scale::in_steps(low, high, steps);
    let ticks = (scale.max / scale.step).floor() - (scale.min / scale.step).ceil() + 1.0;
    if ticks < 2.0 {
        Scale::with_step(low, high, scale.step, scale.step)
    } else {
        scale
    }
}
