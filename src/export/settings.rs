//! Settings of the export.

use std::collections::BTreeMap;

use crate::settings::settings;

settings! {
    /// Settings of the export.
    pub struct Settings {
        /// Author of the model in the DAVE-ML file, which requires one.
        pub author: String = "not stated".into(),
        /// Organisation of the author.
        pub organisation: String = "not stated".into(),
        /// Date of the model in the DAVE-ML file, ISO 8601: `2026-11-21`. No clock sets it, so that
        /// the same input gives the same bytes.
        pub date: String = "not stated".into(),
        /// JSBSim's property for a signal of model.yaml, in the signal's unit and sign. Signals that
        /// are not named read `harvest/<signal>`.
        pub jsbsim_properties: BTreeMap<String, String> = BTreeMap::new(),
    }
}
