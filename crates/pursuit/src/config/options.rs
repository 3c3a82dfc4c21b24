//! Options that a file, a command line or both may give.

use pursuit_media::depth::DepthOptions;
use pursuit_parameters::{Table, merge, nested};

/// An option that may be silent.
pub(crate) trait Said {
    /// Whether it says nothing, and so is not written.
    fn is_silent(&self) -> bool;

    /// What `over` says, or where it says nothing what this says.
    fn overridden_by(self, over: Self) -> Self;
}

impl<T> Said for Option<T> {
    fn is_silent(&self) -> bool {
        self.is_none()
    }

    fn overridden_by(self, over: Self) -> Self {
        over.or(self)
    }
}

impl<T> Said for Vec<T> {
    fn is_silent(&self) -> bool {
        self.is_empty()
    }

    fn overridden_by(self, over: Self) -> Self {
        if over.is_empty() { self } else { over }
    }
}

/// Parameters are merged name by name.
impl Said for Table {
    fn is_silent(&self) -> bool {
        self.is_empty()
    }

    fn overridden_by(self, over: Self) -> Self {
        let mut both = nested(&self);
        merge(&mut both, nested(&over));
        both
    }
}

impl Said for DepthOptions {
    fn is_silent(&self) -> bool {
        *self == Self::default()
    }

    fn overridden_by(self, over: Self) -> Self {
        Self {
            coding: over.coding.or(self.coding),
            intrinsics: over.intrinsics.or(self.intrinsics),
            depth_intrinsics: over.depth_intrinsics.or(self.depth_intrinsics),
            offset_mm: over.offset_mm.or(self.offset_mm),
            registered: over.registered.or(self.registered),
        }
    }
}

/// Declares a struct of options, each with its sentence: what a file may hold, what is written, and what one set of options
/// leaves of another follow from that. A file does not have those behind `unwritten`.
macro_rules! options {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident {
            $($(#[doc = $doc:literal])+ pub $field:ident: $type:ty,)*
        }
        $(unwritten { $($(#[doc = $hidden_doc:literal])+ pub $hidden:ident: $hidden_type:ty,)* })?
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])+
                #[serde(skip_serializing_if = "crate::config::options::Said::is_silent")]
                pub $field: $type,
            )*
            $($($(#[doc = $hidden_doc])+ #[serde(skip)] pub $hidden: $hidden_type,)*)?
        }

        impl $name {
            /// The names of all options in order of declaration, with what they mean.
            pub const OPTIONS: &'static [(&'static str, &'static str)] =
                &[$((stringify!($field), concat!($($doc),+))),*];

            /// These options with what `over` says in their place; parameters are merged name by name.
            #[must_use]
            pub fn overridden_by(self, over: Self) -> Self {
                use crate::config::options::Said;
                Self {
                    $($field: Said::overridden_by(self.$field, over.$field),)*
                    $($($hidden: Said::overridden_by(self.$hidden, over.$hidden),)*)?
                }
            }
        }

        impl crate::config::options::Said for $name {
            fn is_silent(&self) -> bool {
                *self == Self::default()
            }

            fn overridden_by(self, over: Self) -> Self {
                self.overridden_by(over)
            }
        }
    };
}

pub(crate) use options;
