//! Chart of one quantity over another: points with ellipses, and boxes of levels behind them.

use std::fmt::Write;

use super::scale::Scale;
use super::style::{FAINT, INK};
use super::svg_writer::{
    Alternative, Anchor, PathStyle, SvgWriter, TextStyle, coordinate, rectangle,
};
use crate::report::notation::Digits;

/// Half the width of a page, where text of 11 units is over 7 pt.
const SIZE: (f64, f64) = (400.0, 300.0);
const TEXT: f64 = 11.0;
/// Left, top, right and bottom margin of the frame.
const MARGINS: [f64; 4] = [52.0, 8.0, 10.0, 36.0];
/// Half of the side of a point's mark.
const MARK: f64 = 2.2;

/// Axis of a chart, linear or logarithmic.
#[derive(Clone, Debug)]
pub struct ChartAxis {
    pub label: String,
    /// Limits and ticks; of the decimal logarithm on a logarithmic axis.
    pub scale: Scale,
    pub is_logarithmic: bool,
}

/// A point with the outline of its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartPoint {
    pub at: (f64, f64),
    /// Text beside the point; empty for none.
    pub label: String,
    pub outline: Vec<(f64, f64)>,
}

/// Box of a level; an open side reaches the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelBox {
    pub label: &'static str,
    pub x: (Option<f64>, Option<f64>),
    pub y: (Option<f64>, Option<f64>),
}

/// Points of one colour, joined by a line if they are a sequence.
#[derive(Clone, Debug)]
pub struct ChartSeries {
    pub colour: &'static str,
    pub points: Vec<ChartPoint>,
    pub is_joined: bool,
}

/// Chart of one quantity over another.
#[derive(Clone, Debug)]
pub struct XyChart<'a> {
    /// Id, unique in the page.
    pub id: &'a str,
    pub title: &'a str,
    /// Alternative text.
    pub description: &'a str,
    pub x: ChartAxis,
    pub y: ChartAxis,
    /// Boxes of levels, from the outermost inwards.
    pub boxes: Vec<LevelBox>,
    pub series: Vec<ChartSeries>,
}

impl ChartAxis {
    #[must_use]
    pub fn linear(label: &str, scale: Scale) -> ChartAxis {
        ChartAxis {
            label: label.to_owned(),
            scale,
            is_logarithmic: false,
        }
    }

    /// Share of the axis at a value, kept inside the frame; `None` for a value that has no place.
    fn share(&self, value: f64) -> Option<f64> {
        let placed = if self.is_logarithmic {
            value.max(f64::MIN_POSITIVE).log10()
        } else {
            value
        };
        let share = (placed - self.scale.min) / (self.scale.max - self.scale.min);
        share.is_finite().then_some(share.clamp(0.0, 1.0))
    }

    /// Ticks with their labels.
    fn ticks(&self) -> Vec<(f64, String)> {
        let digits = Digits::of_ticks(self.scale.decimals());
        let count = ((self.scale.max - self.scale.min) / self.scale.step + 1e-6).floor();
        let first = (self.scale.min / self.scale.step - 1e-6).ceil() * self.scale.step;
        let mut ticks = Vec::new();
        let mut i = 0.0;
        while i <= count {
            let place = first + i * self.scale.step;
            i += 1.0;
            if place > self.scale.max + 1e-9 * self.scale.step {
                break;
            }
            let label = if self.is_logarithmic {
                format!("{}", 10_f64.powf(place))
            } else {
                digits.write(Some(place))
            };
            let value = if self.is_logarithmic {
                10_f64.powf(place)
            } else {
                place
            };
            ticks.push((value, label));
        }
        ticks
    }
}

/// Logarithmic scale of whole decades that covers values.
#[must_use]
pub fn decades(low: f64, high: f64) -> Scale {
    let least = low.max(1e-12).log10().floor();
    let most = high.max(1e-12).log10().ceil();
    Scale {
        min: least,
        max: most.max(least + 1.0),
        step: 1.0,
    }
}

