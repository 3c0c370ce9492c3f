//! Rows of a tall file in the order of time: of a file in another order they are sorted, a span of time at once.

use std::ops::Range;

use super::source::Tall;
use super::survey::{BINS, Survey};
use crate::error::Result;
use crate::store::import::imported_contents::refused;

/// Values that are sorted at once where rows are not in the order of time: 32 MB.
const SORTED_AT_ONCE: usize = 1 << 20;

/// Most values that are sorted at once, where a sixteen-thousandth of the time span has so many.
const MOST_AT_ONCE: usize = 20_000_000;

impl Tall {
    /// Passes the rows of the names that have a place on in the order of time.
    pub(super) fn in_order(
        &self,
        survey: &Survey,
        place: &dyn Fn(&str) -> Option<usize>,
        row: &mut dyn FnMut(f64, usize, f64) -> Result<()>,
    ) -> Result<()> {
        if survey.is_in_order {
            return self.each(&mut |time, name, value| {
                place(name).map_or(Ok(()), |place| row(time, place, value))
            });
        }
        for bins in self.spans(survey)? {
            let mut sorted = Vec::new();
            self.each(&mut |time, name, value| {
                if bins.contains(&survey.bin(time)) {
                    sorted.extend(place(name).map(|place| (time, place, value)));
                }
                Ok(())
            })?;
            // Stable: of two values for a time and a name the last one counts.
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (time, place, value) in sorted {
                row(time, place, value)?;
            }
        }
        Ok(())
    }

    /// Spans of time whose values are sorted at once.
    fn spans(&self, survey: &Survey) -> Result<Vec<Range<usize>>> {
        let mut counts = vec![0_usize; BINS];
        self.each(&mut |time, _, _| {
            counts[survey.bin(time)] += 1;
            Ok(())
        })?;
        if let Some(most) = counts.iter().find(|count| **count > MOST_AT_ONCE) {
            let what = format!(
                "{most} values out of the order of time do not fit into memory: sort the file by time"
            );
            return Err(refused(&self.source, &what));
        }
        let mut spans: Vec<Range<usize>> = Vec::new();
        let mut values = usize::MAX;
        for (bin, count) in counts.into_iter().enumerate() {
            values = values.saturating_add(count);
            match spans.last_mut() {
                Some(span) if values <= SORTED_AT_ONCE => span.end = bin + 1,
                _ => {
                    spans.push(bin..bin + 1);
                    values = count;
                }
            }
        }
        Ok(spans)
    }
}
