//! Settings of compare: limits of agreement, and earlier campaigns.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::settings::settings;

settings! {
    /// Settings of the comparison with the wind tunnel and earlier campaigns.
    pub struct Settings {
        /// Derivatives whose tunnel values are not comparable with flight. Their rows have the verdict
        /// `no tunnel value`.
        pub not_comparable: BTreeSet<String> = BTreeSet::new(),
        /// Largest difference that counts as agreement, standard errors of the difference. Larger:
        /// more rows agree, and real differences go unreported.
        pub agreement_z: f64 = 2.0,
        /// Largest difference that counts as agreement at any standard error, percent of the
        /// tunnel's value. The default is about the repeatability of tunnel tests. Larger: more rows
        /// agree.
        pub agreement_pct: f64 = 5.0,
        /// Share of the information on a value that comes from flight, percent, below which the
        /// verdict is `nothing learnt`. Larger: more rows with this verdict.
        pub learnt_pct: f64 = 10.0,
        /// Largest number of rows of the table `disagreements`.
        pub worst: usize = 20,
        /// Folders with the published tables of earlier campaigns or nights. Each adds its trends to
        /// the comparison.
        pub against: Vec<PathBuf> = Vec::new(),
    }
}

impl Settings {
    pub(super) fn is_comparable(&self, derivative: &str) -> bool {
        !self.not_comparable.contains(derivative)
    }
}
