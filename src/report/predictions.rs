//! How well maneuvers are predicted with the derivatives of others: per class and output the
//! medians, and the worst named.

use super::Contents;
use super::failures::TableView;
use super::notation::{NOTHING, fixed, number};
use super::scale::quantile;
use crate::tables::PredictionRow;

const NOTE: &str = "Each maneuver is predicted with derivatives estimated from the others of its class and angle of attack; \
    its biases and initial states are its own, and so are, unless the configuration shares them, its constants. Theil's U is \
    0 for a perfect prediction and 1 for none. Of the squared difference, bias is the share of a wrong mean and variance that \
    of a wrong size; the rest is wrong in shape, or noise. R² is the share of the measured variance that is predicted: \
    negative where a constant would have done better, and low where the maneuver hardly moved the output.";

/// The table; none where nothing was predicted.
#[must_use]
pub fn table(contents: &Contents) -> Option<TableView> {
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for (class, _, _) in contents.classes {
        for row in contents.predictions.iter().filter(|p| p.class == *class) {
            if !kinds.contains(&(&row.class, &row.output)) {
                kinds.push((&row.class, &row.output));
            }
        }
    }
    let of = |class: &str, output: &str| {
        contents
            .predictions
            .iter()
            .filter(|p| p.class == class && p.output == output)
            .collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = kinds
        .iter()
        .map(|(class, output)| row(&of(class, output)))
        .collect();
    let heads = [
        "class",
        "output",
        "maneuvers",
        "median U",
        "bias",
        "variance",
        "median R²",
        "largest U",
        "by",
    ];
    (!rows.is_empty()).then(|| TableView::new("Class and output", NOTE, &heads, rows))
}

fn row(predictions: &[&PredictionRow]) -> Vec<String> {
    let median = |value: fn(&PredictionRow) -> Option<f64>| {
        quantile(
            &predictions
                .iter()
                .filter_map(|p| value(p))
                .collect::<Vec<_>>(),
            0.5,
        )
    };
    let percent = |share: Option<f64>| {
        share.map_or_else(
            || NOTHING.to_owned(),
            |s| format!("{} %", fixed(100.0 * s, 0)),
        )
    };
    let with_theil = predictions.iter().filter_map(|p| Some((p.theil?, p)));
    let worst = with_theil.max_by(|a, b| a.0.total_cmp(&b.0));
    vec![
        predictions
            .first()
            .map_or_else(String::new, |p| p.class.clone()),
        predictions
            .first()
            .map_or_else(String::new, |p| p.output.clone()),
        predictions.len().to_string(),
        number(median(|p| p.theil), 2),
        percent(median(|p| p.theil_bias)),
        percent(median(|p| p.theil_variance)),
        median(|p| p.r_squared).map_or_else(|| NOTHING.to_owned(), |r| fixed(r, 3)),
        number(worst.map(|(u, _)| u), 2),
        worst.map_or_else(String::new, |(_, p)| {
            format!("{} (α {}°)", p.maneuver_id, fixed(p.alpha_deg, 0))
        }),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    fn prediction(maneuver: &str, theil: f64, r_squared: f64) -> PredictionRow {
        PredictionRow {
            maneuver_id: maneuver.into(),
            class: "OLON".into(),
            alpha_deg: 20.0,
            output: "q".into(),
            unit: "deg/s".into(),
            samples: 100,
            root_mean_square: 0.1,
            theil: Some(theil),
            theil_bias: Some(0.1),
            theil_variance: Some(0.2),
            theil_covariance: Some(0.7),
            r_squared: Some(r_squared),
        }
    }

    #[test]
    fn the_median_and_the_worst_maneuver_stand_in_the_row_of_their_output() {
        let mut campaign = samples::campaign();
        assert!(table(&campaign.contents()).is_none());
        for (maneuver, theil, r) in [("m1", 0.02, 0.99), ("m2", 0.3, 0.5), ("m3", 0.04, 0.98)] {
            campaign.predictions.push(prediction(maneuver, theil, r));
        }
        let table = table(&campaign.contents()).unwrap();
        let expected = [
            "OLON",
            "q",
            "3",
            "0.040",
            "10 %",
            "20 %",
            "0.980",
            "0.30",
            "m2 (α 20°)",
        ];
        assert_eq!(table.rows, [expected.map(str::to_owned).to_vec()]);
        let page = super::super::html(&campaign.contents(), None).unwrap();
        assert!(page.contains("Prediction of data not used") && page.contains("m2 (α 20°)"));
    }
}
