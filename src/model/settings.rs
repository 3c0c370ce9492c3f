//! Settings of the campaign's posterior.

use crate::settings::settings;

settings! {
    /// Settings of the campaign's posterior: tunnel and flight as one answer.
    pub struct Settings {
        /// Widest gap of the angles of attack at which the difference from the tunnel is unknown,
        /// deg; it is linear between them. The tunnel's breakpoints are among them. Smaller: finer
        /// tables, and a run that takes longer.
        pub alpha_step_deg: f64 = 1.25,
    }
    expert {
        /// Angle of attack over which a derivative's difference from the tunnel changes, deg: centre
        /// of its prior. Flight decides for each derivative.
        pub length_deg: f64 = 15.0,
        /// Error that all maneuvers of a class share beyond the errors that are modelled, in bounds
        /// of one maneuver. Larger: repeats of a class weigh less.
        pub class_error: f64 = 0.5,
        /// Degrees of freedom of the distribution of a maneuver's errors. Smaller: a maneuver that
        /// the others contradict weighs less.
        pub degrees_of_freedom: f64 = 4.0,
    }
    elsewhere {
        /// Standard uncertainty of a tunnel value that states none, percent of the root mean square
        /// of its table: `estimate: held_uncertainty_pct`.
        pub tunnel_uncertainty_pct: f64 = 20.0,
    }
}
