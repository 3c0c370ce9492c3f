//! Calendar times of text, as ISO 8601 writes them, `2024-05-01T12:30:05.25Z`, or with points and the day first,
//! `25.11.2026 13:45:12,5`.

/// A calendar time. Days and seconds are apart, so that a difference keeps every digit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalendarTime {
    /// Days since 1970-01-01.
    day: i64,
    /// Second of the day; beyond the day with an offset from UTC.
    second: f64,
}

impl CalendarTime {
    /// Parses a date and a time of day with `T` or a space between them, and perhaps `Z` or an offset from
    /// UTC. Without an offset the time counts as UTC.
    pub fn parse(field: &str) -> Option<CalendarTime> {
        let (date, time) = date_and_time(field)?;
        CalendarTime::of(date, time)
    }

    /// Parses a date and a time of day.
    pub fn of(date: &str, time: &str) -> Option<CalendarTime> {
        let (time, offset_s) = without_offset(time)?;
        Some(CalendarTime {
            day: day_of(date)?,
            second: time_of_day(time)? - offset_s,
        })
    }

    /// Beginning of a date.
    pub fn midnight(date: &str) -> Option<CalendarTime> {
        Some(CalendarTime {
            day: day_of(date)?,
            second: 0.0,
        })
    }

    /// Seconds from another time to this one.
    pub fn since(self, first: CalendarTime) -> f64 {
        (self.day - first.day) as f64 * 86_400.0 + (self.second - first.second)
    }
}

/// `true` for a time of day such as `12:30:05.25`.
pub fn is_time_of_day(field: &str) -> bool {
    without_offset(field).is_some_and(|(time, _)| time_of_day(time).is_some())
}

/// `true` for a date and a time of day whose day, month or year cannot be distinguished, such as
/// `01/02/2026 13:45`.
pub fn is_ambiguous(field: &str) -> bool {
    let Some((date, time)) = date_and_time(field) else {
        return false;
    };
    let parts: Vec<&str> = date.split(['/', '.', '-']).collect();
    let is_number = |part: &&str| whole(part, 9999).is_some();
    parts.len() == 3
        && parts.iter().all(is_number)
        && is_time_of_day(time.split(' ').next().unwrap_or_default())
        && day_of(date).is_none()
}

/// Date and time of day of a field.
fn date_and_time(field: &str) -> Option<(&str, &str)> {
    let (date, time) = field.trim().split_once(['T', 't', ' '])?;
    Some((date.trim_end_matches(','), time.trim_start()))
}

/// Time of day without its offset from UTC, and the offset in seconds.
fn without_offset(text: &str) -> Option<(&str, f64)> {
    let text = text.trim_end();
    if let Some(time) = text.strip_suffix(['Z', 'z']) {
        return Some((time, 0.0));
    }
    let Some(at) = text.find(['+', '-']) else {
        return Some((text, 0.0));
    };
    let (time, offset) = text.split_at(at);
    let digits = offset.get(1..)?.replace(':', "");
    let minutes = match digits.len() {
        2 => 60 * whole(&digits, 23)?,
        4 => 60 * whole(digits.get(..2)?, 23)? + whole(digits.get(2..)?, 59)?,
        _ => return None,
    };
    let sign = if offset.starts_with('-') { -1.0 } else { 1.0 };
    Some((time.trim_end(), sign * 60.0 * minutes as f64))
}

/// Seconds of `12:30:05.25` or `12:30`.
fn time_of_day(text: &str) -> Option<f64> {
    let mut parts = text.splitn(3, ':');
    let hours = whole(parts.next()?, 24)?;
    let minutes = whole(parts.next()?, 59)?;
    let seconds = parts.next().unwrap_or("0").replace(',', ".");
    let is_plain = seconds.starts_with(|c: char| c.is_ascii_digit())
        && seconds.chars().all(|c| c.is_ascii_digit() || c == '.');
    let seconds: f64 = seconds.parse().ok().filter(|_| is_plain)?;
    // 60 is a leap second.
    (seconds < 61.0).then(|| (3600 * hours + 60 * minutes) as f64 + seconds)
}

/// Year, month and day of a date: the year first between `-` or `/`, or the day first between points.
fn parts_of(date: &str) -> Option<[&str; 3]> {
    let separator = date.chars().find(|c| !c.is_ascii_digit())?;
    let mut parts = date.splitn(3, separator);
    let [first, second, third] = [parts.next()?, parts.next()?, parts.next()?];
    let (year, day) = match separator {
        '-' | '/' => (first, third),
        '.' => (third, first),
        _ => return None,
    };
    (year.len() == 4 && second.len() <= 2 && day.len() <= 2).then_some([year, second, day])
}

