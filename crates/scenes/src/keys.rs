use crate::SceneError;
use std::collections::BTreeMap;

/// Values for a scene's keys, by name; keys left out keep their defaults. Of a key with [`choices`](Key::choices) the value
/// is the number of the choice, from 0.
pub type SceneParams = BTreeMap<String, f64>;

/// Something that can be set in a scene: a number, or one of several words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// The name.
    pub name: &'static str,
    /// What it means, with its unit.
    pub help: &'static str,
    /// Value when not given.
    pub default: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// The words that stand for 0, 1, …; none for a key that takes numbers.
    pub choices: &'static [&'static str],
}

impl Key {
    /// A key that takes numbers.
    pub(crate) const fn number(name: &'static str, help: &'static str, default: f64, min: f64, max: f64) -> Self {
        Self { name, help, default, min, max, choices: &[] }
    }

    /// A key that takes one of `choices`, the first unless given.
    pub(crate) const fn choice(name: &'static str, help: &'static str, choices: &'static [&'static str]) -> Self {
        Self { name, help, default: 0.0, min: 0.0, max: choices.len() as f64 - 1.0, choices }
    }

    /// The value that `text` stands for; its range is checked when the scene is built.
    pub(crate) fn parse(&self, scene: &str, text: &str) -> Result<f64, SceneError> {
        let value = match self.choices {
            [] => text.parse().ok(),
            words => words.iter().position(|w| *w == text).map(|k| k as f64),
        };
        value.ok_or_else(|| self.bad_value(scene, text))
    }

    fn check(&self, scene: &str, value: f64) -> Result<f64, SceneError> {
        let whole = self.choices.is_empty() || value.fract() == 0.0;
        if whole && (self.min..=self.max).contains(&value) {
            Ok(value)
        } else {
            Err(self.bad_value(scene, &value.to_string()))
        }
    }

    fn bad_value(&self, scene: &str, value: &str) -> SceneError {
        SceneError::BadValue {
            scene: scene.to_owned(),
            key: self.name.to_owned(),
            value: value.to_owned(),
            help: self.help,
            allowed: self.allowed(),
        }
    }

    /// What the key takes, in words: `a number from 1 to 5`, `one of line, turn`.
    pub fn allowed(&self) -> String {
        match self.choices {
            [] => format!("a number from {} to {}", self.min, self.max),
            words => format!("one of {}", words.join(", ")),
        }
    }

    /// The default as one would write it.
    pub fn default_text(&self) -> String {
        self.choices.get(self.default as usize).map_or_else(|| self.default.to_string(), |word| (*word).to_owned())
    }
}

/// What a scene is built from: its seed and checked values.
pub(crate) struct Scenery {
    /// The seed.
    pub(crate) seed: u64,
    values: Vec<(&'static str, f64)>,
}

impl Scenery {
    /// The defaults of `keys`, then `params`, whose names have been looked up in `keys`.
    pub(crate) fn new(scene: &str, keys: &[Key], seed: u64, params: &SceneParams) -> Result<Self, SceneError> {
        let value = |key: &Key| match params.get(key.name) {
            Some(&value) => Ok((key.name, key.check(scene, value)?)),
            None => Ok((key.name, key.default)),
        };
        Ok(Self { seed, values: keys.iter().map(value).collect::<Result<_, _>>()? })
    }

    /// The value of the key `name`; zero for a key that the scene does not have (a scene without bars has bar 0).
    pub(crate) fn get(&self, name: &str) -> f64 {
        self.values.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, v)| *v)
    }
}
