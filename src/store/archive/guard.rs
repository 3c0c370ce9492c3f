//! Guard around the Parquet reader: its panic is a fault of the file.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// `true` while this thread reads a file whose panic is not printed.
    static READING: Cell<bool> = const { Cell::new(false) };
}

/// Runs the Parquet reader and treats its panic as a fault of the file. The panic is not printed:
/// its reason becomes a problem.
pub(in crate::store) fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !READING.get() {
                before(info);
            }
        }));
    });
    let outside = READING.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(read));
    READING.set(outside);
    result.unwrap_or_else(|_| {
        Err("the Parquet reader failed on its bytes; copy it again from its source".to_owned())
    })
}
