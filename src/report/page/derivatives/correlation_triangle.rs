//! Correlations between regressors in a representative maneuver of each class, as a shaded
//! triangle.
//!
//! The paper's Figures 3, 10 and 11 show the same by time histories.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::report::contents::{Contents, group_by};
use crate::report::history;
use crate::report::notation::{DASH, angle, fixed, without_unit};
use crate::tables::{CorrelationKind, CorrelationRow, History};

/// Correlations of one maneuver below the diagonal: a row per regressor but the first, a column per
/// regressor but the last.
#[derive(Clone, Debug, Serialize)]
pub struct CorrelationTriangle {
    pub class: String,
    pub maneuver_id: String,
    pub alpha: String,
    pub heads: Vec<String>,
    pub rows: Vec<TriangleRow>,
}

/// Correlations of one regressor with those before it.
#[derive(Clone, Debug, Serialize)]
pub struct TriangleRow {
    pub name: String,
    pub cells: Vec<TriangleCell>,
}

/// A correlation with the shade of its cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TriangleCell {
    pub text: String,
    /// `weak` above 0.3, `fair` above 0.5, `strong` above 0.7, `flagged` above the limit, else
    /// empty.
    pub shade: &'static str,
}

/// One triangle per class in the configured order, of the representative maneuver.
#[must_use]
pub fn triangles(contents: &Contents) -> Vec<CorrelationTriangle> {
    let by_maneuver = group_by(contents.correlations, |r| &r.maneuver_id);
    history::representatives(contents)
        .into_iter()
        .filter_map(|history| {
            let pairs: Vec<&CorrelationRow> = by_maneuver
                .get(history.maneuver_id.as_str())?
                .iter()
                .copied()
                .filter(|pair| pair.kind == CorrelationKind::Regressors)
                .collect();
            (!pairs.is_empty()).then(|| triangle(history, &pairs, contents.limits.correlation))
        })
        .collect()
}

fn triangle(history: &History, pairs: &[&CorrelationRow], limit: f64) -> CorrelationTriangle {
    let names = regressors(pairs);
    let mut correlations: BTreeMap<(&str, &str), f64> = BTreeMap::new();
    for pair in pairs {
        correlations.insert((&pair.first, &pair.second), pair.correlation);
    }
    let between = |a, b| {
        let forward = correlations.get(&(a, b));
        forward.or_else(|| correlations.get(&(b, a))).copied()
    };
    let rows = names
        .iter()
        .enumerate()
        .skip(1)
        .map(|(i, name)| TriangleRow {
            name: without_unit(name).to_owned(),
            cells: names
                .iter()
                .take(i)
                .map(|earlier| cell(between(earlier, name), limit))
                .collect(),
        })
        .collect();
    CorrelationTriangle {
        class: history.class.clone(),
        maneuver_id: history.maneuver_id.clone(),
        alpha: angle(history.alpha_deg),
        heads: names
            .iter()
            .take(names.len().saturating_sub(1))
            .map(|name| without_unit(name).to_owned())
            .collect(),
        rows,
    }
}

/// Names of the regressors in the order of the model.
///
/// A pair names the earlier regressor first, so the order of appearance is that of the model.
fn regressors<'a>(pairs: &[&'a CorrelationRow]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    let first = pairs.iter().map(|p| p.first.as_str());
    let second = pairs.iter().map(|p| p.second.as_str());
    for name in first.chain(second) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn cell(correlation: Option<f64>, limit: f64) -> TriangleCell {
    let Some(correlation) = correlation else {
        return TriangleCell {
            text: DASH.to_owned(),
            shade: "",
        };
    };
    let shade = match correlation.abs() {
        size if size > limit => "flagged",
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
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn the_triangle_has_each_pair_once_and_shades_flagged_ones() {
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
                kind: CorrelationKind::Regressors,
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
