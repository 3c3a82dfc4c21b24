//! Mutation testing: can the tests fail? Every module named here is changed in many small ways by `cargo mutants`, and its
//! crate's own tests must notice.

use crate::run;
use anyhow::{Context, Result, bail};
use std::collections::BTreeSet;
use std::path::Path;

/// Name, package, and the files that are changed.
const MODULES: &[(&str, &str, &[&str])] = &[
    ("loop", "pursuit-tracking", &["crates/tracking/src/single_target.rs"]),
    ("policy", "pursuit-tracking", &["crates/tracking/src/policy/**"]),
    ("search", "pursuit-tracking", &["crates/tracking/src/search/**"]),
    ("motion", "pursuit-tracking", &["crates/tracking/src/motion/**"]),
    ("parameters", "pursuit-parameters", &["crates/parameters/src/**"]),
    ("recipes", "pursuit-tracking", &["crates/tracking/src/recipe.rs"]),
    ("many", "pursuit-tracking", &["crates/tracking/src/many/**"]),
    ("session", "pursuit", &["crates/pursuit/src/session/**", "crates/pursuit/src/config/**"]),
    ("sinks", "pursuit", &["crates/pursuit/src/sinks/**"]),
    ("metrics", "pursuit-evaluation", &["crates/evaluation/src/metrics/**"]),
    ("filters", "pursuit-estimation", &["crates/estimation/src/gaussian.rs", "crates/estimation/src/imm/**"]),
    ("charts", "pursuit-charts", &["crates/charts/src/**"]),
    ("containers", "pursuit-containers", &["crates/containers/src/**"]),
];

/// Survivors that change nothing anybody could notice, one a line: `FILE: MUTATION | REASON`.
const EQUIVALENT: &str = "xtask/mutants.txt";

/// Runs the modules named, all without a name, and reports what survived.
pub fn run(names: &[String], jobs: usize) -> Result<()> {
    let known: Vec<&str> = MODULES.iter().map(|m| m.0).collect();
    if let Some(unknown) = names.iter().find(|n| !known.contains(&n.as_str())) {
        bail!("there is no module `{unknown}`; there are: {}", known.join(", "));
    }
    let program = installed()?;
    let listed =
        std::fs::read_to_string(run::root().join(EQUIVALENT)).with_context(|| format!("cannot read {EQUIVALENT}"))?;
    let equivalent = equivalents(&listed)?;
    let mut survivors = 0;
    for (name, package, files) in MODULES.iter().filter(|m| names.is_empty() || names.iter().any(|n| n == m.0)) {
        let output = run::target_dir().join("mutants").join(name);
        std::fs::create_dir_all(&output)?;
        let mut step =
            run::program(&program).args(["mutants", "--package", package, "--no-shuffle", "--colors", "never"]);
        for file in *files {
            step = step.args(["--file", file]);
        }
        let step =
            step.args(["--jobs", &jobs.max(1).to_string(), "--minimum-test-timeout", "60", "--output"]).arg(&output);
        // Survivors end it with an error too; what it left says which.
        let ended = step.run();
        let folder = output.join("mutants.out");
        let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap_or_default();
        let outcome = Outcome::of(&read("caught.txt"), &(read("missed.txt") + &read("timeout.txt")), &equivalent);
        if outcome.caught + outcome.equivalent + outcome.survivors.len() == 0 {
            ended.with_context(|| format!("no mutant of `{name}` was tested"))?;
        }
        println!("\n{name}: {outcome}");
        survivors += outcome.survivors.len();
    }
    println!("\n{survivors} survivors in all; tests for them, or lines with a reason in {EQUIVALENT}, are welcome");
    Ok(())
}

/// `cargo-mutants`, installed beside the build products where it is not there yet.
fn installed() -> Result<std::path::PathBuf> {
    let root = run::target_dir().join("cargo-mutants");
    let program = std::path::absolute(root.join("bin").join(format!("cargo-mutants{}", std::env::consts::EXE_SUFFIX)))?;
    if !Path::new(&program).is_file() {
        run::cargo("install").args(["cargo-mutants", "--locked", "--root"]).arg(&root).run()?;
    }
    Ok(program)
}

/// A mutant without the line and column, which change with every edit: `FILE: MUTATION`.
fn lasting(mutant: &str) -> Option<String> {
    let (place, mutation) = mutant.split_once(": ")?;
    Some(format!("{}: {}", place.split(':').next()?, mutation.trim()))
}

fn equivalents(text: &str) -> Result<BTreeSet<String>> {
    let lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#'));
    lines
        .map(|line| match line.split_once(" | ") {
            Some((mutant, reason)) if !reason.trim().is_empty() => Ok(mutant.trim().to_owned()),
            _ => bail!("{EQUIVALENT}: no reason in `{line}`; write FILE: MUTATION | REASON"),
        })
        .collect()
}

/// What became of a module's mutants.
#[derive(Debug, PartialEq)]
struct Outcome {
    caught: usize,
    equivalent: usize,
    survivors: Vec<String>,
}

impl Outcome {
    fn of(caught: &str, missed: &str, equivalent: &BTreeSet<String>) -> Self {
        let (known, survivors): (Vec<&str>, Vec<&str>) =
            missed.lines().partition(|m| lasting(m).is_some_and(|m| equivalent.contains(&m)));
        let survivors = survivors.into_iter().map(str::to_owned).collect();
        Self { caught: caught.lines().count(), equivalent: known.len(), survivors }
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let judged = self.caught + self.survivors.len();
        let share = 100.0 * self.caught as f64 / judged.max(1) as f64;
        write!(f, "{} of {judged} caught ({share:.0} %), {} equivalent", self.caught, self.equivalent)?;
        self.survivors.iter().try_for_each(|s| write!(f, "\n  survived: {s}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survivors_are_told_from_equivalents_wherever_they_stand_now() {
        let listed = equivalents("# why\n\na/b.rs: replace x -> y | nobody sees it\n").unwrap();
        let outcome = Outcome::of("m\nn\n", "a/b.rs:7:3: replace x -> y\na/b.rs:9:1: replace z\n", &listed);
        assert_eq!((outcome.caught, outcome.equivalent), (2, 1));
        assert_eq!(outcome.survivors, ["a/b.rs:9:1: replace z"]);
        assert!(outcome.to_string().starts_with("2 of 3 caught (67 %), 1 equivalent\n  survived: a/b.rs:9:1"));
        assert!(equivalents("a/b.rs: replace x | ").is_err());
    }

    #[test]
    fn the_modules_are_there() {
        for (name, package, files) in MODULES {
            for file in *files {
                assert!(run::root().join(file.trim_end_matches("/**")).exists(), "{name}: {file}");
                assert!(file.starts_with("crates/") && package.starts_with("pursuit"), "{name}");
            }
        }
    }
}