/// Draws the chart.
#[must_use]
pub fn draw(chart: &XyChart) -> String {
    let mut svg = SvgWriter::default();
    let pen = Pen { chart };
    pen.boxes(&mut svg);
    pen.axes(&mut svg);
    for series in &chart.series {
        pen.series(&mut svg, series);
    }
    let alternative = Alternative {
        id: chart.id,
        title: chart.title,
        description: chart.description,
    };
    svg.inline(SIZE, TEXT, alternative)
}

struct Pen<'a> {
    chart: &'a XyChart<'a>,
}

impl Pen<'_> {
    fn x(&self, value: f64) -> Option<f64> {
        let width = SIZE.0 - MARGINS[0] - MARGINS[2];
        Some(MARGINS[0] + self.chart.x.share(value)? * width)
    }

    fn y(&self, value: f64) -> Option<f64> {
        let height = SIZE.1 - MARGINS[1] - MARGINS[3];
        Some(MARGINS[1] + (1.0 - self.chart.y.share(value)?) * height)
    }

    fn point_in_frame(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        Some((self.x(x)?, self.y(y)?))
    }

    fn frame() -> [f64; 4] {
        [
            MARGINS[0],
            MARGINS[1],
            SIZE.0 - MARGINS[2],
            SIZE.1 - MARGINS[3],
        ]
    }

    fn boxes(&self, svg: &mut SvgWriter) {
        let [left, top, right, bottom] = Pen::frame();
        for level in &self.chart.boxes {
            let x = |side: Option<f64>, open: f64| side.and_then(|v| self.x(v)).unwrap_or(open);
            let y = |side: Option<f64>, open: f64| side.and_then(|v| self.y(v)).unwrap_or(open);
            let (from, to) = (x(level.x.0, left), x(level.x.1, right));
            let (lower, upper) = (y(level.y.0, bottom), y(level.y.1, top));
            if to <= from || lower <= upper {
                continue;
            }
            let style = PathStyle {
                fill: Some("#0060a8"),
                fill_opacity: Some(0.07),
                ..PathStyle::line(FAINT, 0.6)
            };
            svg.path(&rectangle((from, upper), (to - from, lower - upper)), style);
            let text = TextStyle {
                anchor: Anchor::End,
                ..TextStyle::coloured(FAINT)
            };
            svg.text((to - 3.0, upper + TEXT), level.label, text);
        }
    }

    fn axes(&self, svg: &mut SvgWriter) {
        let [left, top, right, bottom] = Pen::frame();
        let mut grid = String::new();
        let text = TextStyle::coloured(INK);
        for (value, label) in self.chart.x.ticks() {
            let Some(x) = self.x(value) else { continue };
            // Writing into a String cannot fail.
            let _ = write!(grid, "M{} {}v4", coordinate(x), coordinate(bottom));
            let middle = TextStyle {
                anchor: Anchor::Middle,
                ..text
            };
            svg.text((x, bottom + 15.0), &label, middle);
        }
        for (value, label) in self.chart.y.ticks() {
            let Some(y) = self.y(value) else { continue };
            let _ = write!(grid, "M{} {}h-4", coordinate(left), coordinate(y));
            let end = TextStyle {
                anchor: Anchor::End,
                ..text
            };
            svg.text((left - 6.0, y + 4.0), &label, end);
        }
        for (at_zero, is_vertical) in [(self.chart.x.zero(), true), (self.chart.y.zero(), false)] {
            if !at_zero {
                continue;
            }
            if let (true, Some(x)) = (is_vertical, self.x(0.0)) {
                let _ = write!(
                    grid,
                    "M{} {}V{}",
                    coordinate(x),
                    coordinate(top),
                    coordinate(bottom)
                );
            } else if let Some(y) = self.y(0.0) {
                let _ = write!(
                    grid,
                    "M{} {}H{}",
                    coordinate(left),
                    coordinate(y),
                    coordinate(right)
                );
            }
        }
        svg.path(&grid, PathStyle::line(FAINT, 0.7));
        let outline = rectangle((left, top), (right - left, bottom - top));
        svg.path(&outline, PathStyle::line(INK, 1.0));
        let middle = TextStyle {
            anchor: Anchor::Middle,
            ..text
        };
        svg.text(
            (0.5 * (left + right), SIZE.1 - 6.0),
            &self.chart.x.label,
            middle,
        );
        let upright = TextStyle {
            is_vertical: true,
            ..middle
        };
        svg.text((12.0, 0.5 * (top + bottom)), &self.chart.y.label, upright);
    }

    fn series(&self, svg: &mut SvgWriter, series: &ChartSeries) {
        let mut outlines = String::new();
        let (mut line, mut marks) = (String::new(), String::new());
        for point in &series.points {
            let Some((x, y)) = self.point_in_frame(point.at) else {
                continue;
            };
            let places = point
                .outline
                .iter()
                .filter_map(|at| self.point_in_frame(*at));
            for (i, (x, y)) in places.enumerate() {
                let command = if i == 0 { 'M' } else { 'L' };
                let _ = write!(outlines, "{command}{} {}", coordinate(x), coordinate(y));
            }
            if !point.outline.is_empty() {
                outlines.push('Z');
            }
            let command = if line.is_empty() { 'M' } else { 'L' };
            let _ = write!(line, "{command}{} {}", coordinate(x), coordinate(y));
            marks.push_str(&rectangle((x - MARK, y - MARK), (2.0 * MARK, 2.0 * MARK)));
        }
        let outline = PathStyle {
            fill: Some(series.colour),
            fill_opacity: Some(0.12),
            ..PathStyle::line(series.colour, 0.6)
        };
        svg.path(&outlines, outline);
        if series.is_joined {
            svg.path(&line, PathStyle::line(series.colour, 0.9));
        }
        svg.path(&marks, PathStyle::filled(series.colour));
        for point in series.points.iter().filter(|p| !p.label.is_empty()) {
            if let Some((x, y)) = self.point_in_frame(point.at) {
                let style = TextStyle::coloured(series.colour);
                svg.text((x + 4.0, y - 4.0), &point.label, style);
            }
        }
    }
}

