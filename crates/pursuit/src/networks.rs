//! Where the library is that runs networks by file: a program finds it, and hands it to all who run one.

use pursuit_parameters::{Kind, Parameter, Table, merge, nested};
use pursuit_trackers::registry;
use std::path::PathBuf;

/// The group that says how a network by file is run, wherever it stands.
const GROUP: &str = "runtime";
/// What chooses among the models of a group.
const MODEL: &str = "model";
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
    let mut found: Vec<String> = Vec::new();
    let mut add = |place: String| {
        if !found.contains(&place) {
            found.push(place);
        }
    };
    for tracker in trackers.filter_map(|name| registry::tracker(name).ok()) {
        let schema = tracker.default_recipe().schema();
        let of_all = of_networks(&schema, given, LIBRARY);
        // What is chosen for this one alone is told to it alone.
        if let Some(own) = given.get(tracker.name).and_then(|own| own.as_table()) {
            let mut both = given.clone();
            merge(&mut both, own.clone());
            let alone = of_networks(&schema, &both, LIBRARY).into_iter().filter(|place| !of_all.contains(place));
            alone.for_each(|place| add(format!("{}.{place}", tracker.name)));
        }
        of_all.into_iter().for_each(&mut add);
    }
    let detector = detector.and_then(|name| registry::detector(name).ok());
    let of_detector = detector.map(|d| of_networks(&d.schema(), given, LIBRARY));
    of_detector.into_iter().flatten().for_each(&mut add);
    let embeds = ["many", "embedding"].iter().try_fold(given, |table, key| table.get(*key)?.as_table());
    if embeds.is_some_and(|e| e.get("model").and_then(|m| m.as_str()) == Some("network")) {
        found.push(format!("many.embedding.network.{LIBRARY}"));
    }
    found
}

/// The paths of `key` in the groups of a schema that say how a network by file is run, where the models that `given` chooses have one.
pub(crate) fn of_networks(schema: &[Parameter], given: &Table, key: &str) -> Vec<String> {
    let none = Table::new();
    let word = |p: &Parameter| given.get(p.name).or(p.default.as_ref()).and_then(|v| v.as_str().map(str::to_owned));
    let chosen = schema.iter().find(|p| p.name == MODEL).and_then(word);
    let takes_part = |p: &Parameter| p.models.is_empty() || chosen.as_deref().is_some_and(|c| p.models.contains(&c));
    let inside = |parameter: &Parameter| {
        let Kind::Group { parameters } = &parameter.kind else { return Vec::new() };
        let given = given.get(parameter.name).and_then(|g| g.as_table()).unwrap_or(&none);
        let own = (parameter.name == GROUP && parameters.iter().any(|p| p.name == key)).then(|| key.to_owned());
        let all = own.into_iter().chain(of_networks(parameters, given, key));
        all.map(|path| format!("{}.{path}", parameter.name)).collect()
    };
    schema.iter().filter(|p| takes_part(p)).flat_map(inside).collect()
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

    #[test]
    fn masks_by_a_network_are_told_and_no_others() {
        let with = |text: &str| {
            let parameters: Table = toml::from_str(text).unwrap();
            located(parameters, ["kcf", "fear-xs"].into_iter(), None, || Some("lib".into()))
        };
        let plain = with("mask.model = 'colors'");
        assert_eq!((plain["runtime"]["onnxruntime"].as_str(), plain["mask"].get("network")), (Some("lib"), None));
        let all = with("mask.model = 'network'");
        assert_eq!(all["mask"]["network"]["runtime"]["onnxruntime"].as_str(), Some("lib"));
        let one = with("kcf.mask.model = 'network'");
        assert_eq!(one["kcf"]["mask"]["network"]["runtime"]["onnxruntime"].as_str(), Some("lib"));
        assert!(one.get("mask").is_none(), "{one}");
        let named = with("mask.model = 'network'\nmask.network.runtime.onnxruntime = 'mine'");
        assert_eq!(named["mask"]["network"]["runtime"]["onnxruntime"].as_str(), Some("mine"));
    }
}
