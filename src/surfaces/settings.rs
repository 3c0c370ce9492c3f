//! Settings of the surfaces' delays.

use crate::ingest::compatibility::Action;
use crate::settings::settings;

settings! {
    /// Settings of the surfaces' delays. Each is one number for the whole campaign, since all flights
    /// have the same recorder.
    pub struct Settings {
        /// Delays of the surfaces: `apply` shifts surfaces whose delay is sure before the
        /// derivatives are estimated, `report` only publishes the delays. Either way, the
        /// remaining uncertainty of a delay is part of `bound_corrected`.
        pub delay: Action = Action::Apply,
        /// Smallest delay that is corrected, s. Recorders of ordinary quality have smaller delays.
        /// If the campaign does not determine a surface's delay, the delay is taken as zero. Its
        /// standard deviation is then this value, rounded up to the next step of the remaining
        /// uncertainties. Larger: fewer corrections, wider bounds.
        pub least_delay_s: f64 = 0.003,
        /// Size from which a delay is corrected, standard errors. Larger: fewer corrections.
        pub standard_errors: f64 = 4.0,
    }
}