/// Days from 1970-01-01 to a date of the Gregorian calendar (after Hinnant, `days_from_civil`).
fn day_of(date: &str) -> Option<i64> {
    let [year, month, day] = parts_of(date.trim())?;
    let year = whole(year, 9999)?;
    let month = whole(month, 12).filter(|month| *month >= 1)?;
    let day = whole(day, 31).filter(|day| *day >= 1)?;
    // A year from March on, so that the leap day is its last.
    let year = if month <= 2 { year - 1 } else { year };
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some(365 * year + leap_days + day_of_year - 719_468)
}

/// A number of digits alone, up to a largest one.
fn whole(text: &str, largest: i64) -> Option<i64> {
    let is_plain = !text.is_empty() && text.chars().all(|c| c.is_ascii_digit());
    let number = text.parse().ok().filter(|_| is_plain);
    number.filter(|number| *number <= largest)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "the values are exact")]

    use super::*;

    #[test]
    fn times_are_seconds_from_the_first() {
        let since = |later: &str, first: &str| {
            let [later, first] = [later, first].map(|t| CalendarTime::parse(t).expect(t));
            later.since(first)
        };
        let first = "2024-05-01T12:30:05.25Z";
        assert_eq!(since("2024-05-01T12:30:05.75Z", first), 0.5);
        assert_eq!(since("2024-05-01 14:30:06,25+02:00", first), 1.0);
        assert_eq!(since("2024-05-01T08:00:05.25-0430", first), 0.0);
        assert_eq!(since("2024-05-02T00:00:00", "2024-05-01T23:59:59.5"), 0.5);
        // 2000 was a leap year, 1900 was not.
        assert_eq!(since("2000-03-01T00:00", "2000-02-28T00:00"), 172_800.0);
        assert_eq!(since("1900-03-01T00:00", "1900-02-28T00:00"), 86_400.0);
        // Unix time 1,000,000,000.
        assert_eq!(since("2001-09-09T01:46:40Z", "1970-01-01T00:00:00Z"), 1e9);
    }

    #[test]
    fn dates_with_points_have_the_day_first_and_those_with_slashes_the_year() {
        let iso = CalendarTime::parse("2026-11-05T13:45:12.5").unwrap();
        for text in [
            "05.11.2026 13:45:12,5",
            "5.11.2026 13:45:12.5",
            "05.11.2026, 13:45:12,5",
            "2026/11/05 13:45:12.5",
        ] {
            assert_eq!(CalendarTime::parse(text), Some(iso), "{text}");
        }
        assert_eq!(CalendarTime::of("05.11.2026", "13:45:12,5"), Some(iso));
        let midnight = CalendarTime::midnight("05.11.2026").unwrap();
        assert_eq!(iso.since(midnight), 49_512.5);
        assert!(CalendarTime::midnight("13:45:12").is_none());
        assert!(is_time_of_day("13:45:12,5") && !is_time_of_day("05.11.2026"));
    }

    #[test]
    fn a_date_that_may_be_another_is_ambiguous_and_no_calendar_time() {
        for text in [
            "01/02/2026 13:45:12",
            "25/11/2026 13:45",
            "01-02-2026 13:45:12,5",
            "25.11.26 13:45:12",
            "1/2/26 1:45:12 PM",
        ] {
            assert!(is_ambiguous(text), "{text}");
            assert_eq!(CalendarTime::parse(text), None, "{text}");
        }
        for text in [
            "05.11.2026 13:45",
            "2026/11/05 13:45",
            "1.5",
            "12:30:05",
            "1/2",
            "a/b/c 12:30",
        ] {
            assert!(!is_ambiguous(text), "{text}");
        }
    }

    #[test]
    fn what_is_no_calendar_time_is_none() {
        for text in [
            "",
            "1.5",
            "12:30:05.25",
            "2024-05-01",
            "2024-13-01T00:00:00",
            "2024-05-01T25:00:00",
            "2024-05-01T12:30:05.25+1",
            "2024-05-01Tabc",
            "2024-05-é1T00:00:00",
        ] {
            assert_eq!(CalendarTime::parse(text), None, "{text}");
        }
    }
}
