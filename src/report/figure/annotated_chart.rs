//! Strip chart with annotations, as a file: maneuvers shaded through all strips, the analyst's
//! events, a legend and notes.

use std::fmt::Write;

use super::scale::Scale;
use super::strip::{Sizes, Strip};
use super::strip_marks::{self, MISSING_STYLE};
use super::strip_renderer::{StripColumn, StripDrawing};
use super::style::{EXCLUDED_COLOUR, FAINT, INK};
use super::svg_writer::{Alternative, PathStyle, SvgWriter, TextStyle, coordinate, rectangle};

/// A strip chart with its annotations.
#[derive(Clone, Debug)]
pub struct Chart {
    pub title: String,
    /// Alternative text.
    pub description: String,
    /// Lines under the title.
    pub heading: Vec<String>,
    pub legend: Vec<(Key, String)>,
    /// Time axis in seconds of the record.
    pub time: Scale,
    /// Width of the plot area: one unit per column of the time axis, or more.
    pub width: f64,
    pub windows: Vec<ShadedManeuver>,
    pub lanes: Vec<Lane>,
    pub strips: Vec<Strip>,
    /// Lines under the chart.
    pub notes: Vec<String>,
}

/// A maneuver, shaded through all strips.
#[derive(Clone, Debug)]
pub struct ShadedManeuver {
    pub maneuver_id: String,
    pub class: String,
    /// Text over the shade.
    pub label: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// A row of boxes over the strips.
#[derive(Clone, Debug)]
pub struct Lane {
    pub name: String,
    pub boxes: Vec<LaneBox>,
}

/// An interval given by the analyst or found by the recogniser.
#[derive(Clone, Debug)]
pub struct LaneBox {
    pub label: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// Drawing beside a word of the legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Key {
    Maneuver,
    Event,
    Bridged,
    Despiked,
    Missing,
    Excluded,
    /// Colour and width of a line.
    Line(&'static str, f64),
}

const SIZES: Sizes = Sizes::LARGE;
const TITLE_SIZE: f64 = 17.0;
/// Distance of lines of text.
const LINE: f64 = 18.0;
const EDGE: f64 = 10.0;
/// Height of the row of maneuvers, and of each lane.
const LANE: f64 = 19.0;
/// Name at the left of the row of maneuvers.
const WINDOWS_NAME: &str = "maneuvers";
/// Width of a key in the legend, with the gap to its word.
const KEY_WIDTH: f64 = 26.0;
/// Length of the lines from upright labels to their maneuvers.
const LEADER: f64 = 13.0;
/// Least distance of upright labels.
pub const LABEL_PITCH: f64 = 15.0;

/// Draws the chart.
#[must_use]
pub fn draw(chart: &Chart) -> String {
    let column = column(chart);
    let width = column.right + 2.0 * EDGE;
    let mut svg = SvgWriter::default();
    let y = heading(&mut svg, chart, width);
    let y = legend(&mut svg, &chart.legend, width, y);
    let top = upright_labels(&mut svg, chart, &column, y);
    let strips_top = top + LANE * (1 + chart.lanes.len()) as f64 + 3.0 - SIZES.half_gap;
    let strips_bottom = strips_top + SIZES.strips_height(&chart.strips);
    windows(&mut svg, chart, &column, (top, strips_bottom));
    for (lane, row) in chart.lanes.iter().zip(1..) {
        draw_lane(&mut svg, lane, &column, top + LANE * f64::from(row));
    }
    let mut strips = StripDrawing::default();
    column.draw(&mut strips, &chart.strips, strips_top);
    strips.write(&mut svg);
    let mut y = strips_bottom + SIZES.time_axis + 4.0;
    for line in wrapped(&chart.notes, width) {
        svg.text((EDGE, y), &line, FAINT_TEXT);
        y += LINE;
    }
    let alternative = Alternative {
        id: "chart",
        title: &chart.title,
        description: &chart.description,
    };
    svg.file((width, y + 4.0), SIZES.text, alternative)
}

const INK_TEXT: TextStyle<'static> = TextStyle::coloured(INK);
const FAINT_TEXT: TextStyle<'static> = TextStyle::coloured(FAINT);

/// Horizontal layout: names of strips and lanes, tick labels, plot area.
fn column(chart: &Chart) -> StripColumn {
    let lanes = chart.lanes.iter().map(|lane| lane.name.as_str());
    let names = lanes
        .chain([WINDOWS_NAME])
        .map(|name| SIZES.text_width(name))
        .fold(SIZES.names_width(&chart.strips), f64::max);
    let left = EDGE + names + SIZES.tick_labels;
    StripColumn {
        sizes: SIZES,
        names_left: EDGE,
        left,
        right: left + chart.width,
        time: chart.time,
    }
}

/// Writes title and heading; returns the base line of the last line.
fn heading(svg: &mut SvgWriter, chart: &Chart, width: f64) -> f64 {
    let mut y = 24.0;
    let title = TextStyle {
        size: Some(TITLE_SIZE),
        is_bold: true,
        ..TextStyle::default()
    };
    svg.text((EDGE, y), &chart.title, title);
    for line in wrapped(&chart.heading, width) {
        y += LINE;
        svg.text((EDGE, y), &line, INK_TEXT);
    }
    y
}

/// Draws the legend in as many rows as it needs; returns the top of what follows.
fn legend(svg: &mut SvgWriter, entries: &[(Key, String)], width: f64, above: f64) -> f64 {
    let (mut x, mut y) = (EDGE, above + LINE + 4.0);
    for (key, word) in entries {
        let entry_width = KEY_WIDTH + SIZES.text_width(word) + 10.0;
        if x + entry_width > width && x > EDGE {
            (x, y) = (EDGE, y + LINE);
        }
        draw_key(svg, *key, x, y - 4.5);
        svg.text((x + KEY_WIDTH, y), word, INK_TEXT);
        x += entry_width;
    }
    y + 12.0
}

/// Draws a key 20 units wide around a height.
fn draw_key(svg: &mut SvgWriter, key: Key, x: f64, y: f64) {
    let excluded = PathStyle::filled(EXCLUDED_COLOUR);
    let box_outline = rectangle((x, y - 6.0), (20.0, 12.0));
    match key {
        Key::Maneuver => svg.path(
            &box_outline,
            PathStyle {
                fill: Some("#dddddd"),
                ..PathStyle::line(FAINT, 0.8)
            },
        ),
        Key::Event => svg.path(&box_outline, DASHED),
        Key::Bridged => svg.path(
            &strip_marks::bridged_mark((x + 10.0, x + 12.0), y + 4.0),
            excluded,
        ),
        Key::Despiked => svg.path(&strip_marks::despiked_mark(x + 11.0, y - 4.0), excluded),
        Key::Missing => svg.path(
            &strip_marks::missing_mark((x + 1.0, x + 19.0), y + 2.0),
            MISSING_STYLE,
        ),
        Key::Excluded => svg.path(&rectangle((x + 8.0, y - 2.0), (4.0, 4.0)), excluded),
        Key::Line(colour, width) => svg.path(
            &format!("M{} {}h20", coordinate(x), coordinate(y)),
            PathStyle::line(colour, width),
        ),
    }
}

const DASHED: PathStyle<'static> = PathStyle {
    stroke: Some((INK, 1.0)),
    dash: "4 2",
    fill: None,
    fill_opacity: None,
};

/// `true` if a label is narrower than its interval.
fn fits(column: &StripColumn, (start_s, end_s): (f64, f64), label: &str) -> bool {
    column.x(end_s) - column.x(start_s) > SIZES.text_width(label) + 4.0
}

/// Writes the labels of maneuvers upright if one is wider than its maneuver; returns the top of
/// what follows.
fn upright_labels(svg: &mut SvgWriter, chart: &Chart, column: &StripColumn, y: f64) -> f64 {
    let windows = &chart.windows;
    if windows
        .iter()
        .all(|w| fits(column, (w.start_s, w.end_s), &w.label))
    {
        return y;
    }
    let longest = windows
        .iter()
        .map(|w| SIZES.text_width(&w.label))
        .fold(0.0, f64::max);
    let bottom = y + longest;
    let centres: Vec<f64> = windows
        .iter()
        .map(|w| column.x(0.5 * (w.start_s + w.end_s)))
        .collect();
    let places = spread_apart(&centres, LABEL_PITCH, column.right);
    let style = TextStyle {
        is_vertical: true,
        ..INK_TEXT
    };
    let mut leaders = String::new();
    for ((window, place), centre) in windows.iter().zip(places).zip(centres) {
        svg.text((place + 4.5, bottom), &window.label, style);
        // Writing into a String cannot fail.
        let _ = write!(
            leaders,
            "M{} {}L{} {}",
            coordinate(place),
            coordinate(bottom + 3.0),
            coordinate(centre),
            coordinate(bottom + LEADER)
        );
    }
    svg.path(&leaders, PathStyle::line(FAINT, 0.6));
    bottom + LEADER
}

/// Moves ascending places apart, so that neighbours are at least `pitch` apart and none is beyond
/// `end`.
fn spread_apart(places: &[f64], pitch: f64, end: f64) -> Vec<f64> {
    let mut apart = places.to_vec();
    let mut last = f64::NEG_INFINITY;
    for x in &mut apart {
        *x = x.max(last + pitch);
        last = *x;
    }
    let mut next = end + pitch;
    for x in apart.iter_mut().rev() {
        *x = x.min(next - pitch);
        next = *x;
    }
    apart
}

/// Shades each maneuver through all strips, with its identifier as a tooltip.
fn windows(svg: &mut SvgWriter, chart: &Chart, column: &StripColumn, (top, bottom): (f64, f64)) {
    svg.text((EDGE, top + 14.0), WINDOWS_NAME, FAINT_TEXT);
    for window in &chart.windows {
        let tooltip = format!(
            "{} {}, {:.1} to {:.1} s",
            window.class, window.maneuver_id, window.start_s, window.end_s
        );
        let attributes = [
            ("class", "window"),
            ("data-maneuver", window.maneuver_id.as_str()),
            ("data-class", window.class.as_str()),
        ];
        svg.open_group(&attributes, &tooltip);
        let left = column.x(window.start_s);
        let width = (column.x(window.end_s) - left).max(1.0);
        svg.path(&rectangle((left, top), (width, bottom - top)), shade(0.09));
        svg.path(&rectangle((left, top), (width, LANE - 3.0)), shade(0.12));
        let edges = format!(
            "M{} {top}V{bottom}M{} {top}V{bottom}",
            coordinate(left),
            coordinate(left + width),
            top = coordinate(top),
            bottom = coordinate(bottom),
        );
        svg.path(&edges, PathStyle::line(FAINT, 0.5));
        if fits(column, (window.start_s, window.end_s), &window.label) {
            svg.text((left + 4.0, top + 13.0), &window.label, INK_TEXT);
        }
        svg.close_group();
    }
}

fn shade(opacity: f64) -> PathStyle<'static> {
    PathStyle {
        fill_opacity: Some(opacity),
        ..PathStyle::filled("#000000")
    }
}

