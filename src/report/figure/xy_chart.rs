//! Chart of one quantity over another: points with ellipses, and boxes of levels behind them.

use std::fmt::Write;

use super::chart_axis::ChartAxis;
use super::chart_labels::{
    ASCENT, Area, LABEL_GAPS, Labels, MARGINS, SIZE, TEXT, corners_inside, frame, width_of,
};
use super::style::{FAINT, INK};
use super::svg_writer::{
    Alternative, Anchor, PathStyle, SvgWriter, TextStyle, coordinate, rectangle,
};

/// Half of the side of a point's mark.
const MARK: f64 = 2.2;

/// A point with the outline of its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartPoint {
    pub at: (f64, f64),
    /// Text beside the point; empty for none.
    pub label: String,
    pub outline: Vec<(f64, f64)>,
}

impl ChartPoint {
    /// A point without an outline.
    #[must_use]
    pub fn new(at: (f64, f64), label: String) -> ChartPoint {
        ChartPoint {
            at,
            label,
            outline: vec![],
        }
    }
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

/// Draws the chart.
#[must_use]
pub fn draw(chart: &XyChart) -> String {
    let mut svg = SvgWriter::default();
    let pen = Pen { chart };
    let mut labels = Labels::default();
    pen.boxes(&mut svg, &mut labels);
    pen.axes(&mut svg);
    for series in &chart.series {
        pen.series(&mut svg, series);
    }
    pen.labels_of_points(&mut svg, &mut labels);
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

/// Areas that a piece of a line is divided into.
const LINE_AREAS: u32 = 24;

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

    /// Area of a box; `None` for one without a width or height.
    fn area(&self, level: &LevelBox) -> Option<Area> {
        let [left, top, right, bottom] = frame();
        let x = |side: Option<f64>, open: f64| side.and_then(|v| self.x(v)).unwrap_or(open);
        let y = |side: Option<f64>, open: f64| side.and_then(|v| self.y(v)).unwrap_or(open);
        let (from, to) = (x(level.x.0, left), x(level.x.1, right));
        let (lower, upper) = (y(level.y.0, bottom), y(level.y.1, top));
        (to > from && lower > upper).then_some([from, upper, to, lower])
    }

    /// Draws the boxes. Each has its label in a corner that no inner box covers, if there is one.
    fn boxes(&self, svg: &mut SvgWriter, labels: &mut Labels) {
        let boxes = self.chart.boxes.iter();
        let boxes: Vec<(&str, Area)> = boxes
            .filter_map(|level| Some((level.label, self.area(level)?)))
            .collect();
        for (_, [from, upper, to, lower]) in &boxes {
            let style = PathStyle {
                fill: Some("#0060a8"),
                fill_opacity: Some(0.07),
                ..PathStyle::line(FAINT, 0.6)
            };
            svg.path(
                &rectangle((*from, *upper), (to - from, lower - upper)),
                style,
            );
        }
        for (i, (label, area)) in boxes.iter().enumerate().rev() {
            let corners = corners_inside(label, area);
            let inner: Vec<Area> = boxes[i + 1..].iter().map(|(_, area)| *area).collect();
            let place = labels
                .place(label, &corners, &inner)
                .or_else(|| labels.place(label, &corners, &[]));
            if let Some(place) = place {
                svg.text(place, label, TextStyle::coloured(FAINT));
            }
        }
    }

    /// Labels of the points, each at the nearest place that covers neither label, mark nor line; without one, on white
    /// ground over the marks.
    fn labels_of_points(&self, svg: &mut SvgWriter, labels: &mut Labels) {
        let drawn: Vec<Area> = self
            .chart
            .series
            .iter()
            .flat_map(|s| self.drawn(s))
            .collect();
        for series in &self.chart.series {
            for point in series.points.iter().filter(|p| !p.label.is_empty()) {
                let Some((x, y)) = self.point_in_frame(point.at) else {
                    continue;
                };
                let width = width_of(&point.label);
                let around = |gap: f64| {
                    let (right, left) = (x + gap, x - gap - width);
                    let (above, below) = (y - gap - TEXT, y + gap);
                    [(right, above), (right, below), (left, above), (left, below)]
                };
                let corners: Vec<(f64, f64)> = LABEL_GAPS.into_iter().flat_map(around).collect();
                let free = labels.place(&point.label, &corners, &drawn);
                let place = free.or_else(|| labels.place(&point.label, &corners, &[]));
                if let Some(place) = place {
                    if free.is_none() {
                        let corner = (place.0, place.1 - ASCENT * TEXT);
                        let ground = rectangle(corner, (width, TEXT));
                        svg.path(&ground, PathStyle::filled("#ffffff"));
                    }
                    let style = TextStyle::coloured(series.colour);
                    svg.text(place, &point.label, style);
                }
            }
        }
    }

    /// Areas of the marks of a series and of its line.
    fn drawn(&self, series: &ChartSeries) -> Vec<Area> {
        let places: Vec<(f64, f64)> = series
            .points
            .iter()
            .filter_map(|point| self.point_in_frame(point.at))
            .collect();
        let mark = |(x, y): (f64, f64)| [x - MARK, y - MARK, x + MARK, y + MARK];
        let mut areas: Vec<Area> = places.iter().copied().map(mark).collect();
        if series.is_joined {
            for ends in places.windows(2) {
                let ((x, y), (dx, dy)) = (ends[0], (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1));
                let between = (1..LINE_AREAS).map(|i| f64::from(i) / f64::from(LINE_AREAS));
                areas.extend(between.map(|share| mark((x + share * dx, y + share * dy))));
            }
        }
        areas
    }

    /// Draws ticks, lines at zero, the frame, and the labels of the axes.
    fn axes(&self, svg: &mut SvgWriter) {
        let [left, top, right, bottom] = frame();
        let mut grid = self.ticks(svg);
        grid.push_str(&self.lines_at_zero());
        svg.path(&grid, PathStyle::line(FAINT, 0.7));
        let outline = rectangle((left, top), (right - left, bottom - top));
        svg.path(&outline, PathStyle::line(INK, 1.0));
        let middle = TextStyle {
            anchor: Anchor::Middle,
            ..TextStyle::coloured(INK)
        };
        let below = (0.5 * (left + right), SIZE.1 - 6.0);
        svg.text(below, &self.chart.x.label, middle);
        let upright = TextStyle {
            is_vertical: true,
            ..middle
        };
        svg.text((12.0, 0.5 * (top + bottom)), &self.chart.y.label, upright);
    }

    /// Writes the labels of the ticks of both axes; returns the ticks as a path.
    fn ticks(&self, svg: &mut SvgWriter) -> String {
        let [left, _, _, bottom] = frame();
        let mut ticks = String::new();
        let text = TextStyle::coloured(INK);
        for (value, label) in self.chart.x.ticks() {
            let Some(x) = self.x(value) else { continue };
            // Writing into a String cannot fail.
            let _ = write!(ticks, "M{} {}v4", coordinate(x), coordinate(bottom));
            let middle = TextStyle {
                anchor: Anchor::Middle,
                ..text
            };
            svg.text((x, bottom + 15.0), &label, middle);
        }
        for (value, label) in self.chart.y.ticks() {
            let Some(y) = self.y(value) else { continue };
            let _ = write!(ticks, "M{} {}h-4", coordinate(left), coordinate(y));
            let end = TextStyle {
                anchor: Anchor::End,
                ..text
            };
            svg.text((left - 6.0, y + 4.0), &label, end);
        }
        ticks
    }

    /// Lines at zero of the axes that contain it, as a path.
    fn lines_at_zero(&self) -> String {
        let [left, top, right, bottom] = frame().map(coordinate);
        let mut lines = String::new();
        if self.chart.x.contains_zero()
            && let Some(x) = self.x(0.0)
        {
            let _ = write!(lines, "M{} {top}V{bottom}", coordinate(x));
        }
        if self.chart.y.contains_zero()
            && let Some(y) = self.y(0.0)
        {
            let _ = write!(lines, "M{left} {}H{right}", coordinate(y));
        }
        lines
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
    }
}

#[cfg(test)]
mod tests {
    use super::super::chart_axis::decades;
    use super::super::scale::Scale;
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
        let [left, top, right, bottom] = frame();
        assert!((pen.x(0.5).unwrap() - 0.5 * (left + right)).abs() < 1e-9);
        // Decades from 0.01 to 10: 0.1 is a third up.
        assert!((pen.y(0.1).unwrap() - (bottom - (bottom - top) / 3.0)).abs() < 1e-9);
        assert!((pen.y(-1.0).unwrap() - bottom).abs() < 1e-9);
        assert_eq!(pen.x(f64::NAN), None);
    }

