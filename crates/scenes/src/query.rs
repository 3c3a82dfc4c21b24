use crate::{Scene, SceneError, registry};
use pursuit_parameters::Table;
use std::str::FromStr;

/// Makes the scene `name`. The same name, seed and parameters always make the same world.
///
/// # Errors
/// [`SceneError::UnknownScene`] or [`SceneError::Parameter`]; both say what there is.
pub fn scene(name: &str, seed: u64, params: &Table) -> Result<Box<dyn Scene>, SceneError> {
    registry::find(name)?.scene(seed, params)
}

/// Makes the scene that a query `scene:NAME[?seed=1&key=value]` describes.
///
/// # Errors
/// As [`scene`], and [`SceneError::Malformed`].
pub fn open(query: &str) -> Result<Box<dyn Scene>, SceneError> {
    let query: SceneQuery = query.parse()?;
    scene(&query.name, query.seed, &query.params)
}

/// A parsed query `scene:NAME[?seed=1&key=value]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneQuery {
    /// Name of the scene.
    pub name: String,
    /// The seed, 1 unless given.
    pub seed: u64,
    /// Values of the scene's parameters; those left out keep their defaults.
    pub params: Table,
}

impl SceneQuery {
    /// The prefix by which inputs that are scenes are told from files.
    pub const PREFIX: &'static str = "scene:";
}

impl FromStr for SceneQuery {
    type Err = SceneError;

    /// # Errors
    /// [`SceneError::Malformed`]; an unknown name, key or a value that cannot be read is reported with what there is.
    fn from_str(text: &str) -> Result<Self, SceneError> {
        let malformed = |reason: String| SceneError::Malformed { query: text.to_owned(), reason };
        let Some(rest) = text.strip_prefix(Self::PREFIX) else {
            return Err(malformed(format!("it does not begin with `{}`", Self::PREFIX)));
        };
        let (name, pairs) = rest.split_once('?').unwrap_or((rest, ""));
        let entry = registry::find(name)?;
        let (schema, mut seed, mut params) = (entry.schema(), 1, Table::new());
        for pair in pairs.split('&').filter(|p| !p.is_empty()) {
            let Some((key, value)) = pair.split_once('=') else {
                return Err(malformed(format!("`{pair}` lacks a value")));
            };
            if key == "seed" {
                let whole = value.parse();
                seed = whole.map_err(|_| malformed(format!("seed `{value}` is not a whole number from 0 on")))?;
                continue;
            }
            // Once written with a hyphen, `look_alike` may still be.
            let key = key.replace('-', "_");
            let value = schema.iter().find(|p| p.name == key).map_or_else(|| value.into(), |p| p.kind.read(value));
            if params.insert(key.clone(), value).is_some() {
                return Err(malformed(format!("`{key}` is given twice")));
            }
        }
        Ok(Self { name: name.to_owned(), seed, params })
    }
}
