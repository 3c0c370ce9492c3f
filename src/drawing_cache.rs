//! Drawings known from the last report. To draw one again, or to set it again for print, gives the same
//! bytes, so only those that changed are made.
//!
//! In bytes the cache is a line of JSON, the length of each drawing by its key, and then the drawings in
//! that order.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Drawings by a key of everything that decides their bytes.
type Drawings = BTreeMap<String, Arc<Vec<u8>>>;

/// Drawings of the last report and those of this one, shared between threads.
#[derive(Debug, Default)]
pub struct DrawingCache {
    known: Drawings,
    used: Mutex<Drawings>,
}

impl DrawingCache {
    /// A cache of a report's drawings, from the bytes of [`DrawingCache::to_bytes`]; other bytes yield none.
    #[must_use]
    pub fn of_last_report(bytes: &[u8]) -> DrawingCache {
        DrawingCache {
            known: drawings_of(bytes).unwrap_or_default(),
            used: Mutex::default(),
        }
    }

    /// Drawings of this report.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.with_used(|used| {
            let lengths = used.iter().map(|(key, drawing)| (key, drawing.len()));
            let lengths: BTreeMap<&String, usize> = lengths.collect();
            let mut bytes = serde_json::to_vec(&lengths).unwrap_or_default();
            bytes.push(b'\n');
            for drawing in used.values() {
                bytes.extend_from_slice(drawing);
            }
            bytes
        })
    }

    /// Bytes of a drawing, drawn if they are not known; `None` if it cannot be drawn. Two threads that ask
    /// at once may both draw.
    pub fn get_or_draw(
        &self,
        key: &str,
        draw: impl FnOnce() -> Option<Vec<u8>>,
    ) -> Option<Arc<Vec<u8>>> {
        let used = self.with_used(|used| used.get(key).cloned());
        if used.is_some() {
            return used;
        }
        let known = self.known.get(key).cloned();
        let drawing = known.or_else(|| draw().map(Arc::new))?;
        self.with_used(|used| used.insert(key.to_owned(), Arc::clone(&drawing)));
        Some(drawing)
    }

    /// Each use leaves the map whole, so a panic of another thread does no harm.
    fn with_used<T>(&self, work: impl FnOnce(&mut Drawings) -> T) -> T {
        work(&mut self.used.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn drawings_of(bytes: &[u8]) -> Option<Drawings> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    let (lengths, mut rest) = bytes.split_at_checked(end + 1)?;
    let lengths: BTreeMap<String, usize> = serde_json::from_slice(lengths).ok()?;
    let mut drawings = Drawings::new();
    for (key, length) in lengths {
        let (drawing, after) = rest.split_at_checked(length)?;
        drawings.insert(key, Arc::new(drawing.to_vec()));
        rest = after;
    }
    Some(drawings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_is_drawn_once_and_kept_while_reports_use_it() {
        let cache = DrawingCache::default();
        let one = cache.get_or_draw("one", || Some(vec![0, b'\n', 255]));
        assert_eq!(cache.get_or_draw("one", || unreachable!()), one);
        assert_eq!(cache.get_or_draw("none", || None), None);
        let next = DrawingCache::of_last_report(&cache.to_bytes());
        next.get_or_draw("two", || Some(vec![]));
        assert_eq!(next.get_or_draw("one", || unreachable!()), one);
        let third = DrawingCache::of_last_report(&next.to_bytes());
        third.get_or_draw("two", || unreachable!());
        let fourth = DrawingCache::of_last_report(&third.to_bytes());
        assert!(fourth.get_or_draw("two", || unreachable!()).is_some());
        assert_eq!(
            fourth.get_or_draw("one", || None),
            None,
            "the third report had none"
        );
    }

    #[test]
    fn bytes_of_something_else_are_no_drawings() {
        for bytes in ["", "{}", "{\"one\":3}\nab", "one\n", "{\"one\":-1}\n"] {
            assert!(
                DrawingCache::of_last_report(bytes.as_bytes())
                    .known
                    .is_empty()
            );
        }
    }
}
