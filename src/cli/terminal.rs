//! Output on the terminal. A failed write (closed pipe, full disk) does not stop a command; the
//! first failure decides the exit code at the end.

use std::fmt::Arguments;
use std::io::{Error, ErrorKind, Write};
use std::process::ExitCode;
use std::sync::Mutex;

/// First failure to write the output.
static FAILURE: Mutex<Option<Error>> = Mutex::new(None);

/// Prints a line of output.
macro_rules! out {
    ($($text:tt)*) => { $crate::cli::terminal::print(format_args!("{}\n", format_args!($($text)*))) };
}

/// Prints output as it is, without an end of line.
macro_rules! out_text {
    ($($text:tt)*) => { $crate::cli::terminal::print(format_args!($($text)*)) };
}

/// Prints a line of error output.
macro_rules! err {
    ($($text:tt)*) => { $crate::cli::terminal::print_error(format_args!("{}\n", format_args!($($text)*))) };
}

pub fn print(text: Arguments) {
    note(std::io::stdout().write_all(visible(text).as_bytes()));
}

/// A failure to print an error leaves nowhere to report it.
pub fn print_error(text: Arguments) {
    let _ = std::io::stderr().write_all(visible(text).as_bytes());
}

/// Text with its control characters as escapes. Names of files may contain characters that control
/// a terminal.
fn visible(text: Arguments) -> String {
    let is_obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    let text = text.to_string();
    if !text.contains(is_obeyed) {
        return text;
    }
    let escaped = |c: char| match c {
        c if is_obeyed(c) => c.escape_default().to_string(),
        c => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// Keeps the first failure to write output.
pub fn note(written: Result<(), Error>) {
    if let (Err(error), Ok(mut failure)) = (written, FAILURE.lock()) {
        failure.get_or_insert(error);
    }
}

/// Returns the exit code of a command whose output is complete, or 1 if output was lost. A pipe
/// closed by its reader does not count as lost output.
pub fn finished(code: ExitCode) -> ExitCode {
    note(std::io::stdout().flush());
    let failure = FAILURE.lock().ok().and_then(|mut failure| failure.take());
    match failure {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => {
            err!("harvest: cannot write the output: {error}");
            ExitCode::from(1)
        }
        _ => code,
    }
}
