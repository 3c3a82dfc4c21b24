/// Gives a type `Serialize` and `Deserialize` by those that serde derives for its fields, and checks what is read back: the
/// type derives both with `#[serde(remote = "TYPE")]` and has a method `fn restored(self) -> Result<Self, E>`, where `E:
/// Display`, which refuses what does not belong together and makes again what `#[serde(skip)]` left out.
///
/// The generics, where there are any, stand before the type, in brackets.
///
/// ```
/// use serde::{Deserialize, Serialize};
///
/// #[derive(Debug, Serialize, Deserialize)]
/// #[serde(remote = "Share")]
/// struct Share {
///     part: f64,
/// }
///
/// pursuit_estimation::checked!(Share);
///
/// impl Share {
///     fn restored(self) -> Result<Self, &'static str> {
///         if (0.0..=1.0).contains(&self.part) { Ok(self) } else { Err("a share lies between 0 and 1") }
///     }
/// }
///
/// assert!(serde_json::from_str::<Share>(r#"{ "part": 0.5 }"#).is_ok());
/// assert!(serde_json::from_str::<Share>(r#"{ "part": 1.5 }"#).is_err());
/// ```
#[macro_export]
macro_rules! checked {
    ([$($generics:tt)*] $type:ty) => {
        impl<$($generics)*> ::serde::Serialize for $type {
            fn serialize<S: ::serde::Serializer>(&self, serializer: S) -> ::core::result::Result<S::Ok, S::Error> {
                // The method that serde derived, not this one: an inherent function comes before a trait's.
                Self::serialize(self, serializer)
            }
        }

        impl<'de, $($generics)*> ::serde::Deserialize<'de> for $type {
            fn deserialize<D: ::serde::Deserializer<'de>>(deserializer: D) -> ::core::result::Result<Self, D::Error> {
                Self::deserialize(deserializer)?.restored().map_err(::serde::de::Error::custom)
            }
        }
    };
    ($type:ty) => {
        $crate::checked!([] $type);
    };
}
