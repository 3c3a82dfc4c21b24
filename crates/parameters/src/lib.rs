//! Parameters as typed structs that describe themselves.
//!
//! [`parameters!`](crate::parameters!) declares a struct; each field states type, default, range, unit, source and meaning
//! once, and the check, the commented TOML, the machine-readable schema and nested groups follow from that.
//! [`choices!`](crate::choices!) declares an enum of words.

mod declare;
mod error;
mod joined;
mod schema;
mod tables;
mod values;

pub use error::ParameterError;
pub use schema::{
    Bounds, Declared, Field, FileName, Kind, Parameter, above, check_ranges, choice, renamed_in, schema_of, set_field,
};
pub use tables::{describe, listed, merge, nested, similar, template, template_at};
pub use toml::{Table, Value};

/// The result of what parameters can be refused by.
pub type Result<T, E = ParameterError> = std::result::Result<T, E>;

/// A struct of parameters that describes itself; made by [`parameters!`](crate::parameters!).
pub trait Parameters: Clone + Send + Sync + 'static {
    /// Every parameter in order of declaration, with this value's values for defaults.
    fn schema(&self) -> Vec<Parameter>;

    /// Checks every range and relation.
    ///
    /// # Errors
    /// The path of the first parameter that is out of range, and what would be right.
    fn check_all(&self) -> Result<(), (String, String)>;

    /// Takes `value` for the parameter at `path`, whose parts are parted by dots. Ranges are not looked at.
    ///
    /// # Errors
    /// What is wrong with a path that leads nowhere or a value of another type, in words that follow the path.
    fn set(&mut self, path: &str, value: &Value) -> Result<(), String>;

    /// The paths of today for a path that a former version knew; none where it is no former one.
    fn renamed(&self, _path: &str) -> Option<Vec<String>> {
        None
    }

    /// Checks every range and relation; errors name `owner`.
    ///
    /// # Errors
    /// [`ParameterError`] that names the first bad parameter and its range.
    fn validate(&self, owner: &str) -> Result<()> {
        self.check_all().map_err(|(name, problem)| ParameterError::new(owner, name, problem))
    }

    /// Every parameter of the models chosen with its value, groups as tables.
    ///
    /// # Errors
    /// [`ParameterError`] when a value cannot be written as TOML.
    fn to_table(&self, owner: &str) -> Result<toml::Table> {
        tables::table(&self.schema()).map_err(|name| ParameterError::new(owner, name, "cannot be written as TOML"))
    }

    /// This value with those of `changes` in their place. Groups may be given in part; keys may be dotted. Names of former
    /// versions are understood, with a warning.
    ///
    /// # Errors
    /// [`ParameterError`] for a name that is unknown or belongs to a model that is not chosen, a value of the wrong type or out
    /// of range.
    fn with(&self, owner: &str, changes: &toml::Table) -> Result<Self> {
        tables::changed(self, owner, changes)
    }
}

#[cfg(test)]
mod models_tests;

#[cfg(test)]
mod tests {
    use super::*;

    crate::choices! {
        /// What it does.
        pub enum Manner {
            /// At once.
            Quick = "quick",
            /// In time.
            SlowAndSteady = "slow-and-steady",
        }
    }

    crate::parameters! {
        /// A group.
        pub struct WindowParams {
            /// Surroundings.
            pub padding: f64 = 1.5, in 0.0..=4.0, unit "target sizes", source "henriques2015, section 8";
            /// Cells.
            pub cells: usize = 3, in Bounds::from(1..=63).in_steps_of(2.0);
        }
    }

    crate::parameters! {
        /// For the tests.
        pub struct ToyParams {
            /// A rate.
            pub rate: f64 = 0.5, in 0.0..=1.0;
            /// A word.
            /// With a second line.
            pub word: String = "a \"b\"".into();
            /// How.
            pub manner: Manner = Manner::Quick;
            /// Whether.
            pub bold: bool = false;
            /// Least area.
            pub least: f64 = 2.0, in above(0.0), unit "px";
            /// Greatest area.
            pub most: f64 = 3.0, in above(0.0), unit "px";
            /// The window.
            pub window: WindowParams = WindowParams { padding: 2.0, ..WindowParams::default() };
        }
        ordered { least <= most }
    }

