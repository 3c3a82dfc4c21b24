//! Parameters as TOML: commented templates, and changes merged into defaults.

use super::Parameters;
use super::schema::{Kind, Parameter};
use crate::{Result, TrackingError};
use std::fmt::Write;
use toml::{Table, Value};

/// Documentation lines of a declaration as one text.
pub fn describe(lines: &[&str]) -> String {
    lines.iter().map(|l| l.trim()).collect::<Vec<_>>().join("\n").trim().to_owned()
}

/// The parameters with their defaults as commented TOML, ready to be edited: plain ones first, then each group as a table.
pub fn template(schema: &[Parameter]) -> String {
    template_at(schema, "")
}

/// The same below the table `path`, whose header is the caller's.
pub fn template_at(schema: &[Parameter], path: &str) -> String {
    let mut text = String::new();
    write_group(&mut text, schema, path);
    text
}

fn write_group(text: &mut String, schema: &[Parameter], path: &str) {
    // Writing to a string cannot fail.
    for parameter in schema {
        let Some(value) = &parameter.default else { continue };
        for line in parameter.doc.lines() {
            let _ = writeln!(text, "# {line}");
        }
        if let Some(facts) = facts(parameter) {
            let _ = writeln!(text, "# {facts}");
        }
        let _ = writeln!(text, "{} = {value}\n", parameter.name);
    }
    for parameter in schema {
        let Kind::Group { parameters } = &parameter.kind else { continue };
        for line in parameter.doc.lines() {
            let _ = writeln!(text, "# {line}");
        }
        let path = join(path, parameter.name);
        let _ = writeln!(text, "[{path}]\n");
        write_group(text, parameters, &path);
    }
}

/// Unit, range and source in one line.
fn facts(parameter: &Parameter) -> Option<String> {
    let range = match &parameter.kind {
        Kind::Number(bounds) | Kind::Integer(bounds) if *bounds != super::Bounds::default() => Some(bounds.to_string()),
        Kind::Choice { choices } => Some(format!("one of: {}", choices.join(", "))),
        _ => None,
    };
    let parts = [parameter.unit.map(str::to_owned), range, parameter.source.map(str::to_owned)];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

/// `changes` with dotted keys (`window.padding`) made into tables. Of two values of one key the later one counts.
pub fn nested(changes: &Table) -> Table {
    let mut out = Table::new();
    for (key, value) in changes {
        let (first, rest) = key.split_once('.').map_or((key.as_str(), None), |(first, rest)| (first, Some(rest)));
        let value = match (rest, value) {
            (Some(rest), value) => Value::Table(nested(&Table::from_iter([(rest.to_owned(), value.clone())]))),
            (None, Value::Table(table)) => Value::Table(nested(table)),
            (None, value) => value.clone(),
        };
        merge(&mut out, Table::from_iter([(first.to_owned(), value)]));
    }
    out
}

/// Puts the values of `changes` into `table`; groups are merged, not replaced.
pub fn merge(table: &mut Table, changes: Table) {
    for (key, value) in changes {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(old)), Value::Table(new)) => merge(old, new),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

/// Every plain value below `table` with its path.
fn leaves(table: &Table, path: &str, out: &mut Vec<(String, Value)>) {
    for (key, value) in table {
        let path = join(path, key);
        match value {
            Value::Table(table) => leaves(table, &path, out),
            value => out.push((path, value.clone())),
        }
    }
}

/// Refuses a path that is in no schema, and a plain value given for a group.
fn check_path(schema: &[Parameter], path: &str) -> std::result::Result<(), String> {
    let (first, rest) = path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)));
    let found = schema.iter().find(|p| p.name == first);
    match (found.map(|p| &p.kind), rest) {
        (Some(Kind::Group { parameters }), Some(rest)) => check_path(parameters, rest),
        (Some(Kind::Group { parameters }), None) => {
            let names: Vec<_> = parameters.iter().map(|p| p.name).collect();
            Err(format!("is a group; give one of its parameters: {}", names.join(", ")))
        }
        (Some(_), None) => Ok(()),
        _ => {
            let names: Vec<_> = schema.iter().map(|p| p.name).collect();
            Err(format!("there is no such parameter; there are: {}", names.join(", ")))
        }
    }
}

/// The values of a schema, groups as tables.
///
/// # Errors
/// The path of a value that TOML cannot hold.
pub(super) fn table(schema: &[Parameter]) -> std::result::Result<Table, String> {
    let entry = |parameter: &Parameter| {
        let value = match &parameter.kind {
            Kind::Group { parameters } => Value::Table(table(parameters).map_err(|rest| join(parameter.name, &rest))?),
            _ => parameter.default.clone().ok_or_else(|| parameter.name.to_owned())?,
        };
        Ok((parameter.name.to_owned(), value))
    };
    schema.iter().map(entry).collect()
}

pub(super) fn changed<P: Parameters>(params: &P, owner: &str, changes: &Table) -> Result<P> {
    let (mut changed, schema) = (params.clone(), params.schema());
    let mut values = Vec::new();
    leaves(&nested(changes), "", &mut values);
    for (path, value) in values {
        let bad = |problem| TrackingError::Parameter { owner: owner.to_owned(), name: path.clone(), problem };
        check_path(&schema, &path).map_err(bad)?;
        changed.set(&path, &value).map_err(bad)?;
    }
    changed.validate(owner)?;
    Ok(changed)
}
