//! What a batch is to do: a list of clips, from a manifest or from names.

use crate::{RunConfig, RunError};
use pursuit_address::Locator;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::Path;

/// A longer line is no clip.
const LONGEST_LINE: usize = 1 << 20;
/// What a manifest's line says besides the keys of a configuration.
const NAME: &str = "name";
/// What belongs to the batch and not to a clip of it.
const OF_THE_BATCH: [&str; 3] = ["out", "overwrite", "resume"];

/// One clip of a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct ClipJob {
    /// Its name in the results, none like it in the batch.
    pub name: String,
    /// How it is tracked.
    pub config: RunConfig,
}

/// The clips of a manifest: one line a clip, either a JSON object with the keys of a configuration file (`input`, `boxes`,
/// `tracker`, `detect`, `parameters`, …) and, where wanted, a `name`; or the input alone. What a line does not say, `common`
/// says. Lines that are empty or begin with `#` are skipped.
///
/// # Errors
/// [`RunError::Usage`] that names the line.
pub fn read_manifest(path: &Path, common: &RunConfig) -> Result<Vec<ClipJob>, RunError> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| RunError::usage(format!("manifest {} cannot be read: {e}", path.display())))?;
    parse_manifest(&text, &path.display().to_string(), common)
}

/// As [`read_manifest`], of the text of a manifest; messages call it `name`.
///
/// # Errors
/// [`RunError::Usage`] that names the line.
pub fn parse_manifest(text: &str, name: &str, common: &RunConfig) -> Result<Vec<ClipJob>, RunError> {
    let mut clips = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = |problem: String| RunError::usage(format!("manifest {name}, line {number}: {problem}"));
        if line.len() > LONGEST_LINE {
            return Err(wrong(format!("{} bytes are no clip", line.len())));
        }
        clips.push(clip_of(line, common).map_err(wrong)?);
    }
    named(clips)
}

/// One clip for each input.
///
/// # Errors
/// As [`read_manifest`].
pub fn clips_of(inputs: impl IntoIterator<Item = Locator>, common: &RunConfig) -> Result<Vec<ClipJob>, RunError> {
    named(inputs.into_iter().map(|input| (None, RunConfig { input: Some(input), ..common.clone() })).collect())
}

fn clip_of(line: &str, common: &RunConfig) -> Result<(Option<String>, RunConfig), String> {
    if !line.starts_with('{') {
        return Ok((None, RunConfig { input: Some(line.into()), ..common.clone() }));
    }
    let mut keys: Map<String, Value> = serde_json::from_str(line).map_err(|e| e.to_string())?;
    if let Some(key) = OF_THE_BATCH.iter().find(|key| keys.contains_key(**key)) {
        return Err(format!("`{key}` belongs to the batch, not to a clip of it"));
    }
    let name = match keys.remove(NAME) {
        None => None,
        Some(Value::String(name)) if is_safe(&name) => Some(name),
        Some(name) => return Err(format!("the name {name} is no name of a folder; give letters, digits, - _ or .")),
    };
    let own: RunConfig = serde_json::from_value(Value::Object(keys)).map_err(|e| e.to_string())?;
    if own.input.is_none() {
        return Err("there is no `input`".to_owned());
    }
    Ok((name, common.clone().overridden_by(own)))
}

fn is_safe(name: &str) -> bool {
    let fits = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    (1..=100).contains(&name.len()) && name.chars().all(fits) && !name.starts_with('.')
}

/// Gives every clip a name of its own: that of its input, with a number where several have the same.
fn named(clips: Vec<(Option<String>, RunConfig)>) -> Result<Vec<ClipJob>, RunError> {
    let mut taken: BTreeMap<String, u32> = BTreeMap::new();
    for name in clips.iter().filter_map(|(name, _)| name.as_ref()) {
        if taken.insert(name.clone(), 1).is_some() {
            return Err(RunError::usage(format!("two clips of the manifest are called `{name}`")));
        }
    }
    let clips = clips.into_iter().map(|(name, config)| {
        let name = name.unwrap_or_else(|| {
            let stem = config.input.as_ref().map_or_else(|| "run".to_owned(), crate::run_folder::name_of);
            let mut name = stem.clone();
            while let Some(count) = taken.get_mut(&name) {
                *count += 1;
                name = format!("{stem}-{count}");
            }
            taken.insert(name.clone(), 1);
            name
        });
        ClipJob { name, config }
    });
    Ok(clips.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<ClipJob>, RunError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clips.jsonl");
        std::fs::write(&path, text).unwrap();
        let common: RunConfig = toml::from_str("tracker = 'kcf'\n[parameters]\nlambda = 0.1").unwrap();
        read_manifest(&path, &common)
    }

    #[test]
    fn lines_are_clips_and_what_they_do_not_say_is_common() {
        let clips = read(
            "# clips\n\n/data/a b.mp4\n{\"input\": \"scene:drift\", \"boxes\": [[1, 2, 3, 4]], \"tracker\": \"mosse\"}\n\
             {\"input\": \"x/a b.mp4\", \"parameters\": {\"motion.model\": \"imm\"}}\n{\"input\": \"y\", \"name\": \"mine\"}\n",
        )
        .unwrap();
        let names: Vec<&str> = clips.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["a-b", "scene-drift", "a-b-2", "mine"]);
        assert_eq!(clips[0].config.tracker.as_deref(), Some("kcf"));
        assert_eq!(clips[1].config.tracker.as_deref(), Some("mosse"));
        assert_eq!(clips[1].config.boxes, [[1.0, 2.0, 3.0, 4.0]]);
        assert!(clips[2].config.parameters.to_string().contains("lambda"), "{}", clips[2].config.parameters);
        assert!(clips[2].config.parameters.to_string().contains("imm"));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, words) in [
            ("a\n{\"input\": 3", "line 2"),
            ("{\"imput\": \"a\"}", "unknown field `imput`"),
            ("{\"tracker\": \"kcf\"}", "no `input`"),
            ("{\"input\": \"a\", \"out\": \"b\"}", "`out` belongs to the batch"),
            ("{\"input\": \"a\", \"name\": \"../b\"}", "no name of a folder"),
            ("{\"input\": \"a\", \"name\": \"b\"}\n{\"input\": \"c\", \"name\": \"b\"}", "two clips"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.to_string().contains(words), "{text}: {error}");
            assert_eq!(error.exit_code(), 2);
        }
    }

    #[test]
    fn a_name_made_up_never_takes_one_that_is_given() {
        let clips = read("a.mp4\na.mp4\n{\"input\": \"b\", \"name\": \"a-2\"}\na.mp4\n").unwrap();
        let mut names: Vec<&str> = clips.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 4, "{clips:?}");
    }
}
