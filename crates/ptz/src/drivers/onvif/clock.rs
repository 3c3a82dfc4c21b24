use super::xml::Element;
use std::time::{SystemTime, UNIX_EPOCH};

/// Now, in seconds since 1970, by this machine.
pub(super) fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| i64::try_from(since.as_secs()).unwrap_or(0))
}

/// The camera's own time in an answer to `GetSystemDateAndTime`, in seconds since 1970.
pub(super) fn read(answer: &Element) -> Option<i64> {
    let utc = answer.find("UTCDateTime")?;
    let (date, time) = (utc.find("Date")?, utc.find("Time")?);
    let number = |of: &Element, name: &str, most: i64| {
        of.text_of(name)?.parse::<i64>().ok().filter(|value| (0..=most).contains(value))
    };
    let days = days_since_1970(number(date, "Year", 9999)?, number(date, "Month", 12)?, number(date, "Day", 31)?);
    let seconds = number(time, "Hour", 23)? * 3600 + number(time, "Minute", 59)? * 60 + number(time, "Second", 60)?;
    Some(days * 86_400 + seconds)
}

/// The time in a `Date` header of HTTP, such as `Sun, 06 Nov 1994 08:49:37 GMT`, in seconds since 1970.
pub(super) fn read_http(date: &str) -> Option<i64> {
    const MONTHS: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let mut words = date.split_once(", ")?.1.split(' ');
    let mut next = || words.next();
    let (day, month, year, time, zone) = (next()?, next()?, next()?, next()?, next()?);
    let number = |text: &str, most: i64| text.parse::<i64>().ok().filter(|value| (0..=most).contains(value));
    let month = i64::try_from(MONTHS.iter().position(|name| *name == month)?).ok()? + 1;
    let days = days_since_1970(number(year, 9999)?, month, number(day, 31)?);
    let mut parts = time.split(':');
    let (hour, minute, second) = (parts.next()?, parts.next()?, parts.next()?);
    let seconds = number(hour, 23)? * 3600 + number(minute, 59)? * 60 + number(second, 60)?;
    (zone == "GMT").then_some(days * 86_400 + seconds)
}

/// A time as XML writes it.
pub(super) fn written(seconds: i64) -> String {
    let (days, rest) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    let (year, month, day) = date_of(days);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

/// Days from 1 January 1970 to a date of the Gregorian calendar: years begin in March, so that leap days come last.
const fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let month = (month + 9) % 12;
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * month + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// The date that many days after 1 January 1970.
fn date_of(days: i64) -> (i64, i64, i64) {
    // Few steps from a guess that is at most a year early.
    let mut year = 1970 + (days - 366).div_euclid(366);
    while days_since_1970(year + 1, 1, 1) <= days {
        year += 1;
    }
    let month = (2..=12).take_while(|&month| days_since_1970(year, month, 1) <= days).last().unwrap_or(1);
    (year, month, days - days_since_1970(year, month, 1) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::onvif::parse_answer;

    #[test]
    fn times_are_written_as_calendars_have_them() {
        assert_eq!(written(0), "1970-01-01T00:00:00Z");
        assert_eq!(written(951_782_399), "2000-02-28T23:59:59Z");
        assert_eq!(written(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(written(1_709_164_800), "2024-02-29T00:00:00Z");
        assert_eq!(written(1_767_225_599), "2025-12-31T23:59:59Z");
        assert_eq!(written(4_107_542_400), "2100-03-01T00:00:00Z");
        assert_eq!(written(-1), "1969-12-31T23:59:59Z");
    }

    #[test]
    fn the_time_of_http_is_read() {
        assert_eq!(read_http("Sun, 06 Nov 1994 08:49:37 GMT").map(written).unwrap(), "1994-11-06T08:49:37Z");
        assert_eq!(read_http("Thu, 29 Feb 2024 23:59:60 GMT").map(written).unwrap(), "2024-03-01T00:00:00Z");
        for bad in [
            "",
            "Sunday, 06-Nov-94 08:49:37 GMT",
            "Sun, 06 Nov 1994 08:49:37 CET",
            "Sun, 06 Nov 1994 24:49:37 GMT",
            "Sun, 06 Nev 1994 08:49:37 GMT",
            "Sun, 06 Nov 1994 08:49",
            "Sun, 99999999999999999999 Nov 1994 08:49:37 GMT",
        ] {
            assert_eq!(read_http(bad), None, "{bad}");
        }
    }

    #[test]
    fn the_cameras_time_is_read() {
        let answer = |year: &str, hour: &str| {
            parse_answer(&format!(
                "<R><UTCDateTime><Time><Hour>{hour}</Hour><Minute>5</Minute><Second>7</Second></Time>\
                 <Date><Year>{year}</Year><Month>2</Month><Day>29</Day></Date></UTCDateTime></R>"
            ))
            .unwrap()
        };
        assert_eq!(written(read(&answer("2024", "3")).unwrap()), "2024-02-29T03:05:07Z");
        assert_eq!(read(&answer("2024", "24")), None);
        assert_eq!(read(&answer("99999999999999999999", "3")), None);
        assert_eq!(read(&parse_answer("<R/>").unwrap()), None);
        assert!(now_s() > 1_700_000_000);
    }
}
