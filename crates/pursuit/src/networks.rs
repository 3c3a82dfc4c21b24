//! Where the library is that runs networks by file: a program finds it, and hands it to all who run one.

use pursuit_parameters::{Kind, Parameter, Table, merge, nested};
use pursuit_trackers::registry;
use std::path::Path;

/// The group that says how a network by file is run, and what names the library there.
const GROUP: &str = "runtime";
const KEY: &str = "onnxruntime";

/// Whether anybody with these parameters runs a network by file through onnxruntime: of the trackers and the detector so named, and
/// what says what detections look like.
pub fn runs_networks<'a>(parameters: &Table, trackers: impl Iterator<Item = &'a str>, detector: Option<&str>) -> bool {
    cfg!(feature = "onnxruntime") && !places(&nested(parameters), trackers, detector).is_empty()
}

/// `parameters` with the onnxruntime `library`, a file or the folder it is in, named to all who run a network by file, unless they name
/// one.
pub fn with_library<'a>(
    parameters: &Table,
    trackers: impl Iterator<Item = &'a str>,
    detector: Option<&str>,
    library: &Path,
) -> Table {
    let given = nested(parameters);
    let library = library.to_string_lossy().into_owned();
    let places = places(&given, trackers, detector).into_iter();
    let mut all = nested(&places.map(|place| (place, library.clone().into())).collect());
    merge(&mut all, given);
    all
}

/// Where the library is named, once for each network.
fn places<'a>(given: &Table, trackers: impl Iterator<Item = &'a str>, detector: Option<&str>) -> Vec<String> {
    let mut found = Vec::new();
    for tracker in trackers.filter_map(|name| registry::tracker(name).ok()) {
        below(&tracker.default_recipe().schema(), "", &mut found);
    }
    if let Some(detector) = detector.and_then(|name| registry::detector(name).ok()) {
        below(&detector.schema(), "", &mut found);
    }
    let embeds = ["many", "embedding"].iter().try_fold(given, |table, key| table.get(*key)?.as_table());
    if embeds.is_some_and(|e| e.get("model").and_then(|m| m.as_str()) == Some("network")) {
        found.push(format!("many.embedding.network.{KEY}"));
    }
    found
}

/// Those of a schema.
fn below(schema: &[Parameter], path: &str, found: &mut Vec<String>) {
    for parameter in schema {
        let Kind::Group { parameters } = &parameter.kind else { continue };
        let inside = format!("{path}{}.", parameter.name);
        if parameter.name == GROUP && parameters.iter().any(|p| p.name == KEY) {
            found.push(format!("{inside}{KEY}"));
        }
        below(parameters, &inside, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_who_run_a_network_are_told_where_the_library_is() {
        let with = |text: &str, tracker: &str, detector: Option<&str>| {
            let parameters: Table = toml::from_str(text).unwrap();
            with_library(&parameters, [tracker].into_iter(), detector, Path::new("lib")).to_string()
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
