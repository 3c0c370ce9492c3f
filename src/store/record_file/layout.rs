//! Layout of a record's file: names of columns and of metadata, sizes of groups and pages.

/// Suffix of a signal's column of flags.
pub(super) const MARK: &str = ":mark";

/// Metadata key of the flight's id.
pub(super) const FLIGHT: &str = "flight_id";

/// Metadata key of the time of the first sample, s.
pub(super) const START: &str = "start_s";

/// Metadata key of the step of the clock, s.
pub(super) const STEP: &str = "step_s";

/// Metadata key of the number of samples.
pub(super) const SAMPLES: &str = "samples";

/// Prefix of the metadata key of a constant signal.
pub(super) const CONSTANT: &str = "constant:";

/// Samples of a row group; the encoded signal stays in memory until its group is written.
pub const GROUP: usize = 1 << 19;

/// Samples of a page, which is decoded whole for any of its samples.
pub(super) const PAGE: usize = 1 << 11;