impl ChartAxis {
    /// `true` where zero lies inside the axis.
    fn zero(&self) -> bool {
        !self.is_logarithmic && self.scale.min < 0.0 && self.scale.max > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(low: f64, high: f64) -> ChartAxis {
        ChartAxis {
            label: "x <unit>".into(),
            scale: Scale::covering(low, high),
            is_logarithmic: false,
        }
    }

    fn chart() -> XyChart<'static> {
        XyChart {
            id: "c",
            title: "a chart",
            description: "what it shows",
            x: axis(0.0, 1.0),
            y: ChartAxis {
                scale: decades(0.02, 8.0),
                is_logarithmic: true,
                ..axis(0.0, 1.0)
            },
            boxes: vec![LevelBox {
                label: "Level 1",
                x: (Some(0.5), None),
                y: (Some(0.1), Some(1.0)),
            }],
            series: vec![ChartSeries {
                colour: INK,
                is_joined: true,
                points: vec![ChartPoint {
                    at: (0.5, 0.1),
                    label: "10°".into(),
                    outline: vec![(0.4, 0.1), (0.6, 0.1), (0.5, 0.2)],
                }],
            }],
        }
    }

    #[test]
    fn points_are_at_their_values_on_linear_and_logarithmic_axes() {
        let chart = chart();
        let pen = Pen { chart: &chart };
        let [left, top, right, bottom] = Pen::frame();
        assert!((pen.x(0.5).unwrap() - 0.5 * (left + right)).abs() < 1e-9);
        // Decades from 0.01 to 10: 0.1 is a third up.
        assert!((pen.y(0.1).unwrap() - (bottom - (bottom - top) / 3.0)).abs() < 1e-9);
        assert!((pen.y(-1.0).unwrap() - bottom).abs() < 1e-9);
        assert_eq!(pen.x(f64::NAN), None);
    }

    #[test]
    fn the_chart_is_well_formed_with_boxes_labels_and_alternative_text() {
        let svg = draw(&chart());
        let document = roxmltree::Document::parse(&svg).unwrap();
        let texts: Vec<&str> = document.descendants().filter_map(|n| n.text()).collect();
        for expected in [
            "a chart",
            "what it shows",
            "Level 1",
            "10°",
            "x <unit>",
            "0.01",
            "10",
        ] {
            assert!(texts.contains(&expected), "{expected}: {texts:?}");
        }
        assert!(!svg.contains("NaN"));
    }
}
