//! What kind of thing a detector takes something for.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What kind of thing something is, in a detector's own word: `person`, `car`. Cheap to clone.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct Class(Arc<str>);

impl Class {
    /// The word.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl From<&str> for Class {
    fn from(word: &str) -> Self {
        Self(word.into())
    }
}

impl From<String> for Class {
    fn from(word: String) -> Self {
        Self(word.into())
    }
}

impl From<Class> for String {
    fn from(class: Class) -> Self {
        class.as_str().to_owned()
    }
}

impl std::fmt::Display for Class {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// What the detections of one target were taken for, each counted by its confidence: detectors change their mind from frame
/// to frame, a thing does not.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Classes(Vec<(Class, f64)>);

impl Classes {
    /// Counts a detection.
    pub fn count(&mut self, class: &Class, confidence: f64) {
        match self.0.iter_mut().find(|(known, _)| known == class) {
            Some((_, weight)) => *weight += confidence,
            None => self.0.push((class.clone(), confidence)),
        }
    }

    /// What most speaks for; of equals what came first.
    pub fn most_likely(&self) -> Option<&Class> {
        let best = self.0.iter().reduce(|best, next| if next.1 > best.1 { next } else { best });
        best.map(|(class, _)| class)
    }

    /// Whether a detection of `class` is of something else, as far as both are known.
    pub fn is_other(&self, class: Option<&Class>) -> bool {
        matches!((self.most_likely(), class), (Some(own), Some(class)) if own != class)
    }

    /// Whether the weights can be weights: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        self.0.iter().all(|(_, weight)| weight.is_finite() && *weight >= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confidence_decides_and_of_equals_the_first() {
        let (person, dog): (Class, Class) = ("person".into(), "dog".into());
        let mut classes = Classes::default();
        assert!(classes.most_likely().is_none() && !classes.is_other(Some(&dog)), "nothing is known yet");
        classes.count(&person, 0.5);
        classes.count(&dog, 0.5);
        assert_eq!(classes.most_likely(), Some(&person));
        assert!(classes.is_other(Some(&dog)) && !classes.is_other(Some(&person)) && !classes.is_other(None));
        classes.count(&dog, 0.25);
        assert_eq!(classes.most_likely().map(Class::as_str), Some("dog"));
        assert!(classes.is_sound() && !Classes(vec![(dog, f64::NAN)]).is_sound());
    }

    #[test]
    fn a_class_is_written_as_its_word() {
        let class = Class::from("traffic light");
        assert_eq!(serde_json::to_string(&class).unwrap(), r#""traffic light""#);
        assert_eq!(serde_json::from_str::<Class>(r#""traffic light""#).unwrap(), class);
    }
}
