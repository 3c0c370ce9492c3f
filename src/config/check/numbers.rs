//! Checks of single numbers of a file.

use crate::config::source::Source;
use crate::error::Result;

/// Refuses a number under a key that is not finite and greater than zero.
pub(super) fn positive(source: &Source, key: &str, name: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    let what = format!("`{name}` must be greater than zero, not {value}");
    Err(source.error_under(key, name, what))
}

/// Refuses a number under a key that is negative; infinity is a limit that nothing exceeds.
pub(super) fn not_negative(source: &Source, key: &str, name: &str, value: f64) -> Result<()> {
    if value >= 0.0 {
        return Ok(());
    }
    let what = format!("`{name}` must not be negative, not {value}");
    Err(source.error_under(key, name, what))
}
