//! Tables of cross-validation: each maneuver predicted with the derivatives of others.

use std::collections::BTreeMap;

use crate::aero::{Axis, Output};
use crate::schema::{Cells, Column, Declared, Field, table, words};

table! {
    /// Columns of `fits` about the prediction of the maneuver from others.
    #[derive(Default)]
    pub struct PredictedRow {
        /// Status of the prediction; none for maneuvers estimated together.
        pub prediction: Option<PredictionStatus>,
        /// Number of maneuvers from which it was predicted: same class, converged, mean α within
        /// 2.5° (`alpha_distance_deg`).
        pub predicted_from: Option<usize> ["maneuvers"],
        /// Cost J of eq. 1.2 of the prediction by output error, also where filter error follows, to be
        /// compared with `final_cost`. None where output error does not converge.
        pub predicted_cost: Option<f64> ["1"],
        /// Theil's inequality coefficient over all outputs, weighted as in the cost of output error:
        /// 0 perfect, 1 no relation.
        pub theil: Option<f64> ["1"],
        /// Share of Theil's coefficient from a wrong mean.
        pub theil_bias: Option<f64> ["1"],
        /// Share of Theil's coefficient from a wrong size.
        pub theil_variance: Option<f64> ["1"],
        /// Share of Theil's coefficient from a wrong shape or noise; the three shares add up to one.
        pub theil_covariance: Option<f64> ["1"],
        /// Theil's coefficient of the output; empty for outputs of the other axis.
        pub theil_of: BTreeMap<Output, f64> ["1"],
        /// Share of the output's measured variance that is predicted; negative where a constant
        /// would do better.
        pub r_squared_of: BTreeMap<Output, f64> ["1"],
    }
}

words! {
    /// Status of a maneuver's prediction from others.
    pub enum PredictionStatus {
        /// The maneuver was predicted.
        Predicted = "predicted",
    }
    or text {
        /// The reason why it was not predicted.
        NotPredicted
    }
}

/// One column per output of both axes: the field `theil_of` is the columns `theil_alpha`, …
impl Field for BTreeMap<Output, f64> {
    fn columns<'a>(declared: Declared, fields: &[&'a Self]) -> Vec<Column<'a>> {
        let prefix = declared.name.trim_end_matches("_of");
        let column = |output: Output| Column {
            name: format!("{prefix}_{output}"),
            unit: declared.unit,
            meaning: declared.meaning,
            words: &[],
            cells: Cells::Number(
                fields
                    .iter()
                    .map(|of| of.get(&output).copied().filter(|value| value.is_finite()))
                    .collect(),
            ),
        };
        let outputs = [Axis::Longitudinal, Axis::Lateral]
            .into_iter()
            .flat_map(Axis::outputs);
        outputs.map(column).collect()
    }
}

table! {
    /// Predictions of converged maneuvers, by output.
    ///
    /// A maneuver is predicted with the mean of the derivatives of the others of its class and α,
    /// weighted by their corrected covariances. With `hold: evidence` the mean has all derivatives
    /// that some other estimates; the tunnel gives the rest. Biases and initial states are fitted
    /// again to the maneuver, with the derivatives fixed. So are constants unless `share_constants`
    /// is set, because they absorb the zero errors of the flight's vanes and surfaces.
    ///
    /// Filter error fits these where it estimated the maneuver, with the noise of the maneuver's
    /// own fit. The computed outputs are defined as in the table `fit_outputs`, so that the two can
    /// be compared: the angle of the air follows the vane, and nothing else follows the
    /// measurements.
    pub struct AgreementRow in "predictions" per "predicted maneuver and output" {
        /// Maneuver.
        pub maneuver_id: String,
        /// Class of the maneuver.
        pub class: String,
        /// Mean angle of attack of the maneuver.
        pub alpha_deg: f64 ["deg"],
        /// Output of the equations.
        pub output: Output,
        /// Unit of the output.
        pub unit: String,
        /// Number of samples that count.
        pub samples: usize ["samples"],
        /// Root mean square of measured minus computed, in the column `unit`.
        pub root_mean_square: f64,
        /// √(Σ(y−z)²/n) / (√(Σz²/n) + √(Σy²/n)), with z measured and y computed. It is small for
        /// an output with a large mean, such as α: `r_squared` does not depend on the mean.
        pub theil: Option<f64> ["1"],
        /// Share (ȳ−z̄)² of the mean square difference.
        pub theil_bias: Option<f64> ["1"],
        /// Share (σ_y−σ_z)² of the mean square difference.
        pub theil_variance: Option<f64> ["1"],
        /// Share 2(1−ρ)σ_yσ_z of the mean square difference.
        pub theil_covariance: Option<f64> ["1"],
        /// 1 − Σ(z−y)² / Σ(z−z̄)²; low where the maneuver hardly moves the output.
        pub r_squared: Option<f64> ["1"],
    }
}
