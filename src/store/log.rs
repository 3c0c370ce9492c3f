//! The run log: one JSON object per line with the time of day, appended to a file. No other output
//! contains a time of day.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde_json::{Map, Value};

use crate::error::{Error, Result};

/// An open log.
#[derive(Debug)]
pub struct Log {
    path: PathBuf,
    file: Mutex<(File, Option<std::io::Error>)>,
}

impl Log {
    /// Opens a log to append to, creating it as needed.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn open(path: &Path) -> Result<Log> {
        let file = OpenOptions::new().create(true).append(true).open(path);
        let file = file.map_err(Error::io(path, "cannot open the log"))?;
        Ok(Log {
            path: path.to_owned(),
            file: Mutex::new((file, None)),
        })
    }

    /// Appends a line of time, process, event and fields. A line is one write, so two runs that
    /// share a log do not mix lines. A log that cannot be written stops no run; see
    /// [`Log::failure`].
    pub fn write(&self, event: &str, fields: &[(&str, Value)]) {
        let mut line = Map::new();
        line.insert("time".to_owned(), timestamp(SystemTime::now()).into());
        line.insert("pid".to_owned(), std::process::id().into());
        line.insert("event".to_owned(), event.into());
        line.extend(
            fields
                .iter()
                .map(|(name, value)| ((*name).to_owned(), value.clone())),
        );
        let line = format!("{}\n", Value::Object(line));
        if let Ok(mut file) = self.file.lock()
            && let Err(error) = file.0.write_all(line.as_bytes())
        {
            file.1.get_or_insert(error);
        }
    }

    /// First failure to write the log, if any.
    #[must_use]
    pub fn failure(&self) -> Option<Error> {
        let error = self.file.lock().ok()?.1.take()?;
        Some(Error::io(&self.path, "cannot write the log")(error))
    }
}

/// Formats a time of day as RFC 3339 in UTC, to the millisecond.
#[must_use]
pub fn timestamp(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    let (days, second) = (since.as_secs() / 86_400, since.as_secs() % 86_400);
    // Days since 1 March 0000 of the proleptic Gregorian calendar, in eras of 400 years.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year_of_era = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    let millisecond = since.subsec_millis();
    format!(
        "{year:04}-{month:02}-{day_of_month:02}T{hour:02}:{minute:02}:{second:02}.{millisecond:03}Z"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_those_of_the_calendar() {
        let at = |s: u64| timestamp(UNIX_EPOCH + Duration::from_millis(s));
        assert_eq!(at(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(at(951_782_400_000), "2000-02-29T00:00:00.000Z");
        assert_eq!(at(1_709_251_199_999), "2024-02-29T23:59:59.999Z");
        assert_eq!(at(4_102_444_800_000), "2100-01-01T00:00:00.000Z");
    }

    #[test]
    fn a_line_is_an_object_and_lines_are_appended() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.jsonl");
        for n in 0..2 {
            Log::open(&path).unwrap().write(
                "begin",
                &[("n", n.into()), ("words", "two\nlines \"quoted\"".into())],
            );
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<Value> = text
            .lines()
            .map(|l| serde_json::from_str(l).unwrap())
            .collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(
            (&lines[1]["n"], &lines[1]["event"]),
            (&1.into(), &"begin".into())
        );
    }
}
