use super::{Kind, Zone};
use crate::RunError;
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// What of a box must be in a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Anchor {
    /// The middle of its lower edge: where somebody stands.
    #[default]
    Foot,
    /// Its middle.
    Center,
}

impl Anchor {
    pub(super) fn of(self, bbox: BBox) -> Point {
        match self {
            Self::Foot => Point::new(bbox.center().x, bbox.bottom()),
            Self::Center => bbox.center(),
        }
    }
}

crate::config::options::options! {
    /// What of what happens is told and kept; what is absent has its default.
    pub struct EventOptions {
        /// Whether `events.jsonl` is written. By default where there are zones or clips.
        pub file: Option<bool>,
        /// Polygons with names in pixels of the input, each `NAME=X,Y,X,Y,X,Y…`.
        pub zones: Vec<String>,
        /// What of a box must be in a zone: `foot`, the middle of its lower edge, or `center`. By default `foot`.
        pub anchor: Option<Anchor>,
        /// For how long a target must be seen before it is told to have appeared, seconds ≥ 0. By default 0.5.
        pub appear_s: Option<f64>,
        /// After how long without being seen a target counts as present no more, seconds ≥ 0. By default 2.
        pub unseen_s: Option<f64>,
        /// For how long a target must be in a zone before it has entered, seconds ≥ 0. By default 0.5.
        pub enter_s: Option<f64>,
        /// For how long a target must be outside before it has left, seconds ≥ 0. By default 1.
        pub leave_s: Option<f64>,
        /// How far outside a target must be to be outside after it was inside, as a part of its box's shorter side, ≥ 0. By
        /// default 0.1.
        pub margin: Option<f64>,
        /// After how long in a zone that is told, seconds > 0. By default 10.
        pub dwell_s: Option<f64>,
        /// Whether clips and pictures of events are made.
        pub clips: Option<bool>,
        /// The events that they are of. By default `enter` where there are zones, else `appear`.
        pub clip_on: Vec<String>,
        /// How long a clip begins before its event, seconds from 0 to 60. By default 5.
        pub before_s: Option<f64>,
        /// How long it goes on after its last event, seconds from 0 to 600. By default 5.
        pub after_s: Option<f64>,
        /// The longest that a clip goes on after its first event, seconds from 1 to 3600; what comes then is in the next. By
        /// default 60.
        pub longest_s: Option<f64>,
    }
}

/// The same, checked and with its defaults.
#[derive(Debug, Clone)]
pub(crate) struct EventRules {
    pub zones: Vec<Zone>,
    pub anchor: Anchor,
    pub in_sight_s: [f64; 2],
    pub in_zone_s: [f64; 2],
    pub margin: f64,
    pub dwell_s: f64,
    pub file: bool,
    pub clips: Option<ClipRules>,
}

/// What clips are of, and how long they are.
#[derive(Debug, Clone)]
pub(crate) struct ClipRules {
    pub on: Vec<Kind>,
    #[cfg_attr(not(feature = "encode"), expect(dead_code, reason = "what is recorded needs an encoder"))]
    pub before_s: f64,
    pub after_s: f64,
    pub longest_s: f64,
}

impl EventOptions {
    /// With defaults where nothing is said.
    ///
    /// # Errors
    /// [`RunError::Usage`] naming what makes no sense.
    pub(crate) fn rules(&self) -> Result<EventRules, RunError> {
        let zones: Vec<Zone> = self.zones.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        let mut names: Vec<&str> = zones.iter().map(|zone| &*zone.name).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(RunError::usage(format!("there are two zones called `{}`", pair[0])));
        }
        let clips = match self.clips {
            Some(true) => Some(self.clip_rules(!zones.is_empty())?),
            _ => None,
        };
        let within = |value: Option<f64>, otherwise, range, name| within(value, otherwise, range, name);
        Ok(EventRules {
            anchor: self.anchor.unwrap_or_default(),
            in_sight_s: [
                within(self.appear_s, 0.5, [0.0, 3600.0], "appear_s")?,
                within(self.unseen_s, 2.0, [0.0, 3600.0], "unseen_s")?,
            ],
            in_zone_s: [
                within(self.enter_s, 0.5, [0.0, 3600.0], "enter_s")?,
                within(self.leave_s, 1.0, [0.0, 3600.0], "leave_s")?,
            ],
            margin: within(self.margin, 0.1, [0.0, 10.0], "margin")?,
            dwell_s: within(self.dwell_s, 10.0, [0.001, 1e7], "dwell_s")?,
            file: self.file.unwrap_or(!zones.is_empty() || clips.is_some()),
            zones,
            clips,
        })
    }

    fn clip_rules(&self, has_zones: bool) -> Result<ClipRules, RunError> {
        if let Some(why) = crate::NO_OVERLAY {
            return Err(RunError::usage(format!("no clips of events: {why}")));
        }
        let on: Vec<Kind> = self.clip_on.iter().map(|word| word.parse()).collect::<Result<_, _>>()?;
        Ok(ClipRules {
            on: match (on.is_empty(), has_zones) {
                (false, _) => on,
                (true, true) => vec![Kind::Enter],
                (true, false) => vec![Kind::Appear],
            },
            before_s: within(self.before_s, 5.0, [0.0, 60.0], "before_s")?,
            after_s: within(self.after_s, 5.0, [0.0, 600.0], "after_s")?,
            longest_s: within(self.longest_s, 60.0, [1.0, 3600.0], "longest_s")?,
        })
    }
}

fn within(value: Option<f64>, otherwise: f64, [least, most]: [f64; 2], name: &str) -> Result<f64, RunError> {
    let value = value.unwrap_or(otherwise);
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(RunError::usage(format!("`{name}` of `events` is {value}; it goes from {least} to {most}")))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn rules(text: &str) -> Result<EventRules, RunError> {
        toml::from_str::<EventOptions>(text).unwrap().rules()
    }

    #[test]
    fn what_is_not_said_has_its_default() {
        let nothing = rules("").unwrap();
        assert!(!nothing.file && nothing.clips.is_none() && nothing.zones.is_empty());
        let zoned = rules("zones = ['a=0,0,1,0,1,1']").unwrap();
        assert!(zoned.file && zoned.zones.len() == 1);
        if crate::NO_OVERLAY.is_none() {
            assert_eq!(rules("clips = true").unwrap().clips.unwrap().on, [Kind::Appear]);
            let both = rules("clips = true\nzones = ['a=0,0,1,0,1,1']").unwrap();
            assert_eq!(both.clips.unwrap().on, [Kind::Enter]);
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for (text, word) in [
            ("zones = ['a=0,0,1,0,1,1', 'a=0,0,2,0,2,2']", "two zones called `a`"),
            ("unseen_s = -1.0", "`unseen_s`"),
            ("dwell_s = 0.0", "`dwell_s`"),
            ("margin = nan", "`margin`"),
            ("clips = true\nbefore_s = 61.0", "`before_s`"),
            ("clips = true\nclip_on = ['entry']", "appear, enter"),
        ] {
            if text.starts_with("clips") && crate::NO_OVERLAY.is_some() {
                continue;
            }
            let error = rules(text).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(word), "{error}");
        }
    }
}