    /// Places of the texts of a chart that begin with a word.
    fn places(svg: &str, word: &str) -> Vec<(String, f64, f64)> {
        let document = roxmltree::Document::parse(svg).unwrap();
        let texts = document.descendants().filter(|n| n.has_tag_name("text"));
        let texts = texts.filter(|n| n.text().is_some_and(|t| t.starts_with(word)));
        let number = |n: roxmltree::Node, name: &str| n.attribute(name).unwrap().parse().unwrap();
        let place = |n: roxmltree::Node| {
            let text = n.text().unwrap().to_owned();
            (text, number(n, "x"), number(n, "y"))
        };
        texts.map(place).collect()
    }

    #[test]
    fn labels_of_boxes_with_a_common_corner_do_not_cover_each_other() {
        let level = |label, least| LevelBox {
            label,
            x: (Some(least), None),
            y: (Some(least), None),
        };
        let mut chart = chart();
        chart.y = axis(0.0, 1.0);
        chart.boxes = vec![
            level("Level 3", 0.1),
            level("Level 2", 0.3),
            level("Level 1", 0.6),
        ];
        let places = places(&draw(&chart), "Level");
        assert_eq!(places.len(), 3);
        for (i, (label, x, y)) in places.iter().enumerate() {
            for (other, other_x, other_y) in &places[i + 1..] {
                let is_apart = (y - other_y).abs() >= TEXT || (x - other_x).abs() >= 40.0;
                assert!(is_apart, "{label} and {other}: {places:?}");
            }
        }
    }

    #[test]
    fn a_label_at_the_edge_stays_inside_the_frame() {
        let mut chart = chart();
        chart.y = axis(0.0, 1.0);
        chart.boxes.clear();
        chart.series[0].points[0].at = (1.0, 1.0);
        let [left, top, right, bottom] = frame();
        let (_, x, y) = places(&draw(&chart), "10°").remove(0);
        assert!(x > left && x + 12.0 < right, "{x}");
        assert!(y - ASCENT * TEXT >= top && y < bottom, "{y}");
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
