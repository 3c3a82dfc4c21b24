//! Where the library is that runs networks by file: a program finds it, and hands it to all who run one.

use pursuit_parameters::{Kind, Parameter, Table, merge, nested};
use pursuit_trackers::registry;
use std::path::PathBuf;

/// The group that says how a network by file is run, wherever it stands.
const GROUP: &str = "runtime";
/// What names the library there.
const LIBRARY: &str = "onnxruntime";

/// `parameters` with the onnxruntime that `find` finds, a file or the folder it is in, named to all who run a network by file, unless
/// they name one: the trackers and the detector so named, and what says what detections look like. Where nobody does, nothing is
/// looked for.
pub fn located<'a>(
    parameters: Table,
    trackers: impl Iterator<Item = &'a str>,
    detector: Option<&str>,
    find: impl FnOnce() -> Option<PathBuf>,
) -> Table {
    let given = nested(&parameters);
    let places = if cfg!(feature = "onnxruntime") { places(&given, trackers, detector) } else { Vec::new() };
    if places.is_empty() {
        return parameters;
    }
    let Some(library) = find() else { return parameters };
    let library = library.to_string_lossy().into_owned();
    let mut all = nested(&places.into_iter().map(|place| (place, library.clone().into())).collect());
    merge(&mut all, given);
    all
}

/// Where the library is named, once for each network.
fn places<'a>(given: &Table, trackers: impl Iterator<Item = &'a str>, detector: Option<&str>) -> Vec<String> {
    let trackers = trackers.filter_map(|name| registry::tracker(name).ok());
    let detector = detector.and_then(|name| registry::detector(name).ok());
    let schemas = trackers.map(|t| t.default_recipe().schema()).chain(detector.map(|d| d.schema()));
    let mut found: Vec<String> = schemas.flat_map(|schema| of_networks(&schema, LIBRARY)).collect();
    let embeds = ["many", "embedding"].iter().try_fold(given, |table, key| table.get(*key)?.as_table());
    if embeds.is_some_and(|e| e.get("model").and_then(|m| m.as_str()) == Some("network")) {
        found.push(format!("many.embedding.network.{LIBRARY}"));
    }
    found
}

/// The paths of `key` in the groups of a schema that say how a network by file is run.
pub(crate) fn of_networks(schema: &[Parameter], key: &str) -> Vec<String> {
    let inside = |parameter: &Parameter| {
        let Kind::Group { parameters } = &parameter.kind else { return Vec::new() };
        let own = (parameter.name == GROUP && parameters.iter().any(|p| p.name == key)).then(|| key.to_owned());
        let all = own.into_iter().chain(of_networks(parameters, key));
        all.map(|path| format!("{}.{path}", parameter.name)).collect()
    };
    schema.iter().flat_map(inside).collect()
}

#[cfg(all(test, feature = "onnxruntime"))]
mod tests {
    use super::*;

    #[test]
    fn all_who_run_a_network_are_told_where_the_library_is() {
        let with = |text: &str, tracker: &str, detector: Option<&str>| {
            let parameters: Table = toml::from_str(text).unwrap();
            located(parameters, [tracker].into_iter(), detector, || Some("lib".into())).to_string()
        };
        assert_eq!(with("", "kcf", Some("motion")), "");
        assert_eq!(with("", "fear-xs", None), "[runtime]\nonnxruntime = \"lib\"\n");
        assert_eq!(with("", "kcf", Some("moving-objects")), "[objects.runtime]\nonnxruntime = \"lib\"\n");
        let named = "runtime.onnxruntime = 'mine'\nmany.embedding.model = 'network'";
        let both = with(named, "kcf", Some("objects"));
        assert!(
            both.contains("onnxruntime = \"mine\"") && both.contains("[many.embedding.network]\nonnxruntime = \"lib\""),
            "{both}"
        );
    }
}
