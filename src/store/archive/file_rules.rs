//! Rules for the files of an archive: names that are no flights, the message for unreadable files.

/// `true` for a name that other programs reserve for temporary files.
pub(super) fn is_hidden(name: &str) -> bool {
    name.starts_with(['.', '_'])
}

/// Message for a file that the Parquet reader rejects.
pub(super) fn unreadable(e: &dyn std::fmt::Display) -> String {
    format!("not a readable Parquet file (truncated, or another format?): {e}")
}
