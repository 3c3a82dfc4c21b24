//! Parameters of trackers and detectors: typed structs that describe themselves.
//!
//! A `params.rs` declares its struct with [`parameters!`](crate::parameters!); names, defaults and documentation then
//! stand in one place, and the command line, configuration files and the commented TOML all read them from there.

use crate::{Result, TrackingError};
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Write;

/// A struct of parameters that knows its names, its defaults and what each means.
pub trait Parameters: Clone + Default + Serialize + DeserializeOwned + 'static {
    /// Name of the tracker or detector they belong to.
    const OWNER: &'static str;

    /// Name and documentation of each parameter, in order of declaration.
    fn documentation() -> &'static [(&'static str, &'static str)];

    /// Refuses values that make no sense.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] that names the first bad one and its range.
    fn validate(&self) -> Result<()>;

    /// The defaults with the values of `table` in their place.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for an unknown name, a value of the wrong type or out of range.
    fn from_table(table: toml::Table) -> Result<Self> {
        let known = Self::documentation();
        if let Some(name) = table.keys().find(|k| known.iter().all(|(n, _)| n != k)) {
            let names: Vec<_> = known.iter().map(|(n, _)| *n).collect();
            return Err(bad::<Self>(name, format!("there is no such parameter; there are: {}", names.join(", "))));
        }
        // One at a time, so that an error names the parameter it belongs to.
        for (name, value) in &table {
            let alone = toml::Table::from_iter([(name.clone(), value.clone())]);
            alone.try_into::<Self>().map_err(|e| bad::<Self>(name, e.message().trim().to_owned()))?;
        }
        let params: Self = table.try_into().map_err(|e: toml::de::Error| bad::<Self>("", e.message().to_owned()))?;
        params.validate()?;
        Ok(params)
    }

    /// Every parameter with its value.
    ///
    /// # Errors
    /// When a value cannot be written as TOML.
    fn to_table(&self) -> Result<toml::Table> {
        toml::Table::try_from(self).map_err(|e| bad::<Self>("", e.to_string()))
    }

    /// The defaults as commented TOML, ready to be edited.
    ///
    /// # Errors
    /// When a default cannot be written as TOML.
    fn template() -> Result<String> {
        let table = Self::default().to_table()?;
        let mut text = String::new();
        for (name, documentation) in Self::documentation() {
            let comment =
                documentation.trim_end().lines().map(|l| format!("#{}", l.trim_end())).collect::<Vec<_>>().join("\n");
            let line = match table.get(*name) {
                Some(value) => format!("{name} = {value}"),
                None => format!("# {name} ="),
            };
            // Writing to a string cannot fail.
            let _ = write!(text, "{comment}\n{line}\n\n");
        }
        Ok(text)
    }

    /// An error about the parameter called `name`, for [`validate`](Self::validate).
    fn reject(name: &str, problem: impl Into<String>) -> TrackingError {
        bad::<Self>(name, problem.into())
    }
}

fn bad<P: Parameters>(name: &str, problem: String) -> TrackingError {
    TrackingError::Parameter { owner: P::OWNER, name: name.to_owned(), problem }
}

/// Declares a struct of parameters: fields with documentation and default.
///
/// ```
/// pursuit_tracking::parameters! {
///     /// Parameters of the example tracker.
///     pub struct ExampleParams for "example" {
///         /// Learning rate η, in `[0, 1]` (bolme2010, eq. 10).
///         pub learning_rate: f64 = 0.125,
///     }
///     validate(self) {
///         if !(0.0..=1.0).contains(&self.learning_rate) {
///             return Err(Self::reject("learning_rate", "must be between 0 and 1"));
///         }
///     }
/// }
/// use pursuit_tracking::parameters::Parameters;
/// assert!(ExampleParams::template().unwrap().contains("learning_rate = 0.125"));
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$outer:meta])*
        pub struct $name:ident for $owner:literal {
            $($(#[doc = $doc:literal])+ pub $field:ident : $type:ty = $default:expr,)+
        }
        validate($this:ident) $check:block
    ) => {
        $(#[$outer])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[doc = $doc])+ pub $field: $type,)+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        impl $crate::parameters::Parameters for $name {
            const OWNER: &'static str = $owner;

            fn documentation() -> &'static [(&'static str, &'static str)] {
                &[$((stringify!($field), concat!($($doc, "\n"),+)),)+]
            }

            fn validate(&$this) -> $crate::Result<()> {
                $check
                Ok(())
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::parameters! {
        /// For the tests.
        pub struct Toy for "toy" {
            /// A rate, in `[0, 1]`.
            pub rate: f64 = 0.5,
            /// A word.
            /// With a second line.
            pub word: String = "a \"b\"".into(),
        }
        validate(self) {
            if !(0.0..=1.0).contains(&self.rate) {
                return Err(Self::reject("rate", "must be between 0 and 1"));
            }
        }
    }

    #[test]
    fn the_template_reads_back_as_the_defaults() {
        let text = Toy::template().unwrap();
        assert!(text.contains("# A word.\n# With a second line.\nword = "), "{text}");
        assert_eq!(Toy::from_table(text.parse().unwrap()).unwrap(), Toy::default());
    }

    #[test]
    fn errors_name_the_parameter_and_what_would_be_right() {
        let error = |text: &str| Toy::from_table(text.parse().unwrap()).unwrap_err().to_string();
        assert!(error("speed = 1").contains("`speed` of `toy`: there is no such parameter; there are: rate, word"));
        assert!(error("rate = 2").contains("`rate` of `toy`: must be between 0 and 1"));
        assert!(error("rate = 'x'").contains("`rate` of `toy`: invalid type"), "{}", error("rate = 'x'"));
    }
}
