//! Whether what the documents name exists: the targets of their links, paths and `Type::name`s between back ticks, and the
//! keys and identifiers there.

use crate::{anchors, figures, pictures, run};
use anyhow::{Context, Result, bail};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

/// Words of Rust, Python and JavaScript that a declaration begins with.
const DECLARING: [&str; 12] =
    ["struct", "enum", "trait", "type", "union", "class", "fn", "def", "function", "const", "mod", "static"];
/// Endings of files that a document can only mean as files of this project.
const SOURCES: [&str; 5] = ["rs", "py", "pyi", "mjs", "md"];
/// Of what it says only the newest version is checked, and there no keys: it tells of renamed ones.
const HISTORY: &str = "CHANGELOG.md";
/// Folders whose children are named without them.
const SHELVES: [&str; 3] = ["crates", "apps", "bindings"];

/// Checks every document that git knows. What the change log says of released versions and the diaries in `docs/log` speak
/// of what was, and are left alone.
pub fn check() -> Result<()> {
    let tree = Tree::read()?;
    let documents = tree.paths.iter().filter(|p| p.ends_with(".md") && !p.starts_with("docs/log/"));
    let (mut wrong, mut count) = (Vec::new(), 0);
    for document in documents {
        let text = std::fs::read_to_string(run::root().join(document)).with_context(|| document.clone())?;
        let lines = text.lines().enumerate();
        let current = lines
            .take_while(|(_, line)| document != HISTORY || !line.starts_with("## ") || line.ends_with("(unreleased)"));
        let faults = claims(current).flat_map(|(number, claim)| {
            let fault = tree.fault(document, &claim)?;
            Some(format!("{document}:{number}: {fault}"))
        });
        wrong.extend(faults);
        count += 1;
    }
    if !wrong.is_empty() {
        bail!("the documents name what is not there:\n  {}", wrong.join("\n  "));
    }
    println!("names: {count} documents name only what exists");
    figures::check()?;
    pictures::check()
}

/// What a document says.
#[derive(Debug, PartialEq)]
enum Claim {
    Link(String),
    Code(String),
}

/// Links and words between back ticks, with their line numbers from 1; blocks of code are left out.
fn claims<'a>(lines: impl Iterator<Item = (usize, &'a str)>) -> impl Iterator<Item = (usize, Claim)> {
    let mut fenced = false;
    lines.flat_map(move |(k, line)| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        let prose = if fenced || fence || line.starts_with("    ") { "" } else { line };
        let code = prose.split('`').skip(1).step_by(2).map(|c| Claim::Code(c.trim().to_owned()));
        let links = prose.split("](").skip(1).filter_map(|rest| Some(Claim::Link(rest.split_once(')')?.0.to_owned())));
        code.chain(links).map(|claim| (k + 1, claim)).collect::<Vec<_>>()
    })
}

/// What there is: paths from the root, and the words of all sources.
#[derive(Default)]
struct Tree {
    /// Files and folders.
    paths: BTreeSet<String>,
    sources: Vec<Source>,
    /// The words of all sources together.
    words: HashSet<String>,
    /// What links to headings of each document say behind `#`.
    anchors: HashMap<String, HashSet<String>>,
}

/// The words of one file, and those that it declares.
struct Source {
    words: HashSet<String>,
    declared: HashSet<String>,
}

impl Tree {
    fn read() -> Result<Self> {
        let listed = run::program("git").args(["ls-files", "--cached", "--others", "--exclude-standard"]).output();
        let listed = String::from_utf8(listed.context("the names are checked in a checkout of git")?)?;
        let mut tree = Self::default();
        for path in listed.lines() {
            let read = |path: &str| std::fs::read_to_string(run::root().join(path)).unwrap_or_default();
            let is_source = !path.ends_with(".md") && !path.ends_with("NOTICES.txt");
            tree.add(path, &if is_source { read(path) } else { String::new() });
            if path.ends_with(".md") {
                tree.anchors.insert(path.to_owned(), anchors::anchors(&read(path)));
            }
        }
        Ok(tree)
    }

