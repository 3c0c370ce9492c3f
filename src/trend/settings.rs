//! Settings of trend: order, criterion, grid, and the groups of classes.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::settings::{elements, settings, single_values};

settings! {
    /// Settings of the trends across angle of attack.
    pub struct Settings {
        /// Criterion that chooses the order of a trend's polynomial or spline: `aicc`, Akaike's
        /// with the correction for few data, or `bic`, Schwarz's. `bic` chooses lower orders, so
        /// trends become smoother and their standard errors smaller.
        pub criterion: Criterion = Criterion::default(),
        /// Highest order of the polynomial. Lower: smoother trends that may miss the bends of
        /// derivatives through stall. There are never more coefficients than flown angles of
        /// attack.
        pub max_order: usize = 10,
        /// Spacing of the angles of attack at which trends are published, deg. It changes the rows
        /// of the tables, not the fitted trends.
        pub alpha_step_deg: f64 = 5.0,
        /// Angles of attack at which trends may bend sharply, deg. With knots a trend is a spline of
        /// up to third order, or a polynomial of up to third order where that fits better. Without,
        /// it is a polynomial, or a spline between the flown angles of attack.
        pub knots_deg: Vec<f64> = Vec::new(),
        /// Distance from its trend beyond which a maneuver is listed in the table `outliers`,
        /// standard deviations. It changes that table only: the fit limits the influence of any
        /// maneuver beyond 1.5.
        pub outlier_z: f64 = 3.0,
        /// Classes whose maneuvers make the trend of each derivative. The first group that names a
        /// derivative, or that names none, is used. Other classes then have trends of their own only.
        pub groups: Vec<TrendGroup> = vec![TrendGroup {
            name: "all".into(),
            ..TrendGroup::default()
        }],
    }
    expert {
        /// Distance beyond the outermost maneuver within which a trend is still published, deg. At 0
        /// a maneuver flown for 60 deg with a mean of 59.8 deg loses the row at 60 deg.
        pub alpha_reach_deg: f64 = 0.5,
        /// Trends of single classes beside the groups' trends. `false` removes their rows.
        pub per_class: bool = true,
        /// Names without a trend, for instance sensor biases. The named ones lose their rows.
        pub leave_out: BTreeSet<String> = BTreeSet::new(),
    }
}

settings! {
    /// Classes that make the trends of some derivatives.
    pub struct TrendGroup {
        /// Name of the group, as the tables have it.
        pub name: String,
        /// Derivatives of the group; without any, all that no group before it names.
        #[serde(default)]
        pub derivatives: Vec<String>,
        /// Classes of the group; without any, all classes.
        #[serde(default)]
        pub classes: Vec<String>,
        /// Knots of the group's trends, deg, in place of `knots_deg` of all trends.
        #[serde(default)]
        pub knots_deg: Option<Vec<f64>>,
    }
}
elements!(Vec<TrendGroup>: TrendGroup as "[]");
single_values!(Criterion);

/// Criterion for the order of a trend. Both weigh the misfit against the number of coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Akaike's criterion with the correction for few data.
    #[default]
    Aicc,
    /// The Bayesian criterion of Schwarz.
    Bic,
}

impl Settings {
    /// The group of a derivative; `None` if no group names it and none takes the rest.
    #[must_use]
    pub fn group_of(&self, derivative: &str) -> Option<&TrendGroup> {
        let names = |g: &&TrendGroup| g.derivatives.iter().any(|d| d == derivative);
        let rest = |g: &&TrendGroup| g.derivatives.is_empty();
        self.groups
            .iter()
            .find(names)
            .or_else(|| self.groups.iter().find(rest))
    }
}

impl TrendGroup {
    #[must_use]
    pub fn has(&self, class: &str) -> bool {
        self.classes.is_empty() || self.classes.iter().any(|c| c == class)
    }
}
