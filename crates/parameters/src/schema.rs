//! What a parameter is, as a value: read by the command line, configuration files, documentation and user interfaces.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::{RangeFrom, RangeInclusive};
use std::path::Path;

/// One parameter: name, type, range, unit, source, meaning and default.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name within its group.
    pub name: &'static str,
    /// Its type and what it may be.
    #[serde(flatten)]
    pub kind: Kind,
    /// Its unit, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// Where its default or its meaning comes from: a paper's key with section or equation; `ours` where it is our own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<&'static str>,
    /// The models of its group that have it; empty: all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<&'static str>,
    /// What it means, one or a few sentences.
    pub doc: String,
    /// The value it has unless the user gives another; none for groups, whose parameters have their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<toml::Value>,
}

/// The type of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Kind {
    /// A finite number.
    Number(Bounds),
    /// A whole number.
    Integer(Bounds),
    /// True or false.
    Flag,
    /// One of several words.
    Choice {
        /// The words.
        choices: Vec<&'static str>,
    },
    /// Any text.
    Text,
    /// The name of a file or folder of the machine that follows; empty for none.
    File,
    /// Several values.
    List {
        /// How many, where that is given.
        #[serde(skip_serializing_if = "Option::is_none")]
        length: Option<usize>,
        /// What each is.
        each: Box<Kind>,
    },
    /// A group with parameters of its own: a table in TOML.
    Group {
        /// They.
        parameters: Vec<Parameter>,
    },
}

impl Kind {
    /// The value that `text` stands for. A text that cannot be read as this kind stays a text: whoever takes the value then
    /// says what it must be.
    pub fn read(&self, text: &str) -> toml::Value {
        let read = match self {
            Self::Number(_) => text.parse().ok().map(toml::Value::Float),
            Self::Integer(_) => text.parse().ok().map(toml::Value::Integer),
            Self::Flag => match text {
                "true" | "1" => Some(true.into()),
                "false" | "0" => Some(false.into()),
                _ => None,
            },
            Self::Choice { .. } | Self::Text | Self::File | Self::List { .. } | Self::Group { .. } => None,
        };
        read.unwrap_or_else(|| text.into())
    }
}

/// The range of a number. Made from a Rust range (`0.0..=1.0`, `2..=16`, `0.0..`) or by [`above`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Bounds {
    /// Least value allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum: Option<f64>,
    /// Values must lie above this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exclusive_minimum: Option<f64>,
    /// Greatest value allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum: Option<f64>,
    /// Values must lie below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exclusive_maximum: Option<f64>,
    /// Values are the minimum plus a multiple of this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
}

/// Values above `low`, which is not allowed itself.
pub const fn above(low: f64) -> Bounds {
    Bounds { minimum: None, exclusive_minimum: Some(low), maximum: None, exclusive_maximum: None, step: None }
}

impl Bounds {
    /// The same, and no greater than `high`.
    #[must_use]
    pub const fn at_most(self, high: f64) -> Self {
        Self { maximum: Some(high), ..self }
    }

    /// The same, and below `high`.
    #[must_use]
    pub const fn below(self, high: f64) -> Self {
        Self { exclusive_maximum: Some(high), ..self }
    }

    /// The same, in steps from the minimum.
    #[must_use]
    pub const fn in_steps_of(self, step: f64) -> Self {
        Self { step: Some(step), ..self }
    }

    /// Whether `value` is allowed; what is not finite never is.
    pub fn allow(&self, value: f64) -> bool {
        let on_step = |step: f64| {
            let steps = (value - self.minimum.unwrap_or(0.0)) / step;
            (steps - steps.round()).abs() < 1e-9
        };
        value.is_finite()
            && self.minimum.is_none_or(|low| value >= low)
            && self.exclusive_minimum.is_none_or(|low| value > low)
            && self.maximum.is_none_or(|high| value <= high)
            && self.exclusive_maximum.is_none_or(|high| value < high)
            && self.step.is_none_or(on_step)
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.minimum, self.exclusive_minimum, self.maximum, self.exclusive_maximum) {
            (Some(low), None, Some(high), None) => write!(f, "between {low} and {high}")?,
            (Some(low), None, None, None) => write!(f, "at least {low}")?,
            (Some(low), None, None, Some(high)) => write!(f, "at least {low} and below {high}")?,
            (None, Some(low), None, None) => write!(f, "above {low}")?,
            (None, Some(low), Some(high), None) => write!(f, "above {low} and at most {high}")?,
            (None, Some(low), None, Some(high)) => write!(f, "above {low} and below {high}")?,
            (None, None, Some(high), None) => write!(f, "at most {high}")?,
            (None, None, None, Some(high)) => write!(f, "below {high}")?,
            _ => write!(f, "a finite number")?,
        }
        match (self.step, self.minimum) {
            (Some(step), Some(low)) => write!(f, ", {low} plus a multiple of {step}"),
            (Some(step), None) => write!(f, ", a multiple of {step}"),
            (None, _) => Ok(()),
        }
    }
}

impl From<RangeInclusive<f64>> for Bounds {
    fn from(range: RangeInclusive<f64>) -> Self {
        Self { minimum: Some(*range.start()), maximum: Some(*range.end()), ..Self::default() }
    }
}

