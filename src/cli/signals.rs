//! A last line in the log when the system or a user ends a run: SIGTERM, SIGINT.

use std::sync::Arc;

use super::bars::Work;
use crate::store::Log;

/// Logs a signal that ends the program, with the stage and the flights in work, and lets it end the
/// program.
///
/// # Errors
/// The system refuses to report signals.
#[cfg(unix)]
pub fn log_signals(log: &Arc<Log>, work: &Arc<Work>) -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    let (log, work) = (Arc::clone(log), Arc::clone(work));
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let name = if signal == SIGINT {
                "SIGINT"
            } else {
                "SIGTERM"
            };
            log.write(
                "signal",
                &[
                    ("signal", name.into()),
                    ("stage", work.stage().into()),
                    ("in_work", work.items().into()),
                ],
            );
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
    Ok(())
}

/// Other systems have no such signals.
#[cfg(not(unix))]
pub fn log_signals(_: &Arc<Log>, _: &Arc<Work>) -> std::io::Result<()> {
    Ok(())
}
