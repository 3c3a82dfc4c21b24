//! The macros that declare parameters.

/// Declares a struct of parameters. Each field states type, default and meaning, and, where it has them, range (`in`), unit
/// and source. A field whose type is itself such a struct is a group. A group that has several models has a field `model`, and
/// what not every model has says which ones do (`of`). `as` gives the name in files where it is no Rust name. `ordered` lists
/// pairs of which the first must not exceed the second, `renamed` the names of former versions, which still load.
///
/// ```
/// use pursuit_parameters::{Parameters, above, template};
/// pursuit_parameters::parameters! {
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
///
/// With models:
///
/// ```
/// use pursuit_parameters::Parameters;
/// pursuit_parameters::choices! {
///     /// How fast.
///     pub enum Pace {
///         /// Slowly.
///         Slow = "slow",
///         /// At full speed.
///         FlatOut = "flat-out",
///     }
/// }
/// pursuit_parameters::parameters! {
///     /// What full speed takes.
///     pub struct FlatOutParams {
///         /// Fuel.
///         pub fuel: f64 = 3.0, in above(0.0), unit "l";
///     }
/// }
/// pursuit_parameters::parameters! {
///     /// How a thing moves.
///     pub struct PaceParams {
///         /// The model.
///         pub model: Pace = Pace::Slow;
///         /// Flat out.
///         pub flat_out as "flat-out": FlatOutParams = FlatOutParams::default(), of [Pace::FlatOut];
///     }
///     renamed { "fuel" => ["flat-out.fuel"] }
/// }
/// let with = |text: &str| PaceParams::default().with("car", &text.parse().unwrap());
/// let fast = with("model = 'flat-out'\nflat-out.fuel = 4.0").unwrap();
/// assert_eq!(with("model = 'flat-out'\nfuel = 4.0").unwrap(), fast);
/// let error = with("flat-out.fuel = 4.0").unwrap_err().to_string();
/// assert!(error.contains("belongs to `model = \"flat-out\"`, and the model is `slow`"), "{error}");
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
                $field_vis:vis $field:ident $(as $word:literal)? : $type:ty = $default:expr
                $(, in $range:expr)? $(, unit $unit:literal)? $(, source $source:literal)? $(, of $models:expr)? ;
            )*
        }
        $(ordered { $($low:ident <= $high:ident),* $(,)? })?
        $(renamed { $($old:literal => [$($new:literal),+]),* $(,)? })?
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        $vis struct $name {
            $($(#[doc = $doc])+ $(#[serde(rename = $word)])? $field_vis $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $name {
            const NAMES: &'static [&'static str] = &[$($crate::parameters!(@or stringify!($field) $(, $word)?)),*];

            fn declared() -> Vec<$crate::Declared> {
                #[allow(unused_imports)]
                use $crate::{Bounds, above};
                vec![$($crate::Declared {
                    name: $crate::parameters!(@or stringify!($field) $(, $word)?),
                    doc: $crate::describe(&[$($doc),+]),
                    bounds: $crate::parameters!(@or Bounds::default() $(, Bounds::from($range))?),
                    unit: $crate::parameters!(@or None $(, Some($unit))?),
                    source: $crate::parameters!(@or None $(, Some($source))?),
                    models: $crate::parameters!(@or Vec::new() $(, $models.iter().map(|m| m.as_str()).collect())?),
                }),*]
            }

            fn fields(&self) -> Vec<&dyn $crate::Field> {
                vec![$(&self.$field),*]
            }

            fn fields_mut(&mut self) -> Vec<&mut dyn $crate::Field> {
                vec![$(&mut self.$field),*]
            }
        }

        impl $crate::Parameters for $name {
            fn schema(&self) -> Vec<$crate::Parameter> {
                $crate::schema_of(Self::declared(), &self.fields())
            }

            fn check_all(&self) -> ::core::result::Result<(), (String, String)> {
                $crate::check_ranges(&Self::declared(), &self.fields())?;
                $($(
                    if self.$low > self.$high {
                        let problem = concat!("must not exceed `", stringify!($high), "`");
                        return Err((stringify!($low).to_owned(), format!("{problem}, which is {}", self.$high)));
                    }
                )*)?
                Ok(())
            }

            fn set(&mut self, path: &str, value: &$crate::Value) -> ::core::result::Result<(), String> {
                $crate::set_field(Self::NAMES, self.fields_mut(), path, value)
            }

            fn renamed(&self, path: &str) -> Option<Vec<String>> {
                let renames: &[(&str, &[&str])] = &[$($(($old, &[$($new),+])),*)?];
                $crate::renamed_in(renames, Self::NAMES, &self.fields(), path)
            }
        }

        impl $crate::Field for $name {
            fn kind(&self, _: $crate::Bounds) -> $crate::Kind {
                $crate::Kind::Group { parameters: $crate::Parameters::schema(self) }
            }

            fn value(&self) -> Option<$crate::Value> {
                None
            }

            fn check(&self, _: &$crate::Bounds) -> ::core::result::Result<(), (String, String)> {
                $crate::Parameters::check_all(self)
            }

            fn set(&mut self, rest: &str, value: &$crate::Value) -> ::core::result::Result<(), String> {
                $crate::Parameters::set(self, rest, value)
            }

            fn renamed(&self, rest: &str) -> Option<Vec<String>> {
                $crate::Parameters::renamed(self, rest)
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

        impl $crate::Field for $name {
            fn kind(&self, _: $crate::Bounds) -> $crate::Kind {
                $crate::Kind::Choice { choices: Self::ALL.iter().map(|c| c.as_str()).collect() }
            }

            fn value(&self) -> Option<$crate::Value> {
                Some(self.as_str().into())
            }

            fn check(&self, _: &$crate::Bounds) -> ::core::result::Result<(), (String, String)> {
                Ok(())
            }

            fn set(&mut self, _: &str, value: &$crate::Value) -> ::core::result::Result<(), String> {
                let chosen = $crate::choice(&[$($word),+], value)?;
                if let Some(variant) = Self::ALL.get(chosen) {
                    *self = *variant;
                }
                Ok(())
            }
        }
    };
}