impl From<RangeFrom<f64>> for Bounds {
    fn from(range: RangeFrom<f64>) -> Self {
        Self { minimum: Some(range.start), ..Self::default() }
    }
}

impl From<RangeInclusive<i32>> for Bounds {
    fn from(range: RangeInclusive<i32>) -> Self {
        (f64::from(*range.start())..=f64::from(*range.end())).into()
    }
}

impl From<RangeFrom<i32>> for Bounds {
    fn from(range: RangeFrom<i32>) -> Self {
        (f64::from(range.start)..).into()
    }
}

/// The word among `choices` that `value` gives, as its place there.
///
/// # Errors
/// What is wrong with any other value, in words that follow the parameter's name.
pub fn choice(choices: &[&str], value: &toml::Value) -> Result<usize, String> {
    let word = value.as_str().ok_or_else(|| wrong_type(value, "a word"))?;
    let unknown = || format!("unknown variant `{word}`, expected one of {}", choices.join(", "));
    choices.iter().position(|c| *c == word).ok_or_else(unknown)
}

/// A type that a parameter may have.
pub trait Field {
    /// Its kind; `bounds` is the range the declaration gives.
    fn kind(&self, bounds: Bounds) -> Kind;

    /// The value as TOML; none for a group, whose parameters have their own.
    fn value(&self) -> Option<toml::Value>;

    /// What is wrong with this value, in words that follow the parameter's name, and the rest of the path to it within a
    /// group.
    ///
    /// # Errors
    /// The path below this parameter (empty for a plain value) and what would be right.
    fn check(&self, bounds: &Bounds) -> Result<(), (String, String)>;

    /// Takes `value`; `rest` is the path to it below this parameter, empty but for groups. Ranges are not looked at.
    ///
    /// # Errors
    /// What is wrong with a value of another type, in words that follow the parameter's name.
    fn set(&mut self, rest: &str, value: &toml::Value) -> Result<(), String>;

    /// The paths by which `rest`, a path below this parameter that a former version knew, is known now, below it as well; none
    /// where it is no former one.
    fn renamed(&self, _rest: &str) -> Option<Vec<String>> {
        None
    }
}

/// What a declaration says of a parameter beside its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Declared {
    /// Its name.
    pub name: &'static str,
    /// What it means.
    pub doc: String,
    /// Its range.
    pub bounds: Bounds,
    /// Its unit.
    pub unit: Option<&'static str>,
    /// Its source.
    pub source: Option<&'static str>,
    /// The models of its group that have it; empty: all.
    pub models: Vec<&'static str>,
}

/// The schema of declared parameters whose values are `fields`.
pub fn schema_of(declared: Vec<Declared>, fields: &[&dyn Field]) -> Vec<Parameter> {
    let parameter = |(declared, field): (Declared, &&dyn Field)| {
        let Declared { name, doc, bounds, unit, source, models } = declared;
        Parameter { name, kind: field.kind(bounds), unit, source, models, doc, default: field.value() }
    };
    declared.into_iter().zip(fields).map(parameter).collect()
}

/// Checks the ranges of declared parameters whose values are `fields`.
///
/// # Errors
/// The path of the first parameter out of range, and what would be right.
pub fn check_ranges(declared: &[Declared], fields: &[&dyn Field]) -> Result<(), (String, String)> {
    for (declared, field) in declared.iter().zip(fields) {
        field.check(&declared.bounds).map_err(|(rest, problem)| {
            let path = if rest.is_empty() { declared.name.to_owned() } else { format!("{}.{rest}", declared.name) };
            (path, problem)
        })?;
    }
    Ok(())
}

/// Gives the one of `fields`, named like `names`, to which `path` leads the value `value`.
///
/// # Errors
/// As [`Field::set`], and for a path that leads nowhere.
pub fn set_field(names: &[&str], fields: Vec<&mut dyn Field>, path: &str, value: &toml::Value) -> Result<(), String> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    match names.iter().zip(fields).find(|(name, _)| **name == first) {
        Some((_, field)) => field.set(rest, value),
        None => Err(super::tables::unknown(first, names)),
    }
}

/// The paths of today for the former one `path` of a struct whose `fields` are called `names`: by `renames` of its own, in which
/// a path stands for all below it, or by those of a group.
pub fn renamed_in(
    renames: &[(&str, &[&str])],
    names: &[&str],
    fields: &[&dyn Field],
    path: &str,
) -> Option<Vec<String>> {
    let own = renames.iter().find_map(|(old, new)| {
        let rest = path.strip_prefix(old).filter(|rest| rest.is_empty() || rest.starts_with('.'))?;
        Some(new.iter().map(|new| format!("{new}{rest}")).collect())
    });
    own.or_else(|| {
        let (first, rest) = path.split_once('.')?;
        let (_, field) = names.iter().zip(fields).find(|(name, _)| **name == first)?;
        Some(field.renamed(rest)?.into_iter().map(|new| format!("{first}.{new}")).collect())
    })
}

