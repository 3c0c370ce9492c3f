//! A strip chart: signals under each other over one time axis, with the maneuvers shaded through
//! all of them.
//!
//! The crate draws the axes of each strip; lines, shading and marks are paths in its scene, as in
//! the other figures. It stacks no plots with names beside them, so the strips are put under each
//! other here.

use std::fmt::Write;

use kuva::backend::svg::SvgBackend;
use kuva::render::color::Color;
use kuva::render::layout::{ComputedLayout, Layout, TickFormat};
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor, render_multiple};

use super::derivative_figure::{layout, nothing, path_of, shortened};
use super::scale::Scale;
use super::style::{EXCLUDED_COLOUR, FAINT, FONT, INK};
use crate::report::notation::escaped;

/// A strip chart with everything on it.
#[derive(Clone, Debug)]
pub struct Chart {
    pub title: String,
    /// What those are told who do not see it.
    pub description: String,
    /// Lines under the title.
    pub heading: Vec<String>,
    pub legend: Vec<(Key, String)>,
    /// Seconds of the record.
    pub time: Scale,
    /// Width of the plot area: as many units as the time axis has columns, or more.
    pub width: f64,
    pub windows: Vec<Window>,
    pub lanes: Vec<Lane>,
    pub strips: Vec<Strip>,
    /// Lines under the chart.
    pub notes: Vec<String>,
}

/// A maneuver, shaded through all strips.
#[derive(Clone, Debug)]
pub struct Window {
    pub maneuver_id: String,
    pub class: String,
    /// What is written over it.
    pub label: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// A line of boxes over the strips.
#[derive(Clone, Debug)]
pub struct Lane {
    pub name: String,
    pub boxes: Vec<LaneBox>,
}

/// An interval that was given or found.
#[derive(Clone, Debug)]
pub struct LaneBox {
    pub label: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// One signal over time.
#[derive(Clone, Debug)]
pub struct Strip {
    pub name: String,
    pub unit: String,
    pub height: f64,
    pub scale: Scale,
    pub traces: Vec<Trace>,
    /// Samples that stand out as dots.
    pub dots: Vec<(f64, f64)>,
    pub marks: Marks,
}

/// One line of a strip, in pieces between which samples are missing.
#[derive(Clone, Debug)]
pub struct Trace {
    pub pieces: Vec<Vec<(f64, f64)>>,
    pub colour: &'static str,
    pub width: f64,
}

/// From when to when samples are not as recorded, s.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    pub bridged: Vec<(f64, f64)>,
    pub despiked: Vec<(f64, f64)>,
    pub missing: Vec<(f64, f64)>,
}

/// What a word of the legend stands beside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Key {
    Window,
    Given,
    Bridged,
    Despiked,
    Missing,
    Dot,
    Line(&'static str, f64),
}

const TEXT: f64 = 13.0;
const LINE: f64 = 18.0;
/// Half a tick label above and below a strip, so that labels of neighbours do not touch.
const ROOM: f64 = 7.0;
/// Room for the numbers at the ticks.
const TICKS: f64 = 52.0;
const EDGE: f64 = 10.0;
const LANE: f64 = 19.0;
/// Ticks and label of the time axis.
const AXIS: f64 = 46.0;
const SHADE: &str = "#000000";
/// So wide a letter is at most, on average, in units of its size.
const LETTER: f64 = 0.6;
/// Labels that stand upright are so far apart.
pub const PITCH: f64 = 15.0;

/// How wide a text may be.
fn text_width(text: &str) -> f64 {
    LETTER * TEXT * text.chars().count() as f64
}

/// The strip chart as a file of its own.
#[must_use]
pub fn draw(chart: &Chart) -> String {
    let place = Place::of(chart);
    let mut scene = Scene::new(place.total_width(), 0.0);
    let mut y = header(&mut scene, chart, &place);
    y = labels(&mut scene, chart, &place, y);
    let top = y;
    y += LANE * (1 + chart.lanes.len()) as f64 + 3.0;
    let bottom = y + chart
        .strips
        .iter()
        .map(|s| s.height + 2.0 * ROOM)
        .sum::<f64>()
        - ROOM;
    windows(&mut scene, chart, &place, (top, bottom));
    lanes(&mut scene, chart, &place, top);
    for (i, strip) in chart.strips.iter().enumerate() {
        let is_last = i + 1 == chart.strips.len();
        put_strip(&mut scene, chart, &place, strip, y, is_last);
        y += strip.height + 2.0 * ROOM;
    }
    y += AXIS;
    for line in wrapped(&chart.notes, scene.width) {
        scene.elements.push(text(EDGE, y, &line, FAINT, None));
        y += LINE;
    }
    scene.height = y + 4.0;
    file(&scene, chart)
}

/// Where things are across the page.
struct Place {
    left: f64,
    width: f64,
    time: ComputedLayout,
}

impl Place {
    fn of(chart: &Chart) -> Place {
        let names = chart
            .strips
            .iter()
            .flat_map(|s| [&s.name, &s.unit])
            .chain(chart.lanes.iter().map(|l| &l.name));
        let widest = names
            .map(|n| text_width(n))
            .fold(text_width("maneuvers"), f64::max);
        let left = EDGE + widest + TICKS;
        let time = axes(
            chart.time,
            Scale {
                min: 0.0,
                max: 1.0,
                step: 1.0,
            },
            left,
            chart.width,
            50.0,
        );
        Place {
            left,
            width: chart.width,
            time: ComputedLayout::from_layout(&time),
        }
    }