/// Draws the intervals of a lane as dashed boxes.
fn draw_lane(svg: &mut SvgWriter, lane: &Lane, column: &StripColumn, top: f64) {
    svg.text((EDGE, top + 13.0), &lane.name, FAINT_TEXT);
    for item in &lane.boxes {
        let tooltip = format!(
            "{}: {}, {:.1} to {:.1} s",
            lane.name, item.label, item.start_s, item.end_s
        );
        svg.open_group(&[("class", "event"), ("data-lane", &lane.name)], &tooltip);
        let (left, right) = (column.x(item.start_s), column.x(item.end_s));
        svg.path(&rectangle((left, top), (right - left, LANE - 4.0)), DASHED);
        if fits(column, (item.start_s, item.end_s), &item.label) {
            svg.text((left + 4.0, top + 12.0), &item.label, INK_TEXT);
        }
        svg.close_group();
    }
}

/// Breaks lines between words at the right edge of a page.
fn wrapped(lines: &[String], width: f64) -> Vec<String> {
    let room = width - 2.0 * EDGE;
    let mut rows = Vec::new();
    for line in lines {
        let mut row = String::new();
        for word in line.split(' ') {
            if !row.is_empty() && SIZES.text_width(&row) + SIZES.text_width(word) > room {
                rows.push(std::mem::take(&mut row));
            }
            if !row.is_empty() {
                row.push(' ');
            }
            row.push_str(word);
        }
        rows.push(row);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::super::strip::{FlaggedSpans, StripLine};
    use super::*;

    fn chart() -> Chart {
        let scale = Scale {
            min: 0.0,
            max: 4.0,
            step: 2.0,
        };
        let line = StripLine {
            pieces: vec![vec![(100.0, 1.0), (200.0, 2.0)], vec![(250.0, 1.5)]],
            ..StripLine::ink(vec![], 1.0)
        };
        Chart {
            title: "flight <1>".into(),
            description: "two & more".into(),
            heading: vec!["word ".repeat(60)],
            legend: vec![(Key::Maneuver, "maneuver".into())],
            time: Scale {
                min: 100.0,
                max: 300.0,
                step: 50.0,
            },
            width: 800.0,
            windows: vec![ShadedManeuver {
                maneuver_id: "f_t00150".into(),
                class: "ONE".into(),
                label: "ONE f_t00150".into(),
                start_s: 150.0,
                end_s: 160.0,
            }],
            lanes: vec![],
            strips: vec![Strip {
                flagged: FlaggedSpans {
                    bridged: vec![(120.0, 130.0)],
                    despiked: vec![(140.0, 140.0)],
                    missing: vec![],
                },
                ..Strip::of_lines("alpha", "deg", 50.0, scale, vec![line])
            }],
            notes: vec![],
        }
    }

    /// Numbers of the first path after a piece of text.
    fn path_after(svg: &str, text: &str) -> Vec<f64> {
        let (_, rest) = svg.split_once(text).expect(text);
        let (_, path) = rest.split_once("<path d=\"").expect("a path");
        let (data, _) = path.split_once('"').expect("an end");
        data.split(|c: char| c == ' ' || c.is_ascii_alphabetic())
            .filter_map(|number| number.parse().ok())
            .collect()
    }

    #[test]
    fn windows_lines_and_flags_are_at_their_times() {
        let chart = chart();
        let svg = draw(&chart);
        let left = column(&chart).left;
        let x = |time_s: f64| left + (time_s - 100.0) / 200.0 * 800.0;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 0.1, "{a} for {b}");
        let window = path_after(&svg, "data-maneuver=\"f_t00150\"");
        near(window[0], x(150.0));
        near(window[2], x(160.0) - x(150.0));
        near(path_after(&svg, "class=\"mark bridged\"")[0], x(120.0));
        near(
            path_after(&svg, "class=\"mark despiked\"")[0] + 4.0,
            x(140.0),
        );
        let quarters = |value: f64| (4.0 * value).round();
        let (first, step) = (quarters(x(100.0)), quarters(x(200.0) - x(100.0)));
        let line = format!("<path transform=\"scale(.25)\" d=\"M{first} ");
        assert!(
            svg.contains(&line) && svg.contains(&format!("l{step}-")),
            "{svg}"
        );
        assert!(!svg.contains("class=\"mark missing\""));
    }

    #[test]
    fn a_chart_is_well_formed_and_has_alternative_text() {
        let svg = draw(&chart());
        assert!(svg.contains("<title id=\"chart-t\">flight &lt;1&gt;</title>"));
        assert!(svg.contains("two &amp; more</desc>"));
        assert_eq!(svg.matches("<g").count(), svg.matches("</g>").count());
        assert_eq!(svg.matches("<svg").count(), 1);
        assert!(roxmltree::Document::parse(&svg).is_ok() && !svg.contains("NaN"));
    }

    #[test]
    fn labels_are_spread_apart_and_stay_inside() {
        assert_eq!(
            spread_apart(&[10.0, 12.0, 50.0], 15.0, 100.0),
            [10.0, 25.0, 50.0]
        );
        assert_eq!(
            spread_apart(&[90.0, 95.0, 99.0], 15.0, 100.0),
            [70.0, 85.0, 100.0]
        );
    }

    #[test]
    fn long_lines_are_broken_between_words() {
        let lines = wrapped(&["word ".repeat(60)], 400.0);
        assert!(
            lines.len() > 4 && lines.iter().all(|l| SIZES.text_width(l) <= 400.0),
            "{lines:?}"
        );
    }
}
