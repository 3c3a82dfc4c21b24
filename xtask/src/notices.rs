//! The notices that `pursuit licences` prints and those in the Python wheel: name, version and licence of every crate that a
//! build with all features contains, and the text of each licence once.

use crate::run;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// What is handed out, and where its notices stand in the workspace.
const PROGRAMS: [(&str, &str); 2] =
    [("pursuit-cli", "apps/cli/NOTICES.txt"), ("pursuit-python", "bindings/python/NOTICES.txt")];

/// Networks whose weights stand in every build: folder in `crates/inference/weights`, what it is, and licence.
const WEIGHTS: [(&str, &str, &str); 3] =
    [("lightfc", "weights", "MIT"), ("nanotrack_v3", "weights", "Apache-2.0"), ("vittrack", "weights", "Apache-2.0")];

/// Writes the files.
pub fn write() -> Result<()> {
    for (program, file) in PROGRAMS {
        let text = notices(program)?;
        std::fs::write(run::root().join(file), &text).with_context(|| format!("cannot write {file}"))?;
        println!("notices: {file}, {} lines", text.lines().count());
    }
    Ok(())
}

/// Says when a committed file is not what would be written now.
pub fn check() -> Result<()> {
    for (program, file) in PROGRAMS {
        let committed = std::fs::read_to_string(run::root().join(file)).unwrap_or_default();
        if committed != notices(program)? {
            bail!("{file} does not name what {program} contains now; run `cargo xtask notices` and commit the file");
        }
        println!("notices: {file} is up to date");
    }
    Ok(())
}

/// One crate.
struct Inside {
    name: String,
    version: String,
    license: String,
    texts: Vec<String>,
}

fn notices(program: &str) -> Result<String> {
    let mut out = String::from(
        "pursuit is licensed under MIT or Apache-2.0, at your choice. A build with all features contains the following\n\
         crates and weights of networks; smaller builds contain fewer. The licence texts follow, each once.\n\n",
    );
    let mut inside = inside(program)?;
    inside.extend(weights()?);
    let mut texts: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for c in &inside {
        out.push_str(&format!("{} {}: {}\n", c.name, c.version, c.license));
        c.texts.iter().for_each(|t| texts.entry(t).or_default().push(format!("{} {}", c.name, c.version)));
    }
    // In the order of the first crate that each belongs to.
    let mut texts: Vec<(&str, Vec<String>)> = texts.into_iter().collect();
    texts.sort_by(|a, b| a.1.cmp(&b.1).then_with(|| a.0.cmp(b.0)));
    for (text, crates) in texts {
        out.push_str(&format!("\n{}\n{}:\n\n{text}\n", "-".repeat(79), crates.join(", ")));
    }
    Ok(out)
}

/// The crates that are compiled into `program`, on any platform, ours and those that only run in the compiler left out.
fn inside(program: &str) -> Result<Vec<Inside>> {
    let output = run::cargo("metadata").args(["--format-version", "1", "--all-features", "--locked"]).output()?;
    let metadata: Value = serde_json::from_slice(&output).context("cargo metadata printed something else than JSON")?;
    let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let packages: HashMap<String, Value> = list(&metadata["packages"]).into_iter().map(|p| (id(&p["id"]), p)).collect();
    let nodes: HashMap<String, Value> =
        list(&metadata["resolve"]["nodes"]).into_iter().map(|n| (id(&n["id"]), n)).collect();
    let members: HashSet<String> = list(&metadata["workspace_members"]).iter().map(id).collect();
    let found = members.iter().find(|m| packages.get(*m).is_some_and(|p| p["name"] == program));
    let found = found.with_context(|| format!("there is no package {program}"))?;
    let mut waiting = vec![found.clone()];
    let mut seen: HashSet<String> = waiting.iter().cloned().collect();
    let mut inside = Vec::new();
    while let Some(next) = waiting.pop() {
        let Some(package) = packages.get(&next) else { continue };
        if !members.contains(&next) {
            inside.push(package);
        }
        let dependencies = nodes.get(&next).map(|n| list(&n["deps"])).unwrap_or_default();
        let compiled_in = |d: &Value| list(&d["dep_kinds"]).iter().any(|k| k["kind"].is_null());
        for dependency in dependencies.iter().filter(|d| compiled_in(d)).map(|d| id(&d["pkg"])) {
            if packages.get(&dependency).is_some_and(|p| !is_macro(p)) && seen.insert(dependency.clone()) {
                waiting.push(dependency);
            }
        }
    }
    let mut inside = inside.into_iter().map(read).collect::<Result<Vec<_>>>()?;
    inside.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
    Ok(inside)
}

