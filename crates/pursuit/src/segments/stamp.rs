//! Times as parts of file names: `20261125T130000Z`, to milliseconds where events may be close together.

/// A time, in seconds since 1970 in UTC, as names carry it; `precise` to milliseconds.
pub(super) fn stamp(unix_time_s: f64, precise: bool) -> String {
    let millis = (unix_time_s.max(0.0) * 1000.0).floor() as u64;
    let (seconds, millis) = (millis / 1000, millis % 1000);
    let (year, month, day) = civil(seconds / 86_400);
    let (hour, minute, second) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    let fraction = if precise { format!(".{millis:03}") } else { String::new() };
    format!("{year:04}{month:02}{day:02}T{hour:02}{minute:02}{second:02}{fraction}Z")
}

/// Whether a text is made of what stamps, and what tells equal ones apart, are made of.
pub(super) fn is_stamp(text: &str) -> bool {
    let (stamp, number) = text.split_once('_').unwrap_or((text, "2"));
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let Some((date, time)) = stamp.strip_suffix('Z').and_then(|s| s.split_once('T')) else { return false };
    let (time, millis) = time.split_once('.').unwrap_or((time, "000"));
    date.len() >= 8 && time.len() == 6 && millis.len() == 3 && [date, time, millis, number].into_iter().all(digits)
}

/// Year, month and day of the Gregorian calendar, so many days after 1 January 1970: years are counted from March, in spans
/// of 400 years (146 097 days), so that the day that comes every four years is the last of its year.
const fn civil(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (span, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day_of_month = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    (year + span * 400 + next, month, day_of_month)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        for (unix, text) in [
            (0.0, "19700101T000000Z"),
            (951_782_400.0, "20000229T000000Z"),
            (1_795_611_599.9, "20261125T125959Z"),
            (4_107_542_399.0, "21000228T235959Z"),
            (4_107_542_400.0, "21000301T000000Z"),
        ] {
            assert_eq!(stamp(unix, false), text);
        }
        assert_eq!(stamp(1_795_611_599.9, true), "20261125T125959.900Z");
        assert_eq!(stamp(f64::NAN, false), "19700101T000000Z");
    }

    #[test]
    fn what_is_no_stamp_is_told_apart() {
        assert!(["20261125T125959Z", "20261125T125959.900Z", "20261125T125959Z_12"].into_iter().all(is_stamp));
        for other in ["", "Z", "mine", "20261125", "20261125T1259Z", "20261125T125959Z_", "../20261125T125959Z"] {
            assert!(!is_stamp(other), "{other}");
        }
    }
}
