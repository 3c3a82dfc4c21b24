use crate::RunError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Units of time in seconds, the longest first.
const UNITS: [(&str, f64); 5] = [("w", 604_800.0), ("d", 86_400.0), ("h", 3600.0), ("m", 60.0), ("s", 1.0)];
/// A thousand years: more makes no sense.
const LONGEST_S: f64 = 3.2e10;

/// A length of time above zero, written as a number and a unit: `90s`, `15m`, `1h`, `7d`, `2w`. A number alone is seconds.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Span(f64);

impl Span {
    /// In seconds.
    pub const fn seconds(self) -> f64 {
        self.0
    }
}

impl FromStr for Span {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for anything but a number above zero with a unit.
    fn from_str(text: &str) -> Result<Self, RunError> {
        let text = text.trim();
        let unit = UNITS.iter().find_map(|(unit, seconds)| Some((text.strip_suffix(unit)?, *seconds)));
        let (number, seconds) = unit.unwrap_or((text, 1.0));
        let length = number.trim().parse::<f64>().ok().map(|n| n * seconds);
        match length.filter(|s| *s > 0.0 && *s <= LONGEST_S) {
            Some(length) => Ok(Self(length)),
            None => Err(RunError::usage(format!(
                "`{text}` is no length of time; write a number above 0 and a unit: 30s, 15m, 1h, 7d or 2w"
            ))),
        }
    }
}

impl TryFrom<String> for Span {
    type Error = RunError;

    fn try_from(text: String) -> Result<Self, RunError> {
        text.parse()
    }
}

impl From<Span> for String {
    fn from(span: Span) -> Self {
        span.to_string()
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = UNITS.iter().find(|(_, seconds)| self.0 % seconds == 0.0);
        let (unit, seconds) = whole.unwrap_or(&("s", 1.0));
        write!(f, "{}{unit}", self.0 / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_back() {
        for (text, seconds, shown) in [
            ("1h", 3600.0, "1h"),
            ("7d", 604_800.0, "1w"),
            ("90 s", 90.0, "90s"),
            ("1.5h", 5400.0, "90m"),
            ("30", 30.0, "30s"),
            ("0.25", 0.25, "0.25s"),
        ] {
            let span: Span = text.parse().unwrap();
            assert_eq!((span.seconds(), span.to_string()), (seconds, shown.to_owned()), "{text}");
            assert_eq!(shown.parse::<Span>().unwrap(), span);
        }
        for bad in ["", "h", "0h", "-1h", "1y", "inf", "nan", "1e99d", "1h30m"] {
            let error = bad.parse::<Span>().unwrap_err();
            assert!(error.to_string().contains("15m") && error.exit_code() == 2, "{bad}: {error}");
        }
    }
}
