//! Signals of the operating system. When SIGTERM or SIGINT ends a run, the log gets a last line.
//! Writing a file above the shell's size limit returns an error.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::bars::CurrentItems;
use crate::store::Log;

/// Logs a signal that ends the program, with the stage and the flights in work, and lets it end the
/// program.
///
/// # Errors
/// The system refuses to report signals.
#[cfg(unix)]
pub fn log_signals(log: &Arc<Log>, work: &Arc<CurrentItems>) -> std::io::Result<()> {
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

/// Turns the signal for a file above the shell's size limit (`ulimit -f`) into a write error, like
/// that of a full disk. The signal would end the program.
///
/// # Errors
/// The system refuses to report signals.
#[cfg(unix)]
pub fn outlive_file_limits() -> std::io::Result<()> {
    let noted = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, noted).map(|_| ())
}

/// Other systems have no such signals.
#[cfg(not(unix))]
pub fn outlive_file_limits() -> std::io::Result<()> {
    Ok(())
}

/// Other systems have no such signals.
#[cfg(not(unix))]
pub fn log_signals(_: &Arc<Log>, _: &Arc<CurrentItems>) -> std::io::Result<()> {
    Ok(())
}
