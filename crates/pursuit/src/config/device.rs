//! What networks by file run on, said once for all who take part.

use super::Settings;
use pursuit_inference::onnx::Device;
use pursuit_parameters::{Kind, Parameter, Table, Value};

/// The group that says how a network by file is run, wherever it stands, and what it runs on there.
const GROUP: &str = "runtime";
const KEY: &str = "device";

/// Hands `device` to each of those whose parameters are in `settings` and who run a network by file, unless theirs is said
/// already; `schemas` are those of the trackers, and of the detector. Whether any of them does.
pub(super) fn hand(
    device: Device,
    settings: &mut Settings,
    trackers: &[Vec<Parameter>],
    detector: &[Parameter],
) -> bool {
    let word = Value::from(device.as_str());
    let mut any = false;
    for (schema, table) in trackers.iter().zip(&mut settings.trackers) {
        any |= put(schema, table, &word);
    }
    any | put(detector, &mut settings.detector, &word)
}

/// Puts the word into every group of `schema` that runs a network; whether there is one.
fn put(schema: &[Parameter], table: &mut Table, word: &Value) -> bool {
    let mut any = false;
    for parameter in schema {
        let Kind::Group { parameters } = &parameter.kind else { continue };
        let takes = parameter.name == GROUP && parameters.iter().any(|p| p.name == KEY);
        let mut inside = match table.get(parameter.name) {
            Some(Value::Table(inside)) => inside.clone(),
            _ => Table::new(),
        };
        if takes {
            inside.entry(KEY).or_insert_with(|| word.clone());
        }
        if takes || put(parameters, &mut inside, word) {
            table.insert(parameter.name.to_owned(), Value::Table(inside));
            any = true;
        }
    }
    any
}
