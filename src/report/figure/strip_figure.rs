//! Strips of the report: one or several columns over one time axis, as a drawing within the page.

use super::scale::Scale;
use super::strips::{Sizes, Strip, StripColumn, StripDrawing};
use super::svg_writer::{Alternative, SvgWriter};

/// A drawing of strips.
#[derive(Clone, Debug)]
pub struct StripFigure {
    /// Id, unique in the page.
    pub id: String,
    pub title: String,
    /// Alternative text.
    pub description: String,
    /// Width of the whole, in units of the drawing.
    pub width: f64,
    pub time: Scale,
    pub columns: Vec<Vec<Strip>>,
}

const SIZES: Sizes = Sizes::COMPACT;
/// Gap between columns.
const GAP: f64 = 22.0;
/// Space right of the last column, for half of its last tick label.
const EDGE: f64 = 8.0;

/// Draws the figure.
#[must_use]
pub fn draw(figure: &StripFigure) -> String {
    let columns = figure.columns.len().max(1) as f64;
    let width = (figure.width - EDGE - GAP * (columns - 1.0)) / columns;
    let mut drawing = StripDrawing::default();
    let mut height: f64 = 0.0;
    let mut left = 0.0;
    for strips in &figure.columns {
        let column = StripColumn {
            sizes: SIZES,
            names_left: left,
            left: left + SIZES.names_width(strips) + SIZES.tick_labels,
            right: left + width,
            time: figure.time,
        };
        column.draw(&mut drawing, strips, 0.0);
        height = height.max(SIZES.strips_height(strips) + SIZES.time_axis);
        left += width + GAP;
    }
    let mut svg = SvgWriter::default();
    drawing.write(&mut svg);
    let alternative = Alternative {
        id: &figure.id,
        title: &figure.title,
        description: &figure.description,
    };
    svg.inline((figure.width, height), SIZES.text, alternative)
}

#[cfg(test)]
mod tests {
    use super::super::strips::StripLine;
    use super::*;

    fn figure() -> StripFigure {
        let scale = Scale {
            min: -1.0,
            max: 1.0,
            step: 1.0,
        };
        let points = (0..20)
            .map(|i| (f64::from(i) * 0.5, (f64::from(i) * 0.7).sin()))
            .collect();
        let lines = vec![StripLine::ink(points, 1.0)];
        let strip = Strip {
            dots: vec![(2.0, 5.0)],
            attributes: vec![("data-class", "c1".into())],
            ..Strip::of_lines("q <x>", "deg/s", 40.0, scale, lines)
        };
        StripFigure {
            id: "s1".into(),
            title: "rates".into(),
            description: "a & b".into(),
            width: 400.0,
            time: Scale {
                min: 0.0,
                max: 10.0,
                step: 5.0,
            },
            columns: vec![vec![strip.clone(), strip.clone()], vec![strip]],
        }
    }

    #[test]
    fn a_strip_figure_is_well_formed_and_has_alternative_text() {
        let svg = draw(&figure());
        let document = roxmltree::Document::parse(&svg).expect("well-formed");
        let texts: Vec<&str> = document
            .root_element()
            .children()
            .filter_map(|n| n.text())
            .take(2)
            .collect();
        assert_eq!(texts, ["rates", "a & b"]);
        assert_eq!(
            svg.matches("time, s").count(),
            2,
            "each column has its axis"
        );
        assert_eq!(svg.matches(r#"<g data-class="c1">"#).count(), 3);
    }

    #[test]
    fn everything_alike_is_one_path_however_many_strips() {
        let mut figure = figure();
        for strip in figure.columns.iter_mut().flatten() {
            strip.attributes.clear();
        }
        let paths = |figure: &StripFigure| draw(figure).matches("<path").count();
        assert_eq!(paths(&figure), 4, "grid, lines, dots and frames");
        let more = figure.columns[0].clone();
        figure.columns[1].extend(more);
        assert_eq!(paths(&figure), 4);
    }
}