    fn add(&mut self, path: &str, text: &str) {
        let ancestors = Path::new(path).ancestors().filter_map(Path::to_str).filter(|p| !p.is_empty());
        self.paths.extend(ancestors.map(str::to_owned));
        let words: Vec<&str> = text.split(|c: char| !is_of_word(c)).filter(|w| !w.is_empty()).collect();
        let declared = words.windows(2).filter(|w| DECLARING.contains(&w[0])).map(|w| w[1].to_owned()).collect();
        let words: HashSet<String> = words.into_iter().map(str::to_owned).collect();
        self.words.extend(words.iter().cloned());
        self.sources.push(Source { words, declared });
    }

    /// What is wrong with a claim of a document.
    fn fault(&self, document: &str, claim: &Claim) -> Option<String> {
        let code = match claim {
            Claim::Link(target) => return self.link_fault(document, target),
            Claim::Code(code) => code,
        };
        let name = code.split(['(', '<', '=', ' ']).next().unwrap_or_default();
        let whole =
            name == code || code.ends_with(')') || code.ends_with('>') || code[name.len()..].starts_with(['=', ' ']);
        let is_setting = code.contains('=') && !code.starts_with('-');
        if !whole || (code.contains(' ') && !is_setting) || !name.chars().all(|c| is_of_word(c) || ".:/-".contains(c)) {
            return None;
        }
        if name.contains("::") {
            return self.qualified_fault(name);
        }
        if name.contains('/') || SOURCES.iter().any(|e| has_ending(name, e)) {
            return (code == name && !self.has_path(document, name)).then(|| format!("there is no `{name}`"));
        }
        if document == HISTORY || code.contains('"') {
            return None;
        }
        let parts = || name.split('.').flat_map(|part| part.split("__"));
        let speaks = name.len() > 3 && parts().all(|p| p.chars().all(is_of_word) && !p.is_empty());
        let of_code = name.contains(['_', '.']) || name.chars().skip(1).any(|c| c.is_ascii_uppercase());
        let missing = parts().find(|p| !p.starts_with(|c: char| c.is_ascii_digit()) && !self.words.contains(*p));
        let missing = missing.filter(|_| speaks && of_code && name.contains(|c: char| c.is_ascii_lowercase()))?;
        Some(format!("`{name}`: no source says `{missing}`"))
    }

    fn link_fault(&self, document: &str, link: &str) -> Option<String> {
        let (target, heading) = link.split_once('#').unwrap_or((link, ""));
        if target.contains("://") || target.starts_with("mailto:") {
            return None;
        }
        let folder = Path::new(document).parent().unwrap_or(Path::new(""));
        // A document may be shown elsewhere too, through a link to it.
        if run::root().join(document).is_symlink() {
            return None;
        }
        let path = if target.is_empty() { document.to_owned() } else { resolved(folder, target)? };
        if !self.paths.contains(&path) {
            return Some(format!("the link to {target} leads nowhere"));
        }
        let has = |anchors: &HashSet<String>| heading.is_empty() || anchors.contains(heading);
        (!self.anchors.get(&path).is_none_or(has)).then(|| format!("{path} has no heading #{heading}"))
    }

    /// Whether a path is there: from the root, from the document's folder, or as the end of a path. Paths whose first folder
    /// is none of ours are of others, or of what a run writes.
    fn has_path(&self, document: &str, path: &str) -> bool {
        let path = path.trim_end_matches('/').trim_start_matches("./");
        let first = path.split('/').next().unwrap_or_default();
        let shelved = || SHELVES.iter().any(|shelf| self.paths.contains(&format!("{shelf}/{first}")));
        let is_ours = SOURCES.iter().any(|e| has_ending(path, e)) || self.paths.contains(first) || shelved();
        let folder = Path::new(document).parent().unwrap_or(Path::new(""));
        let beside = || resolved(folder, path).is_none_or(|p| self.paths.contains(&p));
        let end = format!("/{path}");
        !is_ours || self.paths.contains(path) || beside() || self.paths.iter().any(|p| p.ends_with(&end))
    }

