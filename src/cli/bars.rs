//! Progress bars.

use std::sync::{Arc, Mutex};
use std::time::{Instant, SystemTime};

use indicatif::{ProgressBar, ProgressStyle};

use crate::pipeline::Progress;
use crate::store::Log;
use crate::store::log::timestamp;

/// Stage and items in work at this moment.
#[derive(Debug, Default)]
pub struct CurrentItems {
    stage: Mutex<Option<(String, usize, Instant)>>,
    /// Items in work with the time of day since when, the oldest first.
    items: Mutex<Vec<(String, String)>>,
}

impl CurrentItems {
    /// Name of the stage; empty between stages.
    pub fn stage(&self) -> String {
        let begun = self.stage.lock().ok();
        begun
            .and_then(|begun| begun.as_ref().map(|(stage, ..)| stage.clone()))
            .unwrap_or_default()
    }

    /// Items in work, each `item since time`.
    pub fn items(&self) -> Vec<String> {
        let items = self.items.lock();
        items.map_or_else(
            |_| Vec::new(),
            |items| {
                let words = items
                    .iter()
                    .map(|(item, since)| format!("{item} since {since}"));
                words.collect()
            },
        )
    }

    fn add(&self, item: &str) {
        if let Ok(mut items) = self.items.lock() {
            items.push((item.to_owned(), timestamp(SystemTime::now())));
        }
    }

    fn remove(&self, item: &str) {
        if let Ok(mut items) = self.items.lock() {
            items.retain(|(name, _)| name != item);
        }
    }
}

/// A progress bar for each stage on the terminal, and a line for each in the log.
pub struct Bars<'a> {
    quiet: bool,
    log: Option<&'a Log>,
    bar: Mutex<ProgressBar>,
    work: Arc<CurrentItems>,
}

impl Bars<'_> {
    pub fn new(quiet: bool, log: Option<&Log>) -> Bars<'_> {
        Bars {
            quiet,
            log,
            bar: Mutex::new(ProgressBar::hidden()),
            work: Arc::default(),
        }
    }

    /// The work that the bars show.
    pub fn work(&self) -> &Arc<CurrentItems> {
        &self.work
    }

    /// Shows the item that is in work for the longest time, or else the latest finished one.
    fn show(&self, finished: &str) {
        let oldest = self.work.items().into_iter().next();
        self.with(|bar| bar.set_message(oldest.unwrap_or_else(|| finished.to_owned())));
    }

    fn with(&self, act: impl FnOnce(&mut ProgressBar)) {
        if let Ok(mut bar) = self.bar.lock() {
            act(&mut bar);
        }
    }
}

impl Progress for Bars<'_> {
    fn begin(&self, stage: &str, items: usize) {
        if let Ok(mut begun) = self.work.stage.lock() {
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
        self.work.add(item);
        if let Some(log) = self.log {
            log.write("flight", &[("flight", item.into())]);
        }
        self.show(item);
    }

    fn advance(&self, item: &str) {
        self.work.remove(item);
        self.with(|bar| bar.inc(1));
        self.show(item);
    }

    fn end(&self) {
        let begun = self.work.stage.lock();
        let begun = begun.ok().and_then(|mut begun| begun.take());
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
