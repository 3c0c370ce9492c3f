//! Which regressors moved together in a typical maneuver of each class: what the paper's Figures 3,
//! 10 and 11 show by time histories, as a shaded triangle of correlations.

use std::collections::BTreeMap;

use serde::Serialize;

use super::notation::{NOTHING, angle, fixed, without_unit};
use super::subject::by_name;
use super::{Contents, histories};
use crate::tables::{CorrelationRow, History};

/// The correlations of one maneuver, below the diagonal: a row per regressor but the first, a
/// column per one but the last.
#[derive(Clone, Debug, Serialize)]
pub struct TriangleView {
    pub class: String,
    pub maneuver_id: String,
    pub alpha: String,
    pub heads: Vec<String>,
    pub rows: Vec<TriangleRow>,
}

/// One regressor against those before it.
#[derive(Clone, Debug, Serialize)]
pub struct TriangleRow {
    pub name: String,
    pub cells: Vec<TriangleCell>,
}

/// A correlation with its shade: `weak`, `fair`, `strong` or `flagged`, or nothing below 0.3.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TriangleCell {
    pub text: String,
    pub shade: &'static str,
}

/// One maneuver of each class in the configured order: the one whose time history the report shows.
#[must_use]
pub fn triangles(contents: &Contents) -> Vec<TriangleView> {
    let of_maneuver = by_name(contents.correlations, |r| &r.maneuver_id);
    let view = |history: &History| {
        let mut pairs = of_maneuver.get(history.maneuver_id.as_str())?.clone();
        pairs.retain(|pair| pair.kind == "regressors");
        let alpha = angle(history.alpha_deg);
        (!pairs.is_empty())
            .then(|| triangle(&history.class, alpha, &pairs, contents.limits.correlation))
    };
    histories::typical(contents)
        .into_iter()
        .filter_map(view)
        .collect()
}

fn triangle(class: &str, alpha: String, pairs: &[&CorrelationRow], flag: f64) -> TriangleView {
    // In the order of the model: a pair names the earlier one first, so the names in order of
    // appearance are that order.
    let mut names: Vec<&str> = Vec::new();
    for name in pairs
        .iter()
        .map(|p| &p.first)
        .chain(pairs.iter().map(|p| &p.second))
    {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let by_pair: BTreeMap<(&str, &str), f64> = pairs
        .iter()
        .map(|p| ((p.first.as_str(), p.second.as_str()), p.correlation))
        .collect();
    let of = |a: &str, b: &str| {
        by_pair
            .get(&(a, b))
            .or_else(|| by_pair.get(&(b, a)))
            .copied()
    };
    let row = |(i, name): (usize, &&str)| TriangleRow {
        name: without_unit(name).to_owned(),
        cells: names
            .iter()
            .take(i)
            .map(|other| cell(of(other, name), flag))
            .collect(),
    };
    TriangleView {
        class: class.to_owned(),
        maneuver_id: pairs
            .first()
            .map_or_else(String::new, |p| p.maneuver_id.clone()),
        alpha,
        heads: names
            .iter()
            .take(names.len().saturating_sub(1))
            .map(|n| without_unit(n).to_owned())
            .collect(),
        rows: names.iter().enumerate().skip(1).map(row).collect(),
    }
}

fn cell(correlation: Option<f64>, flag: f64) -> TriangleCell {
    let Some(correlation) = correlation else {
        return TriangleCell {
            text: NOTHING.to_owned(),
            shade: "",
        };
    };
    let shade = match correlation.abs() {
        size if size > flag => "flagged",
        size if size > 0.7 => "strong",
        size if size > 0.5 => "fair",
        size if size > 0.3 => "weak",
        _ => "",
    };
    TriangleCell {
        text: fixed(correlation, 2),
        shade,
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::campaign;
    use super::*;

    #[test]
    fn the_triangle_has_each_pair_once_and_shades_what_is_flagged() {
        let mut campaign = campaign();
        let shown = triangles(&campaign.contents());
        assert!(shown.is_empty(), "nothing is correlated yet");
        for (first, second, correlation) in [
            ("alpha", "de_deg", -0.95),
            ("alpha", "dpv_deg", 0.6),
            ("de_deg", "dpv_deg", 0.1),
        ] {
            campaign.correlations.push(CorrelationRow {
                maneuver_id: "1-OLON-30".into(),
                class: "OLON".into(),
                kind: "regressors".into(),
                first: first.into(),
                second: second.into(),
                correlation,
            });
        }
        let views = triangles(&campaign.contents());
        assert_eq!(views.len(), 1);
        assert_eq!(
            (views[0].class.as_str(), views[0].alpha.as_str()),
            ("OLON", "30°")
        );
        assert_eq!(views[0].heads, ["alpha", "de"]);
        let cell = |text: &str, shade| TriangleCell {
            text: text.into(),
            shade,
        };
        let rows: Vec<_> = views[0]
            .rows
            .iter()
            .map(|r| (r.name.as_str(), r.cells.clone()))
            .collect();
        let (de, dpv) = (
            vec![cell("\u{2212}0.95", "flagged")],
            vec![cell("0.60", "fair"), cell("0.10", "")],
        );
        assert_eq!(rows, [("de", de), ("dpv", dpv)]);
    }
}