    fn with(text: &str) -> Result<ToyParams> {
        ToyParams::default().with("toy", &text.parse().unwrap())
    }

    fn error(text: &str) -> String {
        with(text).unwrap_err().to_string()
    }

    #[test]
    fn the_template_reads_back_as_the_defaults() {
        let text = template(&ToyParams::default().schema());
        assert!(text.contains("# A word.\n# With a second line.\nword = "), "{text}");
        assert!(
            text.contains("# Surroundings.\n# target sizes, between 0 and 4, henriques2015, section 8\npadding = 2.0"),
            "{text}"
        );
        assert!(text.contains("# one of: quick, slow-and-steady\nmanner = \"quick\""), "{text}");
        assert!(text.contains("# The window.\n[window]\n"), "{text}");
        assert_eq!(with(&text).unwrap(), ToyParams::default());
    }

    #[test]
    fn groups_are_changed_in_part_and_by_dotted_keys() {
        let changed = with("window.cells = 5\nmanner = 'slow-and-steady'").unwrap();
        assert_eq!((changed.window.cells, changed.window.padding), (5, 2.0));
        assert_eq!(changed.manner, Manner::SlowAndSteady);
        let dotted = toml::Table::from_iter([("window.cells".to_owned(), toml::Value::Integer(7))]);
        assert_eq!(ToyParams::default().with("toy", &dotted).unwrap().window.cells, 7);
    }

    #[test]
    fn errors_name_the_parameter_and_what_would_be_right() {
        assert!(
            error("speed = 1")
                .contains("`speed` of `toy`: there is no such parameter; there are: rate, word, manner, bold")
        );
        assert!(
            error("window.size = 1")
                .contains("`window.size` of `toy`: there is no such parameter; there are: padding, cells")
        );
        assert!(error("rate = 2").contains("`rate` of `toy`: must be between 0 and 1, not 2"), "{}", error("rate = 2"));
        assert!(error("rate = nan").contains("`rate` of `toy`: must be between 0 and 1"));
        assert!(error("rate = 'x'").contains("`rate` of `toy`: invalid type"), "{}", error("rate = 'x'"));
        assert!(error("word = 3").contains("`word` of `toy`: invalid type: integer, expected a text"));
        assert!(error("manner = 3").contains("`manner` of `toy`: invalid type: integer, expected a word"));
        assert!(error("window.cells = 1.5").contains("`window.cells` of `toy`: invalid type: float, expected a whole"));
        assert!(error("window.cells = -1").contains("`window.cells` of `toy`: cannot be -1"));
        assert!(error("bold = 1").contains("`bold` of `toy`: invalid type: integer, expected true or false"));
        assert!(with("bold = true").unwrap().bold);
        assert_eq!(with("rate = 1").unwrap().rate, 1.0, "a whole number is a number");
        assert!(error("window.padding = 9").contains("`window.padding` of `toy`: must be between 0 and 4"));
        assert!(
            error("window.cells = 4")
                .contains("`window.cells` of `toy`: must be between 1 and 63, 1 plus a multiple of 2")
        );
        assert!(error("window = 4").contains("`window` of `toy`: is a group"), "{}", error("window = 4"));
        assert!(error("manner = 'x'").contains("`manner` of `toy`: unknown"), "{}", error("manner = 'x'"));
        assert!(error("manner = 'x'").contains("expected one of quick, slow-and-steady"));
        assert!(error("least = 5").contains("`least` of `toy`: must not exceed `most`"), "{}", error("least = 5"));
    }

    #[test]
    fn the_schema_is_complete() {
        let schema = serde_json::to_value(ToyParams::default().schema()).unwrap();
        assert_eq!(
            schema[0],
            serde_json::json!({"name": "rate", "type": "number", "minimum": 0.0, "maximum": 1.0,
            "doc": "A rate.", "default": 0.5})
        );
        assert_eq!(schema[2]["choices"], serde_json::json!(["quick", "slow-and-steady"]));
        assert_eq!(schema[6]["type"], "group");
        assert_eq!(schema[6]["parameters"][0]["unit"], "target sizes");
        assert_eq!(schema[6]["parameters"][0]["default"], 2.0);
        assert!(schema[6].get("default").is_none());
    }
}
