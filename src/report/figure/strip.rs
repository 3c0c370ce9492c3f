//! Strips: signals over time with their tolerances and flags, and the sizes of their drawing.

use super::scale::Scale;
use super::style::INK;

/// One signal over time.
#[derive(Clone, Debug)]
pub struct Strip {
    pub name: String,
    pub unit: String,
    pub height: f64,
    pub scale: Scale,
    pub lines: Vec<StripLine>,
    /// Tolerance drawn as an area behind the lines: time, lower and upper limit.
    pub tube: Vec<(f64, f64, f64)>,
    pub outside: OutsideSpans,
    /// Samples drawn as dots: those excluded from the cost.
    pub dots: Vec<(f64, f64)>,
    pub flagged: FlaggedSpans,
    /// Attributes of the group around lines, dots and flags; no group without any.
    pub attributes: Vec<(&'static str, String)>,
}

/// Intervals (s) outside the tolerance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutsideSpans {
    pub spans: Vec<(f64, f64)>,
    /// `true` where another quantity meets the requirement instead.
    pub is_excused: bool,
}

/// One line of a strip.
#[derive(Clone, Debug)]
pub struct StripLine {
    /// Parts of the line, between which samples are missing.
    pub pieces: Vec<Vec<(f64, f64)>>,
    pub colour: &'static str,
    pub width: f64,
    /// SVG dash array; empty for a solid line.
    pub dash: &'static str,
}

/// Intervals (s) of samples that ingest changed or flagged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlaggedSpans {
    pub bridged: Vec<(f64, f64)>,
    pub despiked: Vec<(f64, f64)>,
    pub missing: Vec<(f64, f64)>,
}

impl Strip {
    /// A strip with lines alone.
    #[must_use]
    pub fn of_lines(
        name: &str,
        unit: &str,
        height: f64,
        scale: Scale,
        lines: Vec<StripLine>,
    ) -> Strip {
        Strip {
            name: name.to_owned(),
            unit: unit.to_owned(),
            height,
            scale,
            lines,
            tube: vec![],
            outside: OutsideSpans::default(),
            dots: vec![],
            flagged: FlaggedSpans::default(),
            attributes: vec![],
        }
    }

    /// Vertical place of a value, kept inside the strip.
    pub(super) fn y(&self, top: f64, value: f64) -> f64 {
        let share = (value - self.scale.min) / (self.scale.max - self.scale.min);
        top + (1.0 - share.clamp(0.0, 1.0)) * self.height
    }
}

impl StripLine {
    /// A solid line without gaps.
    #[must_use]
    pub fn solid(points: Vec<(f64, f64)>, colour: &'static str, width: f64) -> StripLine {
        StripLine {
            pieces: vec![points],
            colour,
            width,
            dash: "",
        }
    }

    /// A solid line in the colour of computed responses, residuals and inputs.
    #[must_use]
    pub fn ink(points: Vec<(f64, f64)>, width: f64) -> StripLine {
        StripLine::solid(points, INK, width)
    }
}

/// Sizes of text and gaps, in units of the drawing.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Height of text.
    pub text: f64,
    /// Width of a letter over its height: an upper estimate.
    pub letter: f64,
    /// Width reserved for tick labels.
    pub tick_labels: f64,
    /// Half the gap between strips: half a tick label.
    pub half_gap: f64,
    /// Height of the time axis with its tick labels and title.
    pub time_axis: f64,
}

impl Sizes {
    /// Sizes for a drawing in a page with others.
    pub const COMPACT: Sizes = Sizes {
        text: 11.0,
        letter: 0.56,
        tick_labels: 38.0,
        half_gap: 5.0,
        time_axis: 32.0,
    };

    /// Sizes for a drawing that fills a screen.
    pub const LARGE: Sizes = Sizes {
        text: 13.0,
        letter: 0.6,
        tick_labels: 52.0,
        half_gap: 7.0,
        time_axis: 40.0,
    };

    /// Width of a text.
    #[must_use]
    pub fn text_width(&self, text: &str) -> f64 {
        self.letter * self.text * text.chars().count() as f64
    }

    /// Width of the longest name or unit of some strips.
    #[must_use]
    pub fn names_width(&self, strips: &[Strip]) -> f64 {
        strips
            .iter()
            .flat_map(|strip| [&strip.name, &strip.unit])
            .map(|text| self.text_width(text))
            .fold(0.0, f64::max)
    }

    /// Height of strips with their gaps, without the time axis.
    #[must_use]
    pub fn strips_height(&self, strips: &[Strip]) -> f64 {
        strips
            .iter()
            .map(|strip| strip.height + 2.0 * self.half_gap)
            .sum()
    }
}
