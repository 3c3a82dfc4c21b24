use crate::Direction;
use pursuit_parameters::{Bounds, Field, Kind, Value};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What a zone says of the directions in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The optical axis keeps within the zones of this kind, where there are any.
    Allowed,
    /// The optical axis keeps out.
    Forbidden,
    /// No part of the picture shows it.
    Private,
}

impl Rule {
    const ALL: [Self; 3] = [Self::Allowed, Self::Forbidden, Self::Private];

    const fn word(self) -> &'static str {
        match self {
            Self::Allowed => "allowed",
            Self::Forbidden => "forbidden",
            Self::Private => "private",
        }
    }
}

/// A range of pans and tilts, as the head counts them, and what holds there. Written `private pan -30..10 tilt -20..20`; an axis
/// that is not named is meant whole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Zone {
    /// What holds there.
    pub rule: Rule,
    /// The least and the greatest pan, degrees.
    pub pan_deg: (f64, f64),
    /// The least and the greatest tilt, degrees.
    pub tilt_deg: (f64, f64),
}

impl Zone {
    /// An axis as far as any head goes, degrees.
    const WHOLE: (f64, f64) = (-1e6, 1e6);

    /// Whether a direction lies in it; `edges` says whether its edges count.
    pub(super) fn holds(&self, direction: Direction, edges: bool) -> bool {
        let within = |value: f64, (least, most): (f64, f64)| {
            if edges { (least..=most).contains(&value) } else { least < value && value < most }
        };
        within(direction.pan_deg, self.pan_deg) && within(direction.tilt_deg, self.tilt_deg)
    }

    /// The zone with this much more to each side.
    pub(super) fn grown(self, by: Direction) -> Self {
        let wider = |(least, most): (f64, f64), by: f64| (least - by, most + by);
        Self { pan_deg: wider(self.pan_deg, by.pan_deg), tilt_deg: wider(self.tilt_deg, by.tilt_deg), ..self }
    }
}

impl fmt::Display for Zone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.rule.word())?;
        for (axis, range) in [("pan", self.pan_deg), ("tilt", self.tilt_deg)] {
            if range != Self::WHOLE {
                write!(f, " {axis} {}..{}", range.0, range.1)?;
            }
        }
        Ok(())
    }
}

impl FromStr for Zone {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is no zone; one is written `private pan -30..10 tilt -20..20` (allowed, forbidden or private)"
            )
        };
        let mut words = text.split_whitespace();
        let rule = words.next().and_then(|word| Rule::ALL.into_iter().find(|rule| rule.word() == word));
        let mut zone = Self { rule: rule.ok_or_else(wrong)?, pan_deg: Self::WHOLE, tilt_deg: Self::WHOLE };
        while let Some(axis) = words.next() {
            let (least, most) = words.next().and_then(|range| range.split_once("..")).ok_or_else(wrong)?;
            let number = |text: &str| text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(wrong);
            let range = (number(least)?, number(most)?);
            if range.0 >= range.1 {
                return Err(format!("`{text}`: a range goes from the lower to the higher number"));
            }
            match axis {
                "pan" => zone.pan_deg = range,
                "tilt" => zone.tilt_deg = range,
                _ => return Err(wrong()),
            }
        }
        if zone.pan_deg == Self::WHOLE && zone.tilt_deg == Self::WHOLE {
            return Err(format!("`{text}` names neither pan nor tilt"));
        }
        Ok(zone)
    }
}

impl TryFrom<String> for Zone {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Zone> for String {
    fn from(zone: Zone) -> Self {
        zone.to_string()
    }
}

/// Zones, as a list of texts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ZoneList(pub Vec<Zone>);

impl ZoneList {
    /// The most zones: the way around them is looked for at every command.
    pub const MOST: usize = 8;
}

impl Field for ZoneList {
    fn kind(&self, bounds: Bounds) -> Kind {
        Kind::List { length: None, each: Box::new(String::new().kind(bounds)) }
    }

    fn value(&self) -> Option<Value> {
        Some(Value::Array(self.0.iter().map(|zone| zone.to_string().into()).collect()))
    }

    fn check(&self, _: &Bounds) -> Result<(), (String, String)> {
        if self.0.len() <= Self::MOST {
            return Ok(());
        }
        Err((String::new(), format!("at most {} zones", Self::MOST)))
    }

    fn set(&mut self, _: &str, value: &Value) -> Result<(), String> {
        let texts = value.as_array().ok_or_else(|| "invalid type: expected a list of zones".to_owned())?;
        let zone = |text: &Value| text.as_str().ok_or_else(|| "a zone is a text".to_owned())?.parse();
        self.0 = texts.iter().map(zone).collect::<Result<_, String>>()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_are_read_as_they_are_written() {
        for text in ["private pan -30..10 tilt -20..20.5", "forbidden pan 50..80", "allowed tilt 0..30"] {
            assert_eq!(text.parse::<Zone>().unwrap().to_string(), text);
        }
        for bad in [
            "",
            "private",
            "secret pan 1..2",
            "allowed pan 2..1",
            "allowed pan 1..1",
            "allowed pan 1",
            "allowed pan nan..2",
            "allowed yaw 1..2",
            "allowed pan 1..2 tilt",
        ] {
            assert!(bad.parse::<Zone>().is_err(), "{bad}");
        }
    }
}
