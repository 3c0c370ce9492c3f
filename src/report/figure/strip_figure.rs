//! Strips of the report: one or several columns over one time axis, as a drawing within the page.

use super::scale::Scale;
use super::strip::{Sizes, Strip};
use super::strip_renderer::{StripColumn, StripDrawing};
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

/// Divides groups of strips into two columns of about equal height, in their order. Strips of a group stay together.
#[must_use]
pub fn in_two_columns(groups: Vec<Vec<Strip>>) -> Vec<Vec<Strip>> {
    let heights: Vec<f64> = groups.iter().map(|g| SIZES.strips_height(g)).collect();
    let higher = |first: usize| {
        let (left, right) = heights.split_at(first);
        left.iter().sum::<f64>().max(right.iter().sum())
    };
    let first = (1..=groups.len()).min_by(|a, b| higher(*a).total_cmp(&higher(*b)));
    let mut groups = groups.into_iter();
    let left: Vec<Strip> = groups.by_ref().take(first.unwrap_or(0)).flatten().collect();
    let columns = [left, groups.flatten().collect()];
    columns.into_iter().filter(|c| !c.is_empty()).collect()
}

/// Columns of strips without groups: three strips side by side, others in two columns.
#[must_use]
pub fn side_by_side(strips: Vec<Strip>) -> Vec<Vec<Strip>> {
    let groups: Vec<Vec<Strip>> = strips.into_iter().map(|strip| vec![strip]).collect();
    if groups.len() == 3 {
        groups
    } else {
        in_two_columns(groups)
    }
}

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
    use super::super::strip::StripLine;
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
    fn columns_are_of_about_equal_height_and_groups_stay_together() {
        let strip =
            |name: &str, height: f64| Strip::of_lines(name, "", height, figure().time, vec![]);
        let groups = vec![
            vec![strip("a", 50.0), strip("residual", 20.0)],
            vec![strip("b", 50.0), strip("residual", 20.0)],
            vec![strip("input", 40.0)],
            vec![strip("input", 40.0)],
        ];
        let columns = in_two_columns(groups);
        let names = |column: &Vec<Strip>| {
            let names = column.iter().map(|s| s.name.clone());
            names.collect::<Vec<_>>()
        };
        assert_eq!(names(&columns[0]), ["a", "residual", "b", "residual"]);
        assert_eq!(names(&columns[1]), ["input", "input"]);
        assert_eq!(in_two_columns(vec![vec![strip("a", 50.0)]]).len(), 1);
        assert!(in_two_columns(vec![]).is_empty());
        let columns = |n: usize| side_by_side(vec![strip("a", 50.0); n]).len();
        assert_eq!([1, 2, 3, 4].map(columns), [1, 2, 3, 2]);
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
