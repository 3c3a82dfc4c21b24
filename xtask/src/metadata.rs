//! What `cargo metadata` says of the workspace.

use crate::run;
use anyhow::{Context, Result};
use serde_json::Value;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A package in the dependency graph.
pub struct Package {
    pub name: String,
    pub license: Option<String>,
    /// Whether it belongs to the workspace.
    pub ours: bool,
    /// Names of the packages it depends on at run time (not for tests or build scripts).
    pub dependencies: Vec<String>,
}

/// Every package that a build of the workspace, with all features, uses.
pub fn packages() -> Result<Vec<Package>> {
    let output = run::cargo("metadata").args(["--format-version", "1", "--all-features"]).output()?;
    let metadata: Value = serde_json::from_slice(&output).context("cargo metadata printed something else than JSON")?;
    let members: HashSet<&str> = strings(&metadata["workspace_members"]).collect();
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    Ok(packages.iter().map(|p| package(p, &members)).collect())
}

fn package(p: &Value, members: &HashSet<&str>) -> Package {
    let text = |v: &Value| v.as_str().unwrap_or_default().to_owned();
    let dependencies = p["dependencies"].as_array().into_iter().flatten();
    Package {
        name: text(&p["name"]),
        license: p["license"].as_str().map(str::to_owned),
        ours: p["id"].as_str().is_some_and(|id| members.contains(id)),
        dependencies: dependencies.filter(|d| d["kind"].is_null()).map(|d| text(&d["name"])).collect(),
    }
}

/// Something that cargo compiles.
pub struct Target {
    /// `lib`, `test`, `bin`, …
    pub kind: String,
    pub name: String,
    /// The file that it begins with.
    pub source: String,
}

/// The workspace's packages: name and folder.
pub fn folders() -> Result<Vec<(String, PathBuf)>> {
    let folder = |p: &Value| Path::new(p["manifest_path"].as_str()?).parent().map(Path::to_path_buf);
    let named = |p: &Value| Some((p["name"].as_str()?.to_owned(), folder(p)?));
    Ok(members()?.iter().filter_map(named).collect())
}

/// What cargo says of each of the workspace's packages.
fn members() -> Result<Vec<Value>> {
    let output = run::cargo("metadata").args(["--format-version", "1", "--no-deps"]).output()?;
    let mut metadata: Value =
        serde_json::from_slice(&output).context("cargo metadata printed something else than JSON")?;
    let packages = metadata["packages"].as_array_mut().context("cargo metadata lists no packages")?;
    Ok(std::mem::take(packages))
}

/// Every target of the workspace's packages.
pub fn targets() -> Result<Vec<Target>> {
    let text = |v: &Value| v.as_str().unwrap_or_default().to_owned();
    let packages = members()?;
    let targets = packages.iter().flat_map(|p| {
        p["targets"].as_array().into_iter().flatten().map(move |t| Target {
            kind: text(&t["kind"][0]),
            name: text(&t["name"]),
            source: text(&t["src_path"]),
        })
    });
    Ok(targets.collect())
}

fn strings(v: &Value) -> impl Iterator<Item = &str> {
    v.as_array().into_iter().flatten().filter_map(Value::as_str)
}
