//! Shares of the memory that ingest may use: flights in work at once, and the pieces in which their
//! channels are read.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::store::record_file::GROUP;

/// Longest piece of a channel, samples: it stays in the processor's cache.
const LONGEST_PIECE: usize = 1 << 16;

/// Shortest piece of a channel, samples: shorter pieces save little memory and cost many calls.
const SHORTEST_PIECE: usize = 1 << 14;

/// Memory of a channel per sample of its piece, from the file's numbers to the repaired ones,
/// bytes.
const BYTES_PER_SAMPLE: f64 = 64.0;

/// Channels per thread that are encoded before they are written in their order.
const BATCH: usize = 2;

/// Memory of a thread's encoded row groups, bytes: a batch is written while the next is encoded; a
/// sample is eight bytes and a mark.
const ENCODED_BYTES: f64 = 2.0 * BATCH as f64 * 9.0 * GROUP as f64;

/// Memory of a channel between its pieces, bytes.
const BYTES_PER_CHANNEL: f64 = 0.25e6;

/// Memory of a flight of ten hours besides its channels, bytes: clock and means over short blocks.
const BYTES_PER_FLIGHT: f64 = 40e6;

/// Division of the memory among flights, threads and pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemoryShares {
    /// Flights in work at once.
    pub flights: usize,
    /// Samples of a channel that are read at once.
    pub piece: usize,
    /// Channels that are encoded at once.
    pub batch: usize,
}

impl MemoryShares {
    /// Divides the memory: half for flights, half for threads.
    pub fn of(memory_mb: f64, channels: usize, threads: usize) -> MemoryShares {
        let half = 0.5e6 * memory_mb;
        let flights = clamped(
            half / (BYTES_PER_FLIGHT + BYTES_PER_CHANNEL * channels as f64),
            1,
            threads,
        );
        let workers = clamped(
            half / (ENCODED_BYTES + BYTES_PER_SAMPLE * SHORTEST_PIECE as f64),
            1,
            threads,
        );
        let piece = clamped(
            (half / workers as f64 - ENCODED_BYTES) / BYTES_PER_SAMPLE,
            SHORTEST_PIECE,
            LONGEST_PIECE,
        );
        MemoryShares {
            flights,
            piece,
            batch: BATCH * workers,
        }
    }
}

/// A count within limits.
fn clamped(value: f64, least: usize, most: usize) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to a range of counts"
    )]
    let count = value.clamp(least as f64, most.max(least) as f64) as usize;
    count
}

/// Calls `work` on every item in a few new threads, and returns the results in the order of the
/// items. `None` for an item whose thread panicked.
///
/// Within `work` the thread pool serves one item: no thread of the pool begins another while it
/// waits.
pub fn map_with_workers<T: Sync, R: Send>(
    workers: usize,
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
) -> Vec<Option<R>> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<Option<R>>> = Mutex::new(items.iter().map(|_| None).collect());
    let worker = || {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(i) else {
                return;
            };
            let result = work(item);
            if let Ok(mut results) = results.lock() {
                results[i] = Some(result);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..workers.min(items.len()) {
            scope.spawn(worker);
        }
    });
    results.into_inner().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_memory_allows_more_flights_and_longer_pieces_up_to_the_threads() {
        let little = MemoryShares {
            flights: 1,
            piece: SHORTEST_PIECE,
            batch: BATCH,
        };
        assert_eq!(MemoryShares::of(10.0, 100, 8), little);
        let usual = MemoryShares {
            flights: 1,
            piece: LONGEST_PIECE,
            batch: 2 * BATCH,
        };
        assert_eq!(MemoryShares::of(150.0, 41, 2), usual);
        let plenty = MemoryShares {
            flights: 8,
            piece: LONGEST_PIECE,
            batch: 8 * BATCH,
        };
        assert_eq!(MemoryShares::of(10_000.0, 41, 8), plenty);
    }

    #[test]
    fn results_of_workers_are_in_the_order_of_the_items() {
        let items: Vec<u32> = (0..100).collect();
        let doubled = map_with_workers(4, &items, |i| 2 * i);
        assert!(
            doubled
                .into_iter()
                .map(Option::unwrap)
                .eq((0..100).map(|i| 2 * i))
        );
    }
}