    /// `Type::name` and `module::Type::name`: each part is declared, and the last one in a file that knows the one before.
    /// Of what comes from other crates it is enough that a source says it.
    fn qualified_fault(&self, name: &str) -> Option<String> {
        let parts: Vec<&str> = name.split("::").filter(|p| !p.is_empty()).collect();
        if let Some(missing) = parts.iter().find(|p| !self.words.contains(**p)) {
            return Some(format!("`{name}`: no source says `{missing}`"));
        }
        let declares = |word: &str| self.sources.iter().any(|s| s.declared.contains(word));
        for pair in parts.windows(2).filter(|pair| is_type(pair[0]) && declares(pair[0])) {
            let holds = |s: &Source| {
                let knows = s.words.contains(pair[0]) && s.declared.contains(pair[1]);
                // A macro may give it to types that it does not name.
                let gives = s.words.contains("macro_rules") && s.declared.contains(pair[1]);
                knows || gives || (s.declared.contains(pair[0]) && s.words.contains(pair[1]))
            };
            if !self.sources.iter().any(holds) {
                return Some(format!("`{name}`: `{}` has no `{}`", pair[0], pair[1]));
            }
        }
        let last = parts.last().filter(|p| is_type(p) && self.paths.contains(&format!("crates/{}", parts[0])))?;
        (!declares(last)).then(|| format!("`{name}`: no source declares `{last}`"))
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn is_type(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_uppercase())
}

fn has_ending(path: &str, ending: &str) -> bool {
    path.strip_suffix(ending).is_some_and(|stem| stem.len() > 1 && stem.ends_with('.'))
}

/// A path as seen from a folder of the tree; none where it leads out of it.
fn resolved(folder: &Path, path: &str) -> Option<String> {
    let mut found = PathBuf::new();
    for part in folder.join(path).components() {
        match part {
            Component::ParentDir if !found.pop() => return None,
            Component::Normal(name) => found.push(name),
            _ => {}
        }
    }
    found.to_str().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree() -> Tree {
        let mut tree = Tree::default();
        tree.add(
            "crates/tracking/src/words/state.rs",
            "pub enum TrackState { Lost } impl Belief { fn judge(tracking: bool) }",
        );
        tree.add("crates/tracking/src/belief.rs", "pub struct Belief { turn_rate: f64 }  use tokio::sync::watch;");
        tree.add("docs/guide/targets.md", "");
        tree.anchors.insert("docs/guide/targets.md".into(), anchors::anchors("## States\n"));
        tree
    }

    fn code(text: &str) -> Option<String> {
        tree().fault("docs/guide/targets.md", &Claim::Code(text.to_owned()))
    }

    #[test]
    fn existing_names_pass() {
        for good in [
            "crates/tracking/src/words/",
            "tracking/src/belief.rs",
            "belief.rs",
            "TrackState::Lost",
            "Belief::judge(…)",
            "tokio::sync::watch",
            "tracking.turn_rate = 3",
            "pursuit-out/latest",
            "../shared/data",
            "y_k",
            "1/k",
            "--set a=b",
            "some words",
        ] {
            assert_eq!(code(good), None, "{good}");
        }
    }

    #[test]
    fn missing_names_are_found() {
        for bad in [
            "crates/tracking/src/roles.rs",
            "tracking/src/many",
            "roles.rs",
            "TrackState::Gone",
            "Belief::weigh()",
            "Beliefs::judge",
            "motion.turn_rate=3",
            "ColorModel",
            "learning_rate",
        ] {
            assert!(code(bad).is_some(), "{bad}");
        }
    }

    #[test]
    fn broken_links_are_found() {
        let link = |target: &str| tree().fault("docs/guide/targets.md", &Claim::Link(target.to_owned()));
        assert_eq!([link("../../crates"), link("targets.md#states"), link("https://a.b/c.md")], [None, None, None]);
        assert!(link("../papers/kcf.md").is_some());
        assert_eq!(link("#states"), None);
        assert!(link("#state").is_some() && link("targets.md#state").is_some());
    }

    #[test]
    fn claims_stand_in_prose_alone() {
        let text = "a `b` and [c](d.md)\n```\n`e`\n```\n    `f`\n`g`";
        let found: Vec<_> = claims(text.lines().enumerate()).collect();
        let code = |c: &str| Claim::Code(c.to_owned());
        assert_eq!(found, [(1, code("b")), (1, Claim::Link("d.md".to_owned())), (6, code("g"))]);
    }
}
