//! Colours and font of all figures.

pub const FONT: &str = "Helvetica, Arial, Liberation Sans, sans-serif";

/// Colour of flight results: the trend and the computed response.
pub const INK: &str = "#111111";
/// Colour of secondary text and thin lines.
pub const FAINT: &str = "#555555";
pub const TUNNEL_COLOUR: &str = "#a50026";
/// Colour of measured signals: pale, so that the computed response is seen over them.
pub const MEASURED_COLOUR: &str = "#4f9bd9";
/// Colour of samples that are excluded from the cost or flagged by ingest.
pub const EXCLUDED_COLOUR: &str = "#c44e00";

/// Colours of a tolerance: its area and its limits, dark enough for paper.
pub const TOLERANCE_AREA: &str = "#e9edf1";
pub const TOLERANCE_LIMIT: &str = "#8a949e";

/// Colour of times outside a tolerance.
pub const OUTSIDE_COLOUR: &str = "#a50026";

/// Dark colours of lines and markers, which also differ in lightness.
pub const DARK_COLOURS: [&str; 6] = [
    "#111111", "#0060a8", "#b34700", "#6a2c91", "#00664b", "#7a5200",
];
