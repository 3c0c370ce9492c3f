//! Quality of prediction by class and output: medians, and the maneuver predicted worst.

use crate::aero::Output;
use crate::numerics::statistics::order_statistics::quantile;
use crate::report::contents::Contents;
use crate::report::notation::{DASH, fixed, number};
use crate::report::table_view::TableView;
use crate::tables::AgreementRow;

const NOTE: &str = "Cross-validation: each maneuver is predicted with derivatives estimated from \
    the other maneuvers of its class and angle of attack. Biases and initial states are its own, \
    and so are its constants unless the configuration shares them. Theil's U is 0 for a perfect \
    prediction and 1 for none. Of the squared difference, bias is the share of a wrong mean and \
    variance that of a wrong size; the rest is wrong in shape, or noise. R² is the share of the \
    measured variance that is predicted: negative if a constant would have done better, and low if \
    the maneuver hardly moved the output.";

const HEADS: [&str; 9] = [
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

/// A row per class and output; `None` if nothing was predicted.
#[must_use]
pub fn table(contents: &Contents) -> Option<TableView> {
    let mut rows = Vec::new();
    for class in contents.classes {
        let mut by_output: Vec<(Output, Vec<&AgreementRow>)> = Vec::new();
        for row in contents
            .predictions
            .iter()
            .filter(|p| p.class == class.name)
        {
            match by_output.iter_mut().find(|o| o.0 == row.output) {
                Some(output) => output.1.push(row),
                None => by_output.push((row.output, vec![row])),
            }
        }
        for (output, predictions) in by_output {
            rows.push(cells(&class.name, output, &predictions));
        }
    }
    (!rows.is_empty()).then(|| TableView::new("Class and output", NOTE, &HEADS, rows))
}

fn cells(class: &str, output: Output, predictions: &[&AgreementRow]) -> Vec<String> {
    let worst = predictions
        .iter()
        .filter_map(|p| Some((p.theil?, p)))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    vec![
        class.to_owned(),
        output.to_string(),
        predictions.len().to_string(),
        number(median(predictions, |p| p.theil), 2),
        percent(median(predictions, |p| p.theil_bias)),
        percent(median(predictions, |p| p.theil_variance)),
        median(predictions, |p| p.r_squared).map_or_else(|| DASH.to_owned(), |r| fixed(r, 3)),
        number(worst.map(|(u, _)| u), 2),
        worst.map_or_else(String::new, |(_, p)| {
            format!("{} (α {}°)", p.maneuver_id, fixed(p.alpha_deg, 0))
        }),
    ]
}

fn median(predictions: &[&AgreementRow], value: fn(&AgreementRow) -> Option<f64>) -> Option<f64> {
    quantile(predictions.iter().filter_map(|p| value(p)), 0.5)
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| DASH.to_owned(), |s| format!("{} %", fixed(100.0 * s, 0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture;

    fn prediction(maneuver: &str, theil: f64, r_squared: f64) -> AgreementRow {
        AgreementRow {
            maneuver_id: maneuver.into(),
            class: "OLON".into(),
            alpha_deg: 20.0,
            output: Output::Q,
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
    fn a_row_has_the_median_and_the_worst_maneuver_of_its_output() {
        let mut campaign = campaign_fixture::campaign();
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
        let page = crate::report::html(&campaign.contents(), None).unwrap();
        assert!(page.contains("Cross-validation") && page.contains("m2 (α 20°)"));
    }
}
