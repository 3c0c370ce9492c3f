//! Outline of a record for a chart: extremes in place of samples.

use std::collections::BTreeSet;

use super::layout::MARK;
use super::reading::RecordFile;
use crate::error::Error;
use crate::flight::record::Series;
use crate::flight::{Mark, Record};

impl RecordFile {
    /// Reads the whole record for a chart. If there are more samples than `most`, only the smallest
    /// and the largest of several neighbours are kept, in their order. Signals are read one at a
    /// time.
    ///
    /// # Errors
    /// As [`RecordFile::window`].
    pub fn outline(&self, most: usize) -> Result<Record, Error> {
        let all = 0..self.header.samples;
        if all.len() <= most {
            return self.window(None, all);
        }
        let width = (2 * all.len()).div_ceil(most.max(2)).max(2);
        let mut outline = self.header.record(&(0..2 * all.len().div_ceil(width)));
        outline.step_s = self.header.step_s * width as f64 / 2.0;
        let fields = self.metadata.schema().fields().iter().map(|f| f.name());
        let recorded = fields
            .filter(|name| !name.ends_with(MARK))
            .chain(self.header.constants.keys());
        for name in recorded {
            let signals = BTreeSet::from([name.clone()]);
            for (name, series) in self.window(Some(&signals), all.clone())?.signals {
                outline.signals.insert(name, extremes(&series, width));
            }
        }
        Ok(outline)
    }
}

/// Smallest and largest of every `width` samples, in their order, with the flag of a faulty sample
/// if there is one.
fn extremes(series: &Series, width: usize) -> Series {
    let mut outline = Series {
        values: Vec::new(),
        marks: Vec::new(),
    };
    for (values, marks) in series.values.chunks(width).zip(series.marks.chunks(width)) {
        let finite = || {
            values
                .iter()
                .copied()
                .enumerate()
                .filter(|(_, v)| v.is_finite())
        };
        let low = finite().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = finite().max_by(|a, b| a.1.total_cmp(&b.1));
        let pair = match (low, high) {
            (Some(low), Some(high)) if low.0 <= high.0 => [low.1, high.1],
            (Some(low), Some(high)) => [high.1, low.1],
            _ => [f64::NAN; 2],
        };
        outline.values.extend(pair);
        let mark = marks
            .iter()
            .find(|m| m.is_fault())
            .copied()
            .unwrap_or(Mark::Measured);
        outline.marks.extend([mark; 2]);
    }
    outline
}