/// The message for a value of another type.
pub(super) fn wrong_type(value: &toml::Value, expected: &str) -> String {
    format!("invalid type: {}, expected {expected}", value.type_str())
}

fn check_number(value: f64, bounds: &Bounds) -> Result<(), (String, String)> {
    if bounds.allow(value) {
        return Ok(());
    }
    let limits = if *bounds == Bounds::default() { "a finite number".to_owned() } else { bounds.to_string() };
    Err((String::new(), format!("must be {limits}, not {value}")))
}

macro_rules! number_fields {
    ($($type:ty => $kind:ident, $read:expr);* $(;)?) => {$(
        impl Field for $type {
            fn kind(&self, bounds: Bounds) -> Kind {
                Kind::$kind(bounds)
            }

            fn value(&self) -> Option<toml::Value> {
                toml::Value::try_from(self).ok()
            }

            fn check(&self, bounds: &Bounds) -> Result<(), (String, String)> {
                check_number(*self as f64, bounds)
            }

            fn set(&mut self, _: &str, value: &toml::Value) -> Result<(), String> {
                let read: fn(&toml::Value) -> Result<$type, String> = $read;
                *self = read(value)?;
                Ok(())
            }
        }
    )*};
}

number_fields! {
    f64 => Number, f64_of;
    f32 => Number, |value| f64_of(value).map(|number| number as f32);
    u8 => Integer, whole;
    usize => Integer, whole;
    u32 => Integer, whole;
    u64 => Integer, whole;
}

fn f64_of(value: &toml::Value) -> Result<f64, String> {
    match value {
        toml::Value::Float(number) => Ok(*number),
        toml::Value::Integer(number) => Ok(*number as f64),
        other => Err(wrong_type(other, "a number")),
    }
}

fn whole<T: TryFrom<i64>>(value: &toml::Value) -> Result<T, String> {
    let toml::Value::Integer(number) = value else { return Err(wrong_type(value, "a whole number")) };
    T::try_from(*number).map_err(|_| format!("cannot be {number}"))
}

impl Field for bool {
    fn kind(&self, _: Bounds) -> Kind {
        Kind::Flag
    }

    fn value(&self) -> Option<toml::Value> {
        Some((*self).into())
    }

    fn check(&self, _: &Bounds) -> Result<(), (String, String)> {
        Ok(())
    }

    fn set(&mut self, _: &str, value: &toml::Value) -> Result<(), String> {
        *self = value.as_bool().ok_or_else(|| wrong_type(value, "true or false"))?;
        Ok(())
    }
}

/// The name of a file or folder. What is reached from elsewhere, such as a page, may hold it to a folder.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FileName(pub String);

impl FileName {
    /// The path; none where nothing is named.
    pub fn path(&self) -> Option<&Path> {
        (!self.0.is_empty()).then(|| Path::new(&self.0))
    }
}

impl Field for FileName {
    fn kind(&self, _: Bounds) -> Kind {
        Kind::File
    }

    fn value(&self) -> Option<toml::Value> {
        self.0.value()
    }

    fn check(&self, bounds: &Bounds) -> Result<(), (String, String)> {
        self.0.check(bounds)
    }

    fn set(&mut self, path: &str, value: &toml::Value) -> Result<(), String> {
        self.0.set(path, value)
    }
}

impl Field for String {
    fn kind(&self, _: Bounds) -> Kind {
        Kind::Text
    }

    fn value(&self) -> Option<toml::Value> {
        Some(self.clone().into())
    }

    fn check(&self, _: &Bounds) -> Result<(), (String, String)> {
        Ok(())
    }

    fn set(&mut self, _: &str, value: &toml::Value) -> Result<(), String> {
        value.as_str().ok_or_else(|| wrong_type(value, "a text"))?.clone_into(self);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_allow_what_they_say() {
        let cases: [(Bounds, &[f64], &[f64], &str); 8] = [
            ((0.0..=1.0).into(), &[0.0, 0.5, 1.0], &[-0.1, 1.1, f64::NAN], "between 0 and 1"),
            ((2..=16).into(), &[2.0, 16.0], &[1.0, 17.0], "between 2 and 16"),
            ((3..).into(), &[3.0, 1e9], &[2.0, f64::INFINITY], "at least 3"),
            (above(0.0), &[1e-9], &[0.0, -1.0], "above 0"),
            (above(1.0).at_most(2.0), &[1.1, 2.0], &[1.0, 2.1], "above 1 and at most 2"),
            (above(0.0).below(1.0), &[0.5], &[0.0, 1.0], "above 0 and below 1"),
            (
                Bounds::from(1..=63).in_steps_of(2.0),
                &[1.0, 63.0],
                &[2.0, 65.0],
                "between 1 and 63, 1 plus a multiple of 2",
            ),
            (Bounds::default().at_most(4.0), &[-1e9, 4.0], &[4.5], "at most 4"),
        ];
        for (bounds, inside, outside, words) in cases {
            assert!(inside.iter().all(|v| bounds.allow(*v)), "{bounds:?}");
            assert!(outside.iter().all(|v| !bounds.allow(*v)), "{bounds:?}");
            assert_eq!(bounds.to_string(), words);
        }
    }
}
