//! The stages of a campaign, in order.

use crate::schema::words;

words! {
    /// Stage of a run, in order.
    pub enum Stage default Ingest {
        /// Flights to records.
        Ingest = "ingest",
        /// Records to maneuvers.
        Segment = "segment",
        /// Maneuvers to derivatives.
        Estimate = "estimate",
        /// Tunnel and derivatives to the posterior.
        Model = "model",
        /// Derivatives to trends across angle of attack.
        Trend = "trend",
        /// Posterior to the modes of the aircraft and their levels.
        Qualities = "qualities",
        /// Maneuvers flown again by simulators.
        Match = "match",
        /// Trends against the tunnel and earlier campaigns.
        Compare = "compare",
        /// The report.
        Report = "report",
    }
}
