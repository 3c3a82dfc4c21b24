//! The macros that declare parameters.

/// Declares a struct of parameters. Each field states type, default and meaning, and, where it has them, range (`in`), unit
/// and source. A field whose type is itself such a struct is a group. `ordered` lists pairs of which the first must not
/// exceed the second.
///
/// ```
/// use pursuit_tracking::parameters::{Parameters, above, template};
/// pursuit_tracking::parameters! {
///     /// Parameters of the example tracker.
///     pub struct ExampleParams {
///         /// Share of the new frame, η.
///         pub learning_rate: f64 = 0.125, in 0.0..=1.0, source "bolme2010, eq. 10";
///         /// Standard deviation of the label.
///         pub label_sigma: f64 = 2.0, in above(0.0), unit "px";
///     }
/// }
/// assert!(template(&ExampleParams::default().schema()).contains("learning_rate = 0.125"));
/// let error = ExampleParams::default().with("example", &"learning_rate = 2".parse().unwrap()).unwrap_err();
/// assert!(error.to_string().contains("must be between 0 and 1"));
/// ```
#[macro_export]
macro_rules! parameters {
    (@or $default:expr) => { $default };
    (@or $default:expr, $given:expr) => { $given };
    (
        $(#[$attribute:meta])*
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $field_vis:vis $field:ident : $type:ty = $default:expr
                $(, in $range:expr)? $(, unit $unit:literal)? $(, source $source:literal)? ;
            )*
        }
        $(ordered { $($low:ident <= $high:ident),* $(,)? })?
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        $vis struct $name {
            $($(#[doc = $doc])+ $field_vis $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $name {
            fn declared() -> Vec<$crate::parameters::Declared> {
                #[allow(unused_imports)]
                use $crate::parameters::{Bounds, above};
                vec![$($crate::parameters::Declared {
                    name: stringify!($field),
                    doc: $crate::parameters::describe(&[$($doc),+]),
                    bounds: $crate::parameters!(@or Bounds::default() $(, Bounds::from($range))?),
                    unit: $crate::parameters!(@or None $(, Some($unit))?),
                    source: $crate::parameters!(@or None $(, Some($source))?),
                }),*]
            }

            fn fields(&self) -> Vec<&dyn $crate::parameters::Field> {
                vec![$(&self.$field),*]
            }

            fn fields_mut(&mut self) -> Vec<&mut dyn $crate::parameters::Field> {
                vec![$(&mut self.$field),*]
            }
        }

        impl $crate::parameters::Parameters for $name {
            fn schema(&self) -> Vec<$crate::parameters::Parameter> {
                $crate::parameters::schema_of(Self::declared(), &self.fields())
            }

            fn check_all(&self) -> ::core::result::Result<(), (String, String)> {
                $crate::parameters::check_ranges(&Self::declared(), &self.fields())?;
                $($(
                    if self.$low > self.$high {
                        let problem = concat!("must not exceed `", stringify!($high), "`");
                        return Err((stringify!($low).to_owned(), format!("{problem}, which is {}", self.$high)));
                    }
                )*)?
                Ok(())
            }

            fn set(&mut self, path: &str, value: &$crate::parameters::Value) -> ::core::result::Result<(), String> {
                $crate::parameters::set_field(&[$(stringify!($field)),*], self.fields_mut(), path, value)
            }
        }

        impl $crate::parameters::Field for $name {
            fn kind(&self, _: $crate::parameters::Bounds) -> $crate::parameters::Kind {
                $crate::parameters::Kind::Group { parameters: $crate::parameters::Parameters::schema(self) }
            }

            fn value(&self) -> Option<$crate::parameters::Value> {
                None
            }

            fn check(&self, _: &$crate::parameters::Bounds) -> ::core::result::Result<(), (String, String)> {
                $crate::parameters::Parameters::check_all(self)
            }

            fn set(&mut self, rest: &str, value: &$crate::parameters::Value) -> ::core::result::Result<(), String> {
                $crate::parameters::Parameters::set(self, rest, value)
            }
        }
    };
}

/// Declares an enum whose variants are words of a parameter.
#[macro_export]
macro_rules! choices {
    (
        $(#[$attribute:meta])*
        $vis:vis enum $name:ident {
            $($(#[doc = $doc:literal])+ $variant:ident = $word:literal),+ $(,)?
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, ::serde::Serialize, ::serde::Deserialize)]
        $vis enum $name {
            $($(#[doc = $doc])+ #[serde(rename = $word)] $variant),+
        }

        impl $name {
            /// All of them, in order of declaration.
            $vis const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The word used in files.
            $vis const fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $word),+ }
            }
        }

        impl $crate::parameters::Field for $name {
            fn kind(&self, _: $crate::parameters::Bounds) -> $crate::parameters::Kind {
                $crate::parameters::Kind::Choice { choices: Self::ALL.iter().map(|c| c.as_str()).collect() }
            }

            fn value(&self) -> Option<$crate::parameters::Value> {
                Some(self.as_str().into())
            }

            fn check(&self, _: &$crate::parameters::Bounds) -> ::core::result::Result<(), (String, String)> {
                Ok(())
            }

            fn set(&mut self, _: &str, value: &$crate::parameters::Value) -> ::core::result::Result<(), String> {
                let chosen = $crate::parameters::choice(&[$($word),+], value)?;
                if let Some(variant) = Self::ALL.get(chosen) {
                    *self = *variant;
                }
                Ok(())
            }
        }
    };
}
