//! Parameters of several values, and those that may be left out.

use crate::schema::wrong_type;
use crate::{Bounds, Field, Kind, Value};

/// Gives each of `slots` its value.
fn set_each<T: Field>(slots: &mut [T], values: &[Value]) -> Result<(), String> {
    slots.iter_mut().zip(values).try_for_each(|(slot, value)| slot.set("", value))
}

/// The values of a list; none where one cannot be written.
fn value_of<T: Field>(list: &[T]) -> Option<Value> {
    list.iter().map(Field::value).collect::<Option<Vec<_>>>().map(Value::Array)
}

/// A fixed number of values, each within the range declared.
impl<T: Field, const N: usize> Field for [T; N] {
    fn kind(&self, bounds: Bounds) -> Kind {
        let each = self.first().map_or(Kind::Text, |first| first.kind(bounds));
        Kind::List { length: Some(N), each: Box::new(each) }
    }

    fn value(&self) -> Option<Value> {
        value_of(self)
    }

    fn check(&self, bounds: &Bounds) -> Result<(), (String, String)> {
        self.iter().try_for_each(|item| item.check(bounds))
    }

    fn set(&mut self, _: &str, value: &Value) -> Result<(), String> {
        let values = value.as_array().filter(|values| values.len() == N);
        set_each(self, values.ok_or_else(|| wrong_type(value, &format!("a list of {N}")))?)
    }
}

/// Any number of values, each within the range declared.
impl<T: Field + Clone + Default> Field for Vec<T> {
    fn kind(&self, bounds: Bounds) -> Kind {
        Kind::List { length: None, each: Box::new(T::default().kind(bounds)) }
    }

    fn value(&self) -> Option<Value> {
        value_of(self)
    }

    fn check(&self, bounds: &Bounds) -> Result<(), (String, String)> {
        self.iter().try_for_each(|item| item.check(bounds))
    }

    fn set(&mut self, _: &str, value: &Value) -> Result<(), String> {
        let values = value.as_array().ok_or_else(|| wrong_type(value, "a list"))?;
        self.resize(values.len(), T::default());
        set_each(self, values)
    }
}

/// What may be left out: a value, or a group that is there as soon as one of its parameters is given.
impl<T: Field + Clone + Default> Field for Option<T> {
    fn kind(&self, bounds: Bounds) -> Kind {
        match (self, T::default().kind(bounds)) {
            (Some(value), _) => value.kind(bounds),
            // Nobody has given these: they have no values, so that written out and read again the group stays away.
            (None, Kind::Group { mut parameters }) => {
                parameters.iter_mut().for_each(|p| p.default = None);
                Kind::Group { parameters }
            }
            (None, kind) => kind,
        }
    }

    fn value(&self) -> Option<Value> {
        self.as_ref().and_then(Field::value)
    }

    fn check(&self, bounds: &Bounds) -> Result<(), (String, String)> {
        self.as_ref().map_or(Ok(()), |value| value.check(bounds))
    }

    fn set(&mut self, rest: &str, value: &Value) -> Result<(), String> {
        self.get_or_insert_default().set(rest, value)
    }
}

#[cfg(test)]
mod tests {
    use crate::Parameters;

    crate::parameters! {
        /// A group that may be left out.
        pub struct ZoomParams {
            /// How far.
            pub reach: f64 = 2.0, in above(0.0);
        }
    }

    crate::parameters! {
        /// Lists and what may be left out.
        pub struct ListParams {
            /// Three numbers.
            pub mean: [f32; 3] = [0.5; 3], in 0.0..=255.0;
            /// Any number of them.
            pub strides: Vec<usize> = vec![8, 16], in 1..=64;
            /// A size.
            pub size: Option<[usize; 2]> = None, in 1..=64;
            /// A zoom.
            pub zoom: Option<ZoomParams> = None;
        }
    }

    fn with(text: &str) -> crate::Result<ListParams> {
        ListParams::default().with("list", &text.parse().unwrap())
    }

    #[test]
    fn lists_are_read_and_checked_one_by_one() {
        let read = with("mean = [1, 2.5, 3]\nstrides = [4]\nsize = [3, 4]").unwrap();
        assert_eq!((read.mean, read.strides, read.size), ([1.0, 2.5, 3.0], vec![4], Some([3, 4])));
        for (text, problem) in [
            ("mean = [1, 2]", "expected a list of 3"),
            ("mean = [1, 2, 256]", "must be between 0 and 255, not 256"),
            ("strides = 4", "expected a list"),
            ("strides = [4.5]", "expected a whole number"),
            ("size = [0, 1]", "must be between 1 and 64, not 0"),
        ] {
            let error = with(text).unwrap_err().to_string();
            assert!(error.contains(problem), "{text}: {error}");
        }
    }

    #[test]
    fn what_is_left_out_stays_out() {
        let (without, zoomed) = (ListParams::default(), with("zoom.reach = 3").unwrap());
        assert_eq!(zoomed.zoom, Some(ZoomParams { reach: 3.0 }));
        for params in [without, zoomed] {
            let table = params.to_table("list").unwrap();
            assert_eq!(ListParams::default().with("list", &table).unwrap(), params);
        }
        assert!(with("zoom.reach = 0").unwrap_err().to_string().contains("`zoom.reach` of `list`: must be above 0"));
    }
}
