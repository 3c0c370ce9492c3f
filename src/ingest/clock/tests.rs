//! Work of a survey: rows and readings for clocks of every kind, sound and damaged.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use proptest::prelude::*;

use super::{Survey, survey};
use crate::error::Problem;
use crate::flight::channel::RawColumn;
use crate::flight::{Channel, RawFlight, signal};
use crate::ingest::column_source::ColumnSource;
use crate::ingest::settings::Settings;

/// Files in memory that count what is read from them.
struct Counted {
    files: Vec<RawFlight>,
    readings: AtomicUsize,
    rows: AtomicUsize,
}

impl Counted {
    /// Files with these times, s, and two channels that change from row to row.
    fn of(times: &[Vec<f64>]) -> Counted {
        let column = |values: Vec<f64>| RawColumn { unit: None, values };
        let file = |times: &Vec<f64>| {
            let of_row = |rate: f64| (0..times.len()).map(|k| (rate * k as f64).sin()).collect();
            let columns = [
                ("time", times.clone()),
                ("q", of_row(0.7)),
                ("r", of_row(0.3)),
            ];
            RawFlight {
                flight_id: "007".to_owned(),
                columns: columns
                    .into_iter()
                    .map(|(name, values)| (name.to_owned(), column(values)))
                    .collect(),
            }
        };
        Counted {
            files: times.iter().map(file).collect(),
            readings: AtomicUsize::new(0),
            rows: AtomicUsize::new(0),
        }
    }

    fn survey(&self) -> Result<Survey, Problem> {
        let channel = |(name, signal, unit): (&str, &str, &str)| {
            (name.to_owned(), Channel::plain(signal, unit))
        };
        let channels = [
            ("time", signal::TIME, "s"),
            ("q", "q_deg_s", "deg/s"),
            ("r", "r_deg_s", "deg/s"),
        ];
        let channels: BTreeMap<String, Channel> = channels.into_iter().map(channel).collect();
        survey(self, &channels, &Settings::default())
    }

    fn work(&self) -> (usize, usize) {
        let count = |counter: &AtomicUsize| counter.load(Ordering::Relaxed);
        (count(&self.readings), count(&self.rows))
    }
}

impl ColumnSource for Counted {
    fn flight_id(&self) -> &str {
        self.files[..].flight_id()
    }

    fn files(&self) -> usize {
        self.files.len()
    }

    fn name(&self, file: usize) -> String {
        self.files[..].name(file)
    }

    fn rows(&self, file: usize) -> usize {
        self.files[..].rows(file)
    }

    fn has(&self, file: usize, column: &str) -> bool {
        self.files[..].has(file, column)
    }

    fn unit(&self, file: usize, column: &str) -> Option<&str> {
        self.files[..].unit(file, column)
    }

    fn read(
        &self,
        file: usize,
        column: &str,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), String> {
        self.readings.fetch_add(1, Ordering::Relaxed);
        self.rows.fetch_add(rows.len(), Ordering::Relaxed);
        self.files[..].read(file, column, rows, sink)
    }
}

/// Largest number of readings that a survey of any clock may make.
const MOST_READINGS: usize = 10_000;

/// Largest number of rows that a survey reads, per row and binary logarithm of the rows.
const MOST_ROWS: f64 = 64.0;

fn clock(rows: usize) -> Vec<f64> {
    (0..rows).map(|k| k as f64 * 0.025).collect()
}

/// Random numbers from a seed (Knuth's MMIX generator).
fn random(seed: u64) -> impl FnMut(usize) -> usize {
    let mut state = seed;
    move |below| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(state >> 33).unwrap() % below
    }
}

/// Spoils the times of a recorder in one of [`KINDS`] ways.
fn spoil(times: &mut [f64], kind: usize, seed: u64) {
    let mut random = random(seed);
    let rows = times.len();
    let some = 1 + random(rows / 2);
    match kind {
        // Rows in any order.
        0 => (0..rows).for_each(|k| times.swap(k, random(k + 1))),
        // A clock that starts anew.
        1 => (0..rows).for_each(|k| times[k] = (k % (2 + some)) as f64 * 0.025),
        // Times that stand still, are no number, or have other bits.
        2 => (0..some).for_each(|_| {
            let k = 1 + random(rows - 1);
            times[k] = times[k - 1];
        }),
        3 => (0..some).for_each(|_| times[random(rows)] = f64::NAN),
        4 => (0..some).for_each(|_| {
            let k = random(rows);
            times[k] = f64::from_bits(times[k].to_bits() ^ (1 << random(64)));
        }),
        // Blocks of rows in any order.
        5 => {
            let blocks = times.to_vec();
            let mut blocks: Vec<&[f64]> = blocks.chunks(1 + some % 97).collect();
            (0..blocks.len()).for_each(|k| blocks.swap(k, random(k + 1)));
            times.copy_from_slice(&blocks.concat());
        }
        // Backwards; at random; jumps ahead of every length.
        6 => times.reverse(),
        7 => times.fill_with(|| random(1 << 20) as f64 * 1e-3),
        _ => {
            let mut ahead_s = 0.0;
            for time in times {
                ahead_s += [0.0, 0.0, 2.0, 70.0][random(4)];
                *time += ahead_s;
            }
        }
    }
}

const KINDS: usize = 9;

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_work_of_a_survey_is_bounded_by_its_rows(
        rows in 2_usize..6000,
        files in 1_usize..4,
        kinds in prop::collection::vec(0..KINDS, 1..3),
        seed in any::<u64>(),
    ) {
        let mut times = clock(rows);
        for kind in &kinds {
            spoil(&mut times, *kind, seed);
        }
        let source = Counted::of(&vec![times; files]);
        // Either outcome is fine, as long as there is one.
        let _ = source.survey();
        let (readings, read) = source.work();
        let rows = (rows * files) as f64;
        prop_assert!(readings <= MOST_READINGS, "{readings} readings of {kinds:?}");
        prop_assert!((read as f64) <= MOST_ROWS * rows * (2.0 + rows.log2()), "{read} rows of {kinds:?}");
    }
}

#[test]
fn rows_out_of_order_refuse_the_flight_and_are_named() {
    let mut times = clock(13_200);
    spoil(&mut times, 0, 1);
    let problem = Counted::of(&[times]).survey().unwrap_err();
    assert_eq!(problem.place, "channel `time`");
    assert!(
        problem.reason.contains("its rows are out of order"),
        "{}",
        problem.reason
    );
}

#[test]
fn a_clock_that_starts_anew_every_second_is_refused_and_twice_is_two_stretches() {
    let restarted = |rows: usize, period: usize| -> Vec<f64> {
        (0..rows).map(|k| (k % period) as f64 * 0.025).collect()
    };
    let problem = Counted::of(&[restarted(24_000, 40)]).survey().unwrap_err();
    assert!(
        problem
            .reason
            .starts_with("time returns to times before it more than 512 times"),
        "{}",
        problem.reason
    );
    let survey = Counted::of(&[restarted(24_000, 12_000)]).survey().unwrap();
    assert_eq!(survey.stretches.len(), 2);
}

#[test]
fn repeated_times_cost_no_readings_of_their_own() {
    let mut times = clock(20_000);
    for k in (20..20_000).step_by(20) {
        times[k] = times[k - 1];
    }
    let source = Counted::of(&[times]);
    assert_eq!(source.survey().unwrap().stretches[0].clock.rows, 19_001);
    assert_eq!(source.work(), (2, 39_999 + 1));
}