    fn right(&self) -> f64 {
        self.left + self.width
    }

    fn total_width(&self) -> f64 {
        self.right() + 2.0 * EDGE
    }

    /// Where a time is, kept inside the plot area.
    fn x(&self, time_s: f64) -> f64 {
        self.time.map_x(time_s).clamp(self.left, self.right())
    }
}

fn axes(time: Scale, scale: Scale, left: f64, width: f64, height: f64) -> Layout {
    layout("time, s", "", height + ROOM + AXIS, time, scale)
        .with_width(left + width + 2.0 * EDGE)
        .with_force_margins(left, 2.0 * EDGE)
        .with_force_margins_y(ROOM, AXIS)
        .with_label_size(13)
        .with_tick_size(12)
}

/// Title, heading and legend; returns where the next thing begins.
fn header(scene: &mut Scene, chart: &Chart, place: &Place) -> f64 {
    let mut y = 24.0;
    scene.elements.push(Primitive::Text {
        x: EDGE,
        y,
        content: chart.title.clone(),
        size: 17,
        anchor: TextAnchor::Start,
        rotate: None,
        bold: true,
        color: None,
    });
    for line in wrapped(&chart.heading, place.total_width()) {
        y += LINE;
        scene.elements.push(text(EDGE, y, &line, INK, None));
    }
    y += LINE + 4.0;
    let mut x = EDGE;
    for (key, word) in &chart.legend {
        let width = 26.0 + text_width(word) + 10.0;
        if x + width > place.total_width() && x > EDGE {
            (x, y) = (EDGE, y + LINE);
        }
        put_key(scene, *key, x, y - 4.5);
        scene.elements.push(text(x + 26.0, y, word, INK, None));
        x += width;
    }
    y + 12.0
}

fn put_key(scene: &mut Scene, key: Key, x: f64, y: f64) {
    let primitive = match key {
        Key::Window => path(
            format!("M{x:.1} {:.1}h20v12h-20z", y - 6.0),
            FAINT,
            0.8,
            Some("#dddddd"),
        ),
        Key::Given => dashed(format!("M{x:.1} {:.1}h20v12h-20z", y - 6.0)),
        Key::Bridged => path(
            bridged(x + 10.0, x + 12.0, y + 4.0),
            "none",
            0.0,
            Some(EXCLUDED_COLOUR),
        ),
        Key::Despiked => path(
            despiked(x + 11.0, y - 4.0),
            "none",
            0.0,
            Some(EXCLUDED_COLOUR),
        ),
        Key::Missing => path(
            missing(x + 1.0, x + 19.0, y + 2.0),
            EXCLUDED_COLOUR,
            0.8,
            Some("#ffffff"),
        ),
        Key::Dot => path(
            format!("M{:.1} {:.1}h4v4h-4z", x + 8.0, y - 2.0),
            "none",
            0.0,
            Some(EXCLUDED_COLOUR),
        ),
        Key::Line(colour, width) => path(format!("M{x:.1} {y:.1}h20"), colour, width, None),
    };
    scene.elements.push(primitive);
}

/// Labels that do not fit into their windows, upright over them, pushed apart where they would
/// touch.
fn labels(scene: &mut Scene, chart: &Chart, place: &Place, y: f64) -> f64 {
    if chart
        .windows
        .iter()
        .all(|w| fits(place, w.start_s, w.end_s, &w.label))
    {
        return y;
    }
    let longest = chart
        .windows
        .iter()
        .map(|w| text_width(&w.label))
        .fold(0.0, f64::max);
    let bottom = y + longest;
    let centres: Vec<f64> = chart
        .windows
        .iter()
        .map(|w| place.x(0.5 * (w.start_s + w.end_s)))
        .collect();
    let mut leaders = String::new();
    for ((window, at), x) in chart
        .windows
        .iter()
        .zip(apart(&centres, PITCH, place.right()))
        .zip(&centres)
    {
        scene
            .elements
            .push(text(at + 4.5, bottom, &window.label, INK, Some(-90.0)));
        // Writing into a String cannot fail.
        let _ = write!(
            leaders,
            "M{at:.1} {:.1}L{x:.1} {:.1}",
            bottom + 3.0,
            bottom + 13.0
        );
    }
    scene.elements.push(path(leaders, FAINT, 0.6, None));
    bottom + 13.0
}

/// The places nearest to these, in their order, that are a pitch apart and not beyond an end.
fn apart(places: &[f64], pitch: f64, end: f64) -> Vec<f64> {
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

fn fits(place: &Place, start_s: f64, end_s: f64, label: &str) -> bool {
    place.x(end_s) - place.x(start_s) > text_width(label) + 4.0
}

/// Each maneuver as a shade through all strips, which says its name to a pointer that rests on it.
fn windows(scene: &mut Scene, chart: &Chart, place: &Place, (top, bottom): (f64, f64)) {
    scene
        .elements
        .push(text(EDGE, top + 14.0, "maneuvers", FAINT, None));
    for window in &chart.windows {
        let (id, class) = (escaped(&window.maneuver_id), escaped(&window.class));
        let (start_s, end_s) = (window.start_s, window.end_s);
        scene.elements.push(Primitive::GroupStart {
            transform: None,
            title: Some(format!(
                "{} {}, {start_s:.1} to {end_s:.1} s",
                window.class, window.maneuver_id
            )),
            extra_attrs: Some(format!(
                r#"class="window" data-maneuver="{id}" data-class="{class}""#
            )),
        });
        let (x, width) = (
            place.x(start_s),
            (place.x(end_s) - place.x(start_s)).max(1.0),
        );
        let rect = |y: f64, height: f64, opacity: f64| Primitive::Rect {
            x,
            y,
            width,
            height,
            fill: Color::from(SHADE),
            stroke: None,
            stroke_width: None,
            opacity: Some(opacity),
        };
        scene.elements.push(rect(top, bottom - top, 0.09));
        scene.elements.push(rect(top, LANE - 3.0, 0.12));
        scene.elements.push(path(
            format!("M{x:.1} {top:.1}V{bottom:.1}m{width:.1} 0V{top:.1}"),
            FAINT,
            0.5,
            None,
        ));
        if fits(place, start_s, end_s, &window.label) {
            scene
                .elements
                .push(text(x + 4.0, top + 13.0, &window.label, INK, None));
        }
        scene.elements.push(Primitive::GroupEnd);
    }
}

/// What was given and what was found, as boxes of dashes.
fn lanes(scene: &mut Scene, chart: &Chart, place: &Place, top: f64) {
    for (i, lane) in chart.lanes.iter().enumerate() {
        let y = top + LANE * (i + 1) as f64;
        scene
            .elements
            .push(text(EDGE, y + 13.0, &lane.name, FAINT, None));
        for item in &lane.boxes {
            let (x, end) = (place.x(item.start_s), place.x(item.end_s));
            scene.elements.push(Primitive::GroupStart {
                transform: None,
                title: Some(format!(
                    "{}: {}, {:.1} to {:.1} s",
                    lane.name, item.label, item.start_s, item.end_s
                )),
                extra_attrs: Some(format!(
                    r#"class="event" data-lane="{}""#,
                    escaped(&lane.name)
                )),
            });
            let (width, height) = (end - x, LANE - 4.0);
            scene.elements.push(dashed(format!(
                "M{x:.1} {y:.1}h{width:.1}v{height:.1}h-{width:.1}z"
            )));
            if fits(place, item.start_s, item.end_s, &item.label) {
                scene
                    .elements
                    .push(text(x + 4.0, y + 12.0, &item.label, INK, None));
            }
            scene.elements.push(Primitive::GroupEnd);
        }
    }
}

/// One strip with its top at `y`; the last bears the numbers of the time axis.
fn put_strip(
    scene: &mut Scene,
    chart: &Chart,
    place: &Place,
    strip: &Strip,
    y: f64,
    is_last: bool,
) {
    let mut layout = axes(
        chart.time,
        strip.scale,
        place.left,
        place.width,
        strip.height,
    );
    if !is_last {
        layout = layout
            .with_x_label("")
            .with_x_tick_format(TickFormat::Custom(std::sync::Arc::new(|_| String::new())));
    }
    let own = ComputedLayout::from_layout(&layout);
    scene.elements.push(Primitive::GroupStart {
        transform: Some(format!("translate(0,{:.1})", y - ROOM)),
        title: None,
        extra_attrs: Some(format!(
            r#"class="strip" data-signal="{}""#,
            escaped(&strip.name)
        )),
    });
    let is_wanted = |e: &Primitive| match e {
        Primitive::Text { content, .. } => !content.is_empty(),
        Primitive::ClipStart { .. } | Primitive::ClipEnd => false,
        _ => true,
    };
    scene.elements.extend(
        render_multiple(vec![nothing()], layout)
            .elements
            .into_iter()
            .filter(is_wanted),
    );
    let middle = ROOM + 0.5 * strip.height;
    scene
        .elements
        .push(text(EDGE, middle - 2.0, &strip.name, INK, None));
    scene
        .elements
        .push(text(EDGE, middle + 14.0, &strip.unit, FAINT, None));
    let y = |value: f64| own.map_y(value.clamp(strip.scale.min, strip.scale.max));
    for trace in &strip.traces {
        scene.elements.push(path(
            line(&trace.pieces, place, y),
            trace.colour,
            trace.width,
            None,
        ));
    }
    let mut dots = String::new();
    for &(time_s, value) in &strip.dots {
        let _ = write!(
            dots,
            "M{:.1} {:.1}h4v4h-4z",
            place.x(time_s) - 2.0,
            y(value) - 2.0
        );
    }
    scene
        .elements
        .push(path(dots, "none", 0.0, Some(EXCLUDED_COLOUR)));
    put_marks(scene, strip, place);
    scene.elements.push(Primitive::GroupEnd);
}

fn line(pieces: &[Vec<(f64, f64)>], place: &Place, y: impl Fn(f64) -> f64) -> String {
    let mut d = String::new();
    for piece in pieces {
        for (i, &(time_s, value)) in piece.iter().enumerate() {
            let pen = if i == 0 { 'M' } else { 'L' };
            let _ = write!(d, "{pen}{:.1} {:.1}", place.x(time_s), y(value));
        }
        if piece.len() == 1 {
            d.push_str("h.6");
        }
    }
    d
}

/// Bridged samples stand at the bottom of the strip, despiked ones at its top, missing ones as a
/// hollow bar.
fn put_marks(scene: &mut Scene, strip: &Strip, place: &Place) {
    let (top, bottom) = (ROOM, ROOM + strip.height);
    let centre = |run: &(f64, f64)| place.x(0.5 * (run.0 + run.1));
    let ends = |run: &(f64, f64)| (place.x(run.0), place.x(run.1));
    let of_bridged = strip
        .marks
        .bridged
        .iter()
        .map(|r| bridged(ends(r).0, ends(r).1, bottom));
    let of_despiked = strip
        .marks
        .despiked
        .iter()
        .map(|r| despiked(centre(r), top));
    let of_missing = strip
        .marks
        .missing
        .iter()
        .map(|r| missing(ends(r).0, ends(r).1, bottom));
    let kinds = [
        (
            "bridged",
            of_bridged.collect::<String>(),
            "none",
            EXCLUDED_COLOUR,
        ),
        ("despiked", of_despiked.collect(), "none", EXCLUDED_COLOUR),
        ("missing", of_missing.collect(), EXCLUDED_COLOUR, "#ffffff"),
    ];
    for (kind, d, stroke, fill) in kinds.into_iter().filter(|k| !k.1.is_empty()) {
        scene.elements.push(Primitive::GroupStart {
            transform: None,
            title: None,
            extra_attrs: Some(format!(r#"class="mark {kind}""#)),
        });
        scene.elements.push(path(d, stroke, 0.8, Some(fill)));
        scene.elements.push(Primitive::GroupEnd);
    }
}

fn bridged(x: f64, end: f64, bottom: f64) -> String {
    format!("M{x:.1} {bottom:.1}v-8h{:.1}v8z", (end - x).max(1.6))
}

fn despiked(x: f64, top: f64) -> String {
    format!("M{:.1} {top:.1}h8l-4 8z", x - 4.0)
}

fn missing(x: f64, end: f64, bottom: f64) -> String {
    format!("M{x:.1} {bottom:.1}v-4h{:.1}v4z", (end - x).max(1.6))
}

fn text(x: f64, y: f64, content: &str, colour: &str, rotate: Option<f64>) -> Primitive {
    Primitive::Text {
        x,
        y,
        content: content.to_owned(),
        size: 13,
        anchor: TextAnchor::Start,
        rotate,
        bold: false,
        color: Some(Color::from(colour)),
    }
}

fn path(d: String, colour: &str, width: f64, fill: Option<&str>) -> Primitive {
    path_of(d, colour, width, fill)
}

fn dashed(d: String) -> Primitive {
    Primitive::Path(Box::new(PathData {
        d,
        fill: None,
        stroke: Color::from(INK),
        stroke_width: 1.0,
        opacity: None,
        stroke_dasharray: Some("4 2".to_owned()),
    }))
}

/// Lines broken between words where the page ends.
fn wrapped(lines: &[String], width: f64) -> Vec<String> {
    let mut out = Vec::new();
    for line in lines {
        let mut row = String::new();
        for word in line.split(' ') {
            if !row.is_empty() && text_width(&row) + text_width(word) > width - 2.0 * EDGE {
                out.push(std::mem::take(&mut row));
            }
            if !row.is_empty() {
                row.push(' ');
            }
            row.push_str(word);
        }
        out.push(row);
    }
    out
}

/// The drawing as a file: with its title and description, in the report's font.
fn file(scene: &Scene, chart: &Chart) -> String {
    let svg = SvgBackend::new().render_scene(scene);
    let body = svg.split_once("-->").map_or(&*svg, |(_, body)| body);
    let (width, height) = (scene.width, scene.height);
    let mut head = String::new();
    let _ = write!(
        head,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0}" height="{height:.0}" viewBox="0 0 {width:.0} {height:.0}" role="img" aria-labelledby="title description" font-family="{FONT}"><title id="title">{}</title><desc id="description">{}</desc>"#,
        escaped(&chart.title),
        escaped(&chart.description),
    );
    head + &shortened(body) + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        let line = vec![vec![(100.0, 1.0), (200.0, 2.0)], vec![(250.0, 1.5)]];
        Chart {
            title: "flight <1>".into(),
            description: "two & more".into(),
            heading: vec!["word ".repeat(60)],
            legend: vec![(Key::Window, "maneuver".into())],
            time: Scale {
                min: 100.0,
                max: 300.0,
                step: 50.0,
            },
            width: 800.0,
            windows: vec![Window {
                maneuver_id: "f_t00150".into(),
                class: "ONE".into(),
                label: "ONE f_t00150".into(),
                start_s: 150.0,
                end_s: 160.0,
            }],
            lanes: vec![],
            strips: vec![Strip {
                name: "alpha".into(),
                unit: "deg".into(),
                height: 50.0,
                scale: Scale {
                    min: 0.0,
                    max: 4.0,
                    step: 2.0,
                },
                traces: vec![Trace {
                    pieces: line,
                    colour: INK,
                    width: 1.0,
                }],
                dots: vec![],
                marks: Marks {
                    bridged: vec![(120.0, 130.0)],
                    despiked: vec![(140.0, 140.0)],
                    missing: vec![],
                },
            }],
            notes: vec![],
        }
    }

    /// The first number after a piece of text.
    fn after(svg: &str, what: &str, attribute: &str) -> f64 {
        let rest = &svg[svg
            .find(what)
            .unwrap_or_else(|| panic!("{what} is not in {svg}"))..];
        let rest = &rest[rest.find(attribute).expect(attribute) + attribute.len()..];
        let end = rest
            .find(|c: char| !(c.is_ascii_digit() || c == '.'))
            .expect("an end");
        rest[..end].parse().expect("a number")
    }

    #[test]
    fn windows_lines_and_marks_stand_over_their_times() {
        let chart = chart();
        let svg = draw(&chart);
        let left = Place::of(&chart).left;
        let x = |time_s: f64| left + (time_s - 100.0) / 200.0 * 800.0;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 0.1, "{a} for {b}");
        near(
            after(&svg, "data-maneuver=\"f_t00150\"", "<rect x=\""),
            x(150.0),
        );
        near(
            after(&svg, "data-maneuver=\"f_t00150\"", " width=\""),
            x(160.0) - x(150.0),
        );
        near(
            after(&svg, "class=\"mark bridged\"", "<path d=\"M"),
            x(120.0),
        );
        near(
            after(&svg, "class=\"mark despiked\"", "<path d=\"M") + 4.0,
            x(140.0),
        );
        assert!(
            svg.contains(&format!("M{:.1} ", x(100.0)))
                && svg.contains(&format!("L{:.1} ", x(200.0)))
        );
        assert!(!svg.contains("class=\"mark missing\""));
    }

    #[test]
    fn the_chart_says_its_title_and_stays_well_formed_whatever_it_is() {
        let svg = draw(&chart());
        assert!(svg.contains("<title id=\"title\">flight &lt;1&gt;</title>"));
        assert!(svg.contains("two &amp; more</desc>"));
        assert_eq!(svg.matches("<g").count(), svg.matches("</g>").count());
        assert_eq!(svg.matches("<svg").count(), 1);
        assert!(!svg.contains("clip-path") && !svg.contains("NaN"));
    }

    #[test]
    fn labels_that_would_touch_are_pushed_apart_and_stay_inside() {
        assert_eq!(apart(&[10.0, 12.0, 50.0], 15.0, 100.0), [10.0, 25.0, 50.0]);
        assert_eq!(apart(&[90.0, 95.0, 99.0], 15.0, 100.0), [70.0, 85.0, 100.0]);
    }

    #[test]
    fn long_lines_are_broken_between_words() {
        let lines = wrapped(&["word ".repeat(60)], 400.0);
        assert!(
            lines.len() > 4 && lines.iter().all(|l| text_width(l) <= 400.0),
            "{lines:?}"
        );
    }
}
