//! Progress of a long command.

/// Receiver of progress: a terminal, a log, or nothing.
pub trait Progress: Sync {
    /// Opens a stage of this many items.
    fn begin(&self, stage: &str, items: usize);
    /// Reports an item that begins now and may take long.
    fn start(&self, item: &str);
    /// Counts a finished item.
    fn advance(&self, item: &str);
    /// Closes the stage.
    fn end(&self);
}
