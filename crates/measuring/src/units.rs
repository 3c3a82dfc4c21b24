//! Units of length, and lengths with their uncertainty as people write them.

use crate::{MeasuringError, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Unit {
    /// Kilometre.
    Kilometre,
    /// Metre.
    Metre,
    /// Centimetre.
    Centimetre,
    /// Millimetre.
    Millimetre,
    /// Micrometre.
    Micrometre,
    /// Inch of 25.4 mm.
    Inch,
    /// Foot of 12 inches.
    Foot,
    /// Pixel: no length in the world, what is measured without a ruler.
    Pixel,
}

impl Unit {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Kilometre,
        Self::Metre,
        Self::Centimetre,
        Self::Millimetre,
        Self::Micrometre,
        Self::Inch,
        Self::Foot,
        Self::Pixel,
    ];

    /// The symbol, as it stands in names of columns.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Kilometre => "km",
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Micrometre => "um",
            Self::Inch => "in",
            Self::Foot => "ft",
            Self::Pixel => "px",
        }
    }

    /// How many metres it is; none for pixels, which have no length.
    pub const fn metres(self) -> Option<f64> {
        match self {
            Self::Kilometre => Some(1e3),
            Self::Metre => Some(1.0),
            Self::Centimetre => Some(1e-2),
            Self::Millimetre => Some(1e-3),
            Self::Micrometre => Some(1e-6),
            Self::Inch => Some(0.0254),
            Self::Foot => Some(0.3048),
            Self::Pixel => None,
        }
    }
}

/// The symbols of all units, for messages.
pub(crate) fn names() -> String {
    Unit::ALL.map(Unit::symbol).join(", ")
}

impl FromStr for Unit {
    type Err = MeasuringError;

    fn from_str(text: &str) -> Result<Self> {
        let word = text.trim();
        let same = |unit: &Self| unit.symbol() == word || (*unit == Self::Micrometre && matches!(word, "µm" | "μm"));
        Self::ALL.into_iter().find(same).ok_or_else(|| MeasuringError::Unit { given: word.to_owned() })
    }
}

impl TryFrom<String> for Unit {
    type Error = MeasuringError;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<Unit> for String {
    fn from(unit: Unit) -> Self {
        unit.symbol().to_owned()
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

/// A length above 0 with its standard deviation, written `0.50m`, `0.50m+-1mm` or `50 ± 0.1 cm`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Length {
    /// How long, in `unit`. Above 0.
    pub value: f64,
    /// Its standard deviation, in `unit`. 0 or more.
    pub error: f64,
    /// The unit.
    pub unit: Unit,
}

impl Length {
    /// The length and its standard deviation in metres; none in pixels.
    pub fn metres(&self) -> Option<(f64, f64)> {
        self.unit.metres().map(|m| (self.value * m, self.error * m))
    }
}

impl FromStr for Length {
    type Err = MeasuringError;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || MeasuringError::Length { given: text.trim().to_owned() };
        let (value, error) =
            match text.split_once('±').or_else(|| text.split_once("+-")).or_else(|| text.split_once("+/-")) {
                Some((value, error)) => (value, Some(error)),
                None => (text, None),
            };
        let (value, unit) = number_and_unit(value).ok_or_else(wrong)?;
        let (error, error_unit) = match error {
            Some(error) => number_and_unit(error).ok_or_else(wrong)?,
            None => (0.0, ""),
        };
        // "50 ± 0.1 cm" has one unit for both; "0.5m ± 1mm" one each.
        let unit: Unit = if unit.is_empty() { error_unit } else { unit }.parse()?;
        let error_unit = if error_unit.is_empty() { unit } else { error_unit.parse()? };
        let ratio = match (error_unit.metres(), unit.metres()) {
            (Some(a), Some(b)) => a / b,
            (None, None) => 1.0,
            _ => return Err(wrong()),
        };
        let error = error * ratio;
        if !(value > 0.0 && value.is_finite() && error >= 0.0 && error.is_finite()) {
            return Err(wrong());
        }
        Ok(Self { value, error, unit })
    }
}

/// The number that a text begins with, and what follows it.
fn number_and_unit(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    let end = text.find(|c: char| !is_number(c)).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    Some((number.parse().ok()?, unit.trim()))
}

impl TryFrom<String> for Length {
    type Error = MeasuringError;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<Length> for String {
    fn from(length: Length) -> Self {
        length.to_string()
    }
}

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value, error, unit } = self;
        write!(f, "{value}{unit}")?;
        if *error > 0.0 { write!(f, "+-{error}{unit}") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_as_people_write_them() {
        for (text, value, error, unit) in [
            ("0.50m", 0.5, 0.0, Unit::Metre),
            (" 12 cm", 12.0, 0.0, Unit::Centimetre),
            ("0.5m+-1mm", 0.5, 0.001, Unit::Metre),
            ("50 ± 0.1 cm", 50.0, 0.1, Unit::Centimetre),
            ("3µm", 3.0, 0.0, Unit::Micrometre),
            ("2ft +/- 1in", 2.0, 1.0 / 12.0, Unit::Foot),
        ] {
            let found: Length = text.parse().unwrap();
            assert_eq!((found.value, found.unit), (value, unit), "{text}");
            assert!((found.error - error).abs() < 1e-12, "{text}: {found:?}");
            assert_eq!(found.to_string().parse::<Length>().unwrap(), found);
        }
    }

    #[test]
    fn wrong_lengths_and_units_are_named() {
        for text in ["", "m", "0m", "-1m", "1e400m", "0.5", "0.5m+-", "1m+-1px"] {
            assert!(text.parse::<Length>().is_err(), "{text}");
        }
        let message = "5 furlongs".parse::<Length>().unwrap_err().to_string();
        assert!(message.contains("no unit `furlongs`") && message.contains("km, m, cm"), "{message}");
    }
}
