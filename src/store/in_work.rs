//! List of the flights being processed, a file of the store that `harvest status` reads during a
//! run.
//!
//! The list is only information: it is not synced, and a failure to write it stops no run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

use super::lock::Lock;
use super::log::timestamp;
use super::regular;

/// File of the list.
const FILE: &str = "in_work.json";

/// Flights being processed, each with the time of day at which it began.
pub type InWork = BTreeMap<String, String>;

/// The list of a run.
#[derive(Debug)]
pub struct InWorkList {
    path: PathBuf,
    flights: Mutex<InWork>,
}

/// A flight on the list, until it is dropped.
#[derive(Debug)]
pub struct InWorkEntry<'a> {
    list: &'a InWorkList,
    flight_id: &'a str,
}

impl InWorkList {
    /// Starts an empty list of a store that this run holds alone: removes the file of a killed run.
    pub fn start_empty(folder: &Path) -> InWorkList {
        let list = InWorkList {
            path: folder.join(FILE),
            flights: Mutex::default(),
        };
        let _ = std::fs::remove_file(&list.path);
        list
    }

    pub fn add<'a>(&'a self, flight_id: &'a str) -> InWorkEntry<'a> {
        self.change(|flights| {
            flights.insert(flight_id.to_owned(), timestamp(SystemTime::now()));
        });
        InWorkEntry {
            list: self,
            flight_id,
        }
    }

    fn change(&self, change: impl FnOnce(&mut InWork)) {
        let Ok(mut flights) = self.flights.lock() else {
            return;
        };
        change(&mut flights);
        let _ = if flights.is_empty() {
            std::fs::remove_file(&self.path)
        } else {
            let text = serde_json::to_vec(&*flights).unwrap_or_default();
            std::fs::write(&self.path, text)
        };
    }
}

impl Drop for InWorkEntry<'_> {
    fn drop(&mut self) {
        self.list.change(|flights| {
            flights.remove(self.flight_id);
        });
    }
}

/// Flights that another run is processing; empty if no run holds the store.
#[must_use]
pub fn in_work(folder: &Path) -> InWork {
    let list = regular::read(&folder.join(FILE));
    let list: Option<InWork> = list
        .ok()
        .and_then(|text| serde_json::from_slice(&text).ok());
    match list {
        Some(list) if Lock::is_held(&folder.join("lock")) => list,
        _ => InWork::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn flights_in_work_are_listed_while_the_store_is_held() {
        let folder = tempfile::tempdir().unwrap();
        let lock = Lock::take(&folder.path().join("lock"), "store", Duration::ZERO).unwrap();
        let list = InWorkList::start_empty(folder.path());
        let first = list.add("007");
        let second = list.add("008");
        let listed: Vec<String> = in_work(folder.path()).into_keys().collect();
        assert_eq!(listed, ["007", "008"]);
        drop(first);
        let listed: Vec<String> = in_work(folder.path()).into_keys().collect();
        assert_eq!(listed, ["008"]);
        // A killed run leaves its list, and its lock ends with it.
        drop(lock);
        assert_eq!(in_work(folder.path()), InWork::new());
        drop(second);
        assert!(!folder.path().join(FILE).exists());
    }
}
