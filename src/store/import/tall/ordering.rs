//! Rows of a tall file in the order of time. A file in another order is sorted, one span of time
//! after another.

use std::path::Path;

use super::source::Tall;
use super::survey::{BINS, Survey};
use crate::error::{Error, Result};
use crate::store::import::imported_contents::refused;
use crate::store::import::time_order::SpanFile;

/// Number of values that are sorted at once if rows are not in the order of time: 32 MB.
const SORTED_AT_ONCE: usize = 1 << 20;

/// Largest number of values that are sorted at once, if a sixteen-thousandth of the time span has
/// this many.
const MOST_AT_ONCE: usize = 20_000_000;

/// Spans of time: the span of each bin, and the number of values of each span.
struct Spans {
    of_bin: Vec<usize>,
    counts: Vec<usize>,
}

impl Tall {
    /// Passes on, in the order of time, the rows of the names that have a place. Rows in another
    /// order are first sorted on the disk, beside `scratch`.
    pub(super) fn in_order(
        &self,
        survey: &Survey,
        scratch: &Path,
        place: &dyn Fn(&str) -> Option<usize>,
        row: &mut dyn FnMut(f64, usize, f64) -> Result<()>,
    ) -> Result<()> {
        if survey.is_in_order {
            return self.each(&mut |time, name, value| {
                place(name).map_or(Ok(()), |place| row(time, place, value))
            });
        }
        let Spans { of_bin, counts } = self.spans(survey)?;
        let folder = scratch.parent().unwrap_or(Path::new("."));
        let failed = |e| Error::io(folder, "cannot sort a file's values in it")(e);
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut file = SpanFile::of(folder, &counts).map_err(failed)?;
        self.each(&mut |time, name, value| {
            let span = of_bin[survey.bin(time)];
            place(name).map_or(Ok(()), |place| {
                file.push(span, (time, place, value)).map_err(failed)
            })
        })?;
        for span in 0..counts.len() {
            // Stable: of two values for a time and a name the last one counts.
            for (time, place, value) in file.sorted(span).map_err(failed)? {
                row(time, place, value)?;
            }
        }
        Ok(())
    }

    /// Spans of time whose values are sorted at once.
    fn spans(&self, survey: &Survey) -> Result<Spans> {
        let mut bins = vec![0_usize; BINS];
        self.each(&mut |time, _, _| {
            bins[survey.bin(time)] += 1;
            Ok(())
        })?;
        if let Some(most) = bins.iter().find(|count| **count > MOST_AT_ONCE) {
            let what = format!(
                "{most} values out of the order of time do not fit into memory: sort the file by time"
            );
            return Err(refused(&self.source, &what));
        }
        let mut spans = Spans {
            of_bin: Vec::with_capacity(BINS),
            counts: Vec::new(),
        };
        for count in bins {
            match spans.counts.last_mut() {
                Some(values) if *values + count <= SORTED_AT_ONCE => *values += count,
                _ => spans.counts.push(count),
            }
            spans.of_bin.push(spans.counts.len() - 1);
        }
        Ok(spans)
    }
}
