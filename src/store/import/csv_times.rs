//! Calendar times in the columns of a delimited text: seconds from an origin.

use super::calendar_time::{CalendarTime, is_time_of_day};
use super::delimited::is_missing;

/// Origin of calendar times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// First of the values.
    First(CalendarTime),
    /// Beginning of the first date, which stands in the column `date`.
    Midnight { first: CalendarTime, date: usize },
}

impl Origin {
    /// Seconds from the origin to the time in the column `at` of a row.
    pub fn seconds(self, fields: &[String], at: usize) -> Option<f64> {
        let time = fields.get(at)?;
        match self {
            Origin::First(first) => CalendarTime::parse(time).map(|time| time.since(first)),
            Origin::Midnight { first, date } => {
                CalendarTime::of(fields.get(date)?, time).map(|time| time.since(first))
            }
        }
    }
}

/// A column of dates and the column of times of day that belongs to it.
#[derive(Clone, Copy, Debug)]
pub struct DateBesideTime {
    pub date: usize,
    pub time: usize,
    pub origin: Origin,
}

/// The only column of dates, with the times of day beside it, or with the only ones.
pub fn date_beside_time(rows: &[Vec<String>], width: usize) -> Option<DateBesideTime> {
    let all = |at: usize, is_own: &dyn Fn(&str) -> bool| {
        let given = rows.iter().filter_map(|row| row.get(at));
        let mut given = given.filter(|field| !is_missing(field)).peekable();
        given.peek().is_some() && given.all(|field| is_own(field))
    };
    let is_date = |field: &str| CalendarTime::midnight(field).is_some();
    let columns = |is_own: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..width).filter(|at| all(*at, is_own)).collect()
    };
    let [date] = columns(&is_date)[..] else {
        return None;
    };
    let times = columns(&is_time_of_day);
    let beside = times.iter().find(|at| **at == date + 1);
    let before = times.iter().find(|at| **at + 1 == date);
    let only = times.first().filter(|_| times.len() == 1);
    let time = *beside.or(before).or(only)?;
    let first = rows
        .iter()
        .find_map(|row| CalendarTime::midnight(row.get(date)?))?;
    let origin = Origin::Midnight { first, date };
    Some(DateBesideTime { date, time, origin })
}
