//! Progress bars.

use std::sync::Mutex;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use crate::pipeline::Progress;
use crate::store::Log;

/// A progress bar for each stage on the terminal, and a line for each in the log.
pub struct Bars<'a> {
    quiet: bool,
    log: Option<&'a Log>,
    bar: Mutex<ProgressBar>,
    stage: Mutex<Option<(String, usize, Instant)>>,
}

impl Bars<'_> {
    pub fn new(quiet: bool, log: Option<&Log>) -> Bars<'_> {
        Bars {
            quiet,
            log,
            bar: Mutex::new(ProgressBar::hidden()),
            stage: Mutex::new(None),
        }
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

    fn advance(&self, item: &str) {
        self.with(|bar| {
            bar.set_message(item.to_owned());
            bar.inc(1);
        });
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
