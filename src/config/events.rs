//! Maneuvers that an analyst has marked: a CSV table, checked line by line.

use std::cmp::Ordering;
use std::path::Path;

use crate::error::{Error, Result, did_you_mean};
use crate::maneuver::{Class, Event};
use crate::store::files;

/// Reads the analyst's events; none without a file.
pub(super) fn read(path: Option<&Path>, classes: &[Class]) -> Result<Vec<Event>> {
    let Some(path) = path else {
        return Ok(Vec::new());
    };
    let mut events = Vec::new();
    for (line, event) in files::events(path)? {
        if let Some(what) = mistake(&event, classes) {
            return Err(Error::config(path, Some(line), what));
        }
        events.push(event);
    }
    Ok(events)
}

/// The first mistake of an event: its class, its times, their order.
fn mistake(event: &Event, classes: &[Class]) -> Option<String> {
    let known = classes.iter().map(|c| c.name.as_str());
    if !known.clone().any(|name| name == event.class) {
        let near = did_you_mean(&event.class, known);
        return Some(format!("unknown class `{}`{near}", event.class));
    }
    for (name, time_s) in [("start_s", event.start_s), ("end_s", event.end_s)] {
        if !time_s.is_finite() {
            return Some(format!("column `{name}`: {time_s} is no time"));
        }
    }
    let is_in_order = event.end_s.partial_cmp(&event.start_s) == Some(Ordering::Greater);
    (!is_in_order).then(|| "the event ends before it starts".to_owned())
}
