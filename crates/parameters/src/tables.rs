//! Parameters as TOML: commented templates, and changes merged into defaults.

use super::Parameters;
use super::schema::{Kind, Parameter};
use crate::{ParameterError, Result};
use toml::{Table, Value};

/// The parameter that names the model of a group.
const MODEL: &str = "model";

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
    for parameter in schema {
        let Some(value) = &parameter.default else { continue };
        let mut entry = commented(parameter);
        entry += &format!("{} = {value}\n\n", parameter.name);
        text.push_str(&if has(schema, parameter) { entry } else { commented_out(&entry) });
    }
    for parameter in schema {
        let Kind::Group { parameters } = &parameter.kind else { continue };
        let path = join(path, parameter.name);
        let mut entry = commented(parameter);
        entry += &format!("[{path}]\n\n");
        write_group(&mut entry, parameters, &path);
        text.push_str(&if has(schema, parameter) { entry } else { commented_out(&entry) });
    }
}

/// Meaning and facts of a parameter, as comments.
fn commented(parameter: &Parameter) -> String {
    parameter.doc.lines().map(str::to_owned).chain(facts(parameter)).map(|line| format!("# {line}\n")).collect()
}

/// What a model has that is not chosen: it stands there and does not count.
fn commented_out(entry: &str) -> String {
    entry.lines().map(|line| if line.is_empty() { "\n".to_owned() } else { format!("# {line}\n") }).collect()
}

/// The model that is chosen in a group, where it has several.
fn model(schema: &[Parameter]) -> Option<&str> {
    schema.iter().find(|p| p.name == MODEL)?.default.as_ref()?.as_str()
}

/// Whether the model that is chosen in the group `schema` has this parameter of it.
fn has(schema: &[Parameter], parameter: &Parameter) -> bool {
    parameter.models.is_empty() || model(schema).is_some_and(|model| parameter.models.contains(&model))
}

/// Unit, range and source in one line.
fn facts(parameter: &Parameter) -> Option<String> {
    let range = match &parameter.kind {
        Kind::Number(bounds) | Kind::Integer(bounds) if *bounds != super::Bounds::default() => Some(bounds.to_string()),
        Kind::Choice { choices } => Some(format!("one of: {}", choices.join(", "))),
        Kind::List { each, .. } => match **each {
            Kind::Number(bounds) | Kind::Integer(bounds) if bounds != super::Bounds::default() => {
                Some(format!("each {bounds}"))
            }
            _ => None,
        },
        _ => None,
    };
    let models = (!parameter.models.is_empty()).then(|| format!("of {}", parameter.models.join(", ")));
    let parts = [parameter.unit.map(str::to_owned), range, parameter.source.map(str::to_owned), models];
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
            Err(format!("is a group; give one of its parameters: {}", listed(parameters)))
        }
        (Some(_), None) => Ok(()),
        _ => Err(unknown_among(first, &names(schema), &listed(schema))),
    }
}

pub(super) fn names(schema: &[Parameter]) -> Vec<&'static str> {
    schema.iter().map(|p| p.name).collect()
}

/// The message for a name that is none of `names`.
pub(super) fn unknown(name: &str, names: &[&str]) -> String {
    unknown_among(name, names, &names.join(", "))
}

fn unknown_among(name: &str, names: &[&str], listed: &str) -> String {
    let nearest = names.iter().map(|known| (distance(name, known), *known)).min();
    let near = nearest.filter(|(wrong, known)| is_near(*wrong, known));
    let guess = near.map_or_else(String::new, |(_, known)| format!("did you mean `{known}`? "));
    format!("there is no such parameter; {guess}there are: {listed}")
}

/// The parameters, as dotted paths, whose last part is that of `path` or nearly so, the nearest first; three at most. So who
/// remembers `padding` finds `filter.window.padding`.
pub fn similar(schema: &[Parameter], path: &str) -> Vec<String> {
    let last = path.rsplit('.').next().unwrap_or(path);
    let mut found: Vec<(usize, String)> = Vec::new();
    gather_similar(schema, "", last, &mut found);
    found.sort();
    found.into_iter().take(3).map(|(_, path)| path).collect()
}

