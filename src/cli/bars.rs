//! Progress bars.

use std::sync::Mutex;
use std::time::{Instant, SystemTime};

use indicatif::{ProgressBar, ProgressStyle};

use crate::pipeline::Progress;
use crate::store::Log;
use crate::store::log::timestamp;

/// A progress bar for each stage on the terminal, and a line for each in the log.
pub struct Bars<'a> {
    quiet: bool,
    log: Option<&'a Log>,
    bar: Mutex<ProgressBar>,
    stage: Mutex<Option<(String, usize, Instant)>>,
    /// Items in work with the time of day since when, the oldest first.
    in_work: Mutex<Vec<(String, String)>>,
}

impl Bars<'_> {
    pub fn new(quiet: bool, log: Option<&Log>) -> Bars<'_> {
        Bars {
            quiet,
            log,
            bar: Mutex::new(ProgressBar::hidden()),
            stage: Mutex::new(None),
            in_work: Mutex::new(Vec::new()),
        }
    }

    /// Shows the item that is in work for the longest time, or else the latest finished one.
    fn show(&self, finished: &str) {
        let oldest = self
            .in_work
            .lock()
            .ok()
            .and_then(|all| all.first().cloned());
        let message = match oldest {
            Some((item, since)) => format!("{item} since {since}"),
            None => finished.to_owned(),
        };
        self.with(|bar| bar.set_message(message));
    }

    fn with(&self, act: impl FnOnce(&mut ProgressBar)) {
        if let Ok(mut bar) = self.bar.lock() {
            act(&mut bar);
        }
    }
}

impl Progress for Bars<'_> {
    fn begin(&self, stage: &str, items: usize) {
        if let Ok(mut begun) = self.stage.lock() {
            *begun = Some((stage.to_owned(), items, Instant::now()));
        }
        let new = if self.quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(items as u64)
        };
        if let Ok(style) = ProgressStyle::with_template(
            "{prefix:>9} {bar:32} {pos:>4}/{len:<4} {elapsed:>4}  {wide_msg}",
        ) {
            new.set_style(style);
        }
        new.set_prefix(stage.to_owned());
        self.with(|bar| *bar = new);
    }

    fn start(&self, item: &str) {
        if let Ok(mut all) = self.in_work.lock() {
            all.push((item.to_owned(), timestamp(SystemTime::now())));
        }
        if let Some(log) = self.log {
            log.write("flight", &[("flight", item.into())]);
        }
        self.show(item);
    }

    fn advance(&self, item: &str) {
        if let Ok(mut all) = self.in_work.lock() {
            all.retain(|(name, _)| name != item);
        }
        self.with(|bar| bar.inc(1));
        self.show(item);
    }

    fn end(&self) {
        let begun = self.stage.lock().ok().and_then(|mut begun| begun.take());
        if let (Some(log), Some((stage, items, begun))) = (self.log, begun) {
            let seconds = begun.elapsed().as_secs_f64();
            log.write(
                "stage",
                &[
                    ("stage", stage.into()),
                    ("items", items.into()),
                    ("seconds", seconds.into()),
                ],
            );
        }
        self.with(|bar| bar.finish_with_message(""));
    }
}
