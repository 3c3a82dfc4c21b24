//! Several structs of parameters side by side, as one flat list.

use crate::{Parameter, Parameters, Result, Value, tables};

macro_rules! joined {
    ($($part:ident $at:tt),+) => {
        /// The parameters of all parts in one list, without groups; no two parts may have the same name.
        impl<$($part: Parameters),+> Parameters for ($($part,)+) {
            fn schema(&self) -> Vec<Parameter> {
                [$(self.$at.schema()),+].concat()
            }

            fn check_all(&self) -> Result<(), (String, String)> {
                $(self.$at.check_all()?;)+
                Ok(())
            }

            fn set(&mut self, path: &str, value: &Value) -> Result<(), String> {
                let first = path.split('.').next().unwrap_or(path);
                $(if self.$at.schema().iter().any(|p| p.name == first) {
                    return self.$at.set(path, value);
                })+
                Err(tables::unknown(first, &tables::names(&self.schema())))
            }

            fn renamed(&self, path: &str) -> Option<Vec<String>> {
                $(if let Some(new) = self.$at.renamed(path) {
                    return Some(new);
                })+
                None
            }
        }
    };
}

joined!(A 0, B 1);
joined!(A 0, B 1, C 2);

#[cfg(test)]
mod tests {
    use super::*;

    crate::parameters! {
        /// Shared.
        pub struct Shared {
            /// Width.
            pub width: usize = 3, in 1..=9;
        }
    }

    crate::parameters! {
        /// Own.
        pub struct Own {
            /// Speed.
            pub speed: f64 = 0.5, in 0.0..=1.0;
        }
    }

    #[test]
    fn parts_are_read_and_checked_as_one_list() {
        let with = |text: &str| <(Shared, Own)>::default().with("both", &text.parse().unwrap());
        let both = with("width = 4\nspeed = 1").unwrap();
        assert_eq!((both.0.width, both.1.speed), (4, 1.0));
        assert_eq!(both.schema().iter().map(|p| p.name).collect::<Vec<_>>(), ["width", "speed"]);
        assert!(with("speed = 2").unwrap_err().to_string().contains("`speed` of `both`: must be between 0 and 1"));
        let error = with("sped = 1").unwrap_err().to_string();
        assert!(
            error.ends_with("there is no such parameter; did you mean `speed`? there are: width, speed"),
            "{error}"
        );
    }
}
