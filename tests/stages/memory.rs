//! Memory that stays with the process: a second maneuver takes no pages anew.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use harvest::memory::keep_freed_memory;

use crate::support::run;

/// Pages that this thread had to ask the kernel for.
fn faults() -> u64 {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
    // The name of the program, in brackets, may hold spaces; the count is the eighth number after
    // it.
    stat.rsplit(')')
        .next()
        .unwrap()
        .split_whitespace()
        .nth(7)
        .unwrap()
        .parse()
        .unwrap()
}

/// The faults of taking ten blocks of half a megabyte and giving them back, ten times.
fn faults_of_ten_maneuvers() -> u64 {
    let before = faults();
    for _ in 0..10 {
        let blocks: Vec<Vec<u8>> = (0..10).map(|k| vec![k; 512 << 10]).collect();
        std::hint::black_box(&blocks);
    }
    faults() - before
}

#[test]
#[ignore = "other tests share its heap: what_was_given_back_is_not_asked_for_again runs it in a process of its own"]
fn alone() {
    let pages_of_a_maneuver = 10 * (512 << 10) / 4096;
    keep_freed_memory();
    // Others share the machine's memory: what counts is that it can be.
    let least = (0..10).map(|_| faults_of_ten_maneuvers()).min();
    assert!(least < Some(pages_of_a_maneuver), "{least:?} faults");
}

#[test]
fn what_was_given_back_is_not_asked_for_again() {
    let program = std::env::current_exe().unwrap();
    let mut command = std::process::Command::new(program);
    let outcome = run(command.args(["--ignored", "--exact", "memory::alone"]));
    assert!(outcome.stdout.contains("1 passed"), "{outcome:?}");
}