fn gather_similar(schema: &[Parameter], before: &str, wanted: &str, found: &mut Vec<(usize, String)>) {
    for parameter in schema {
        let path = format!("{before}{}", parameter.name);
        if let Kind::Group { parameters } = &parameter.kind {
            gather_similar(parameters, &format!("{path}."), wanted, found);
            continue;
        }
        let wrong = distance(wanted, parameter.name);
        if is_near(wrong, parameter.name) {
            found.push((wrong, path));
        }
    }
}

/// Of a name of five letters, one may be wrong.
const fn is_near(wrong: usize, name: &str) -> bool {
    wrong <= name.len().div_ceil(5)
}

/// Letters to insert, remove or replace to make `a` into `b`.
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, of_a) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, of_b) in b.chars().enumerate() {
            let changed = diagonal + usize::from(of_a != of_b);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.chars().count()]
}

/// Names of parameters, groups as `NAME.…`.
pub fn listed(schema: &[Parameter]) -> String {
    let name =
        |p: &Parameter| if matches!(p.kind, Kind::Group { .. }) { format!("{}.…", p.name) } else { p.name.into() };
    schema.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Refuses the path of what only a model has that is not chosen; `group` is the path of `schema`. A plain parameter may be said
/// to be what it `was`: files that name all of them stay good for any model.
fn check_model(was: &[Parameter], schema: &[Parameter], group: &str, path: &str) -> std::result::Result<(), String> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    let named = |p: &&Parameter| p.name == first;
    let (Some(was), Some(now)) = (was.iter().find(named), schema.iter().find(named)) else { return Ok(()) };
    let said_again = now.default.is_some() && now.default == was.default;
    if !has(schema, now) && !said_again {
        let key = join(group, MODEL);
        let choices: Vec<_> = now.models.iter().map(|m| format!("`{key} = \"{m}\"`")).collect();
        let chosen = model(schema).unwrap_or_default();
        return Err(format!("belongs to {}, and the model is `{chosen}`", choices.join(" or ")));
    }
    match (&was.kind, &now.kind) {
        (Kind::Group { parameters: was }, Kind::Group { parameters: now }) => {
            check_model(was, now, &join(group, first), rest)
        }
        _ => Ok(()),
    }
}

/// The values of a schema, groups as tables, without what models have that are not chosen.
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
    schema.iter().filter(|p| has(schema, p) && !left_out(p)).map(entry).collect()
}

/// Whether nobody has given this list, or any parameter of this group.
fn left_out(parameter: &Parameter) -> bool {
    match &parameter.kind {
        Kind::List { .. } => parameter.default.is_none(),
        Kind::Group { parameters } => !parameters.is_empty() && parameters.iter().all(|p| p.default.is_none()),
        _ => false,
    }
}

pub(super) fn changed<P: Parameters>(params: &P, owner: &str, changes: &Table) -> Result<P> {
    let (mut changed, schema) = (params.clone(), params.schema());
    let mut given = Vec::new();
    leaves(&nested(changes), "", &mut given);
    let mut set = |path: &str, value: &Value| {
        check_path(&schema, path)
            .and_then(|()| changed.set(path, value))
            .map_err(|problem| ParameterError::new(owner, path, problem))
    };
    let (former, given): (Vec<_>, Vec<_>) = given.into_iter().partition(|(path, _)| params.renamed(path).is_some());
    for (old, value) in &former {
        let new = params.renamed(old).unwrap_or_default();
        tracing::warn!(
            "parameter `{old}` of `{owner}` is called `{}` now; the next version will not know the old name",
            new.join("`, `")
        );
        new.iter().try_for_each(|path| set(path, value))?;
    }
    given.iter().try_for_each(|(path, value)| set(path, value))?;
    let chosen = changed.schema();
    for (path, _) in &given {
        match check_model(&schema, &chosen, "", path) {
            Ok(()) => {}
            // Files of former versions name what every model has.
            Err(problem) if !former.is_empty() => {
                tracing::warn!("parameter `{path}` of `{owner}` {problem}: it does not count")
            }
            Err(problem) => return Err(ParameterError::new(owner, path, problem)),
        }
    }
    changed.validate(owner)?;
    Ok(changed)
}