/// The weights of networks that are compiled into every program.
fn weights() -> Result<Vec<Inside>> {
    let one = |(name, version, license): (&str, &str, &str)| {
        let texts = texts(&run::root().join("crates/inference/weights").join(name), license)?;
        Ok(Inside { name: name.into(), version: version.into(), license: license.into(), texts })
    };
    WEIGHTS.into_iter().map(one).collect()
}

fn id(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// Whether it runs in the compiler rather than in the program.
fn is_macro(package: &Value) -> bool {
    package["targets"].as_array().into_iter().flatten().any(|t| t["kind"][0] == "proc-macro")
}

fn read(package: &Value) -> Result<Inside> {
    let license = package["license"].as_str().unwrap_or("see its text").to_owned();
    let manifest = PathBuf::from(id(&package["manifest_path"]));
    let folder = manifest.parent().context("a manifest lies nowhere")?;
    let mut texts = texts(folder, &license)?;
    if texts.is_empty() {
        // Some crates are published without a text; what their manifest says is all there is.
        let authors: Vec<&str> =
            package["authors"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        texts.push(format!("Licensed under {license}. Authors: {}", authors.join(", ")));
    }
    Ok(Inside { name: id(&package["name"]), version: id(&package["version"]), license, texts })
}

/// The licence and notice files in a crate's folder. Of a choice between MIT and others we take MIT.
fn texts(folder: &Path, license: &str) -> Result<Vec<String>> {
    let mut files: Vec<(String, PathBuf)> = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_uppercase();
        let wanted =
            ["LICENSE", "LICENCE", "COPYING", "NOTICE", "COPYRIGHT", "UNLICENSE"].iter().any(|w| name.starts_with(w));
        if wanted && path.is_file() {
            files.push((name, path));
        }
    }
    files.sort();
    let chooses = license.replace('/', " OR ").split(" OR ").any(|l| l.trim() == "MIT") && !license.contains("AND");
    let mit = |name: &str| name.contains("MIT");
    if chooses && files.iter().any(|(n, _)| mit(n)) {
        files.retain(|(n, _)| mit(n) || n.starts_with("NOTICE"));
    }
    let read = |(_, path): (String, PathBuf)| {
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        Ok(tidy(&String::from_utf8_lossy(&bytes)))
    };
    files.into_iter().map(read).collect()
}

/// The same text however its lines end.
fn tidy(text: &str) -> String {
    let lines: Vec<&str> = text.trim_start_matches('\u{feff}').lines().map(str::trim_end).collect();
    lines.join("\n").trim_matches('\n').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_choice_the_mit_text_is_taken_and_notices_stay() {
        let folder = std::env::temp_dir().join(format!("pursuit-notices-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["LICENSE-MIT", "LICENSE-APACHE", "NOTICE.md", "readme.md"] {
            std::fs::write(folder.join(name), format!("{name}  \r\n\r\nend\n\n")).unwrap();
        }
        assert_eq!(texts(&folder, "MIT OR Apache-2.0").unwrap(), ["LICENSE-MIT\n\nend", "NOTICE.md\n\nend"]);
        assert_eq!(texts(&folder, "MIT AND Apache-2.0").unwrap().len(), 3);
        assert_eq!(texts(&folder, "Apache-2.0").unwrap().len(), 3);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
