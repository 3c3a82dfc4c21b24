//! `cargo xtask test`: what must hold before a change lands, and with `--whole` what is looked at every week.

use crate::needs::{self, Allowed, Need};
use crate::{
    api, book, browser, changed, delivery, features, fuzz, layers, licences, names, notices, peers, release, run,
    snippets, soak, wheel,
};
use anyhow::{Context, Result};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// How much is checked.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// What each commit should pass.
    Quick,
    /// What must hold before a change lands.
    Usual,
    /// The same, and what changes rarely and takes long: all seeds of the papers' experiments, other people's programs beside ours.
    Whole,
}

/// Seconds of the short form of `cargo xtask soak`.
const SOAK_SECONDS: u32 = 30;

/// What was left out, and why.
type Skipped = Vec<String>;

/// Says what it leaves out, and fails where something does not hold.
type Check = Box<dyn Fn(&mut Skipped) -> Result<()>>;

/// One check and what it takes.
struct Step {
    name: &'static str,
    /// Without these it is skipped.
    needs: Vec<&'static Need>,
    /// Without these it does less, which is said.
    wants: Vec<&'static Need>,
    check: Check,
}

impl Step {
    fn new(name: &'static str, check: impl Fn() -> Result<()> + 'static) -> Self {
        Self::skipping(name, move |_| check())
    }

    /// A step that may find out only when it runs that it cannot.
    fn skipping(name: &'static str, check: impl Fn(&mut Skipped) -> Result<()> + 'static) -> Self {
        Self { name, needs: Vec::new(), wants: Vec::new(), check: Box::new(check) }
    }

    fn needs(self, needs: impl Into<Vec<&'static Need>>) -> Self {
        Self { needs: needs.into(), ..self }
    }

    fn wants(self, wants: impl Into<Vec<&'static Need>>) -> Self {
        Self { wants: wants.into(), ..self }
    }

    fn all(&self) -> impl Iterator<Item = &'static Need> {
        self.needs.iter().chain(&self.wants).copied()
    }

    /// The first of its needs that cannot be had.
    fn lacks(&self, allowed: Allowed) -> Option<&'static Need> {
        self.needs.iter().copied().find(|need| !need.is_there() && !need.is_within_reach(allowed))
    }
}

/// What takes seconds, and the tests of the crates that were changed: for every commit.
fn quick() -> Vec<Step> {
    let mut steps = cheap();
    steps.push(
        Step::new("lints", || run::daily("clippy").arg("--workspace").args(LINTED).run()).needs([&needs::CLIPPY]),
    );
    steps.push(Step::new("tests of what is changed", changed::test).needs([&needs::GIT]));
    steps
}

/// The cheap steps first.
fn usual(fuzz_seconds: u32) -> Vec<Step> {
    let mut steps = cheap();
    steps.extend([
        Step::new("lints", || run::workspace("clippy").args(LINTED).run()).needs([&needs::CLIPPY]),
        Step::new("documentation", docs),
        Step::new("features", || features::check(features::USUAL)),
        Step::new("tests", || run::workspace("test").arg("--no-fail-fast").run())
            .wants([&needs::MOSQUITTO, &needs::NATS]),
        Step::new("release suite", || release::test(release::RELEASE)),
        Step::new("snippets", snippets::check),
        Step::skipping("workflows and Dockerfile", delivery::check_or_skip).needs(delivery::NEEDS),
        Step::skipping("book", book::build_or_skip).needs(book::NEEDS),
        match fuzz_seconds {
            // Building them with the compiler's counters takes longer than their tests, and a few seconds find little.
            0 => Step::new("fuzz targets", fuzz::check),
            seconds => Step::new("fuzzing", move || fuzz::run(seconds, None)),
        }
        .needs([&needs::COMPILER]),
        Step::skipping("browser", browser::test_or_skip).needs(browser::NEEDS),
        Step::skipping("made-up requests", api::test_or_skip).needs([&needs::PYTHON, &needs::API]),
        Step::skipping("wheel", wheel::make_or_skip).needs(wheel::NEEDS),
    ]);
    steps
}

/// The steps of a change, and then those that take long.
fn whole(fuzz_seconds: u32) -> Vec<Step> {
    let mut steps = usual(fuzz_seconds);
    steps.extend([
        Step::new("other features", || features::check(features::WHOLE)),
        Step::new("papers with all seeds", || release::test(release::WHOLE)),
    ]);
    if cfg!(target_os = "linux") {
        steps.push(Step::new("soak", || soak::run(SOAK_SECONDS)));
    }
    steps.extend([
        Step::skipping("wheel beside others", wheel::compare_or_skip).needs(wheel::BESIDE),
        Step::skipping("comparisons", peers::compare_or_skip).needs(peers::NEEDS),
    ]);
    steps
}

const LINTED: [&str; 4] = ["--all-targets", "--", "-D", "warnings"];

fn cheap() -> Vec<Step> {
    vec![
        Step::new("format", || run::cargo("fmt").args(["--all", "--check"]).run()).needs([&needs::RUSTFMT]),
        Step::new("names", names::check).needs([&needs::GIT]),
        Step::new("floors", layers::check),
        Step::new("lock files", fuzz::check_lock),
        Step::new("licences", licences::check),
        Step::new("notices", notices::check),
    ]
}

/// Runs the steps and stops at the first that fails. Before the first one it says what will be run, what is missing and what
/// will be installed; with `install` off nothing is installed, and what needs it is skipped.
pub fn test(extent: Extent, fuzz_seconds: u32, install: bool) -> Result<()> {
    let steps = match extent {
        Extent::Quick => quick(),
        Extent::Usual => usual(fuzz_seconds),
        Extent::Whole => whole(fuzz_seconds),
    };
    let mut allowed = Allowed::new(install);
    say_plan(&steps, allowed);
    allowed.system &= is_agreed(&steps, allowed);
    let (mut skipped, mut clock) = (Skipped::new(), Clock::default());
    let taken = steps.iter().filter(|step| step.lacks(allowed).is_none());
    for need in taken.flat_map(Step::all).filter(|need| need.is_within_reach(allowed)) {
        need.bring();
    }
    // What could not be brought now is not to be had.
    allowed.system = false;
    // Packages of registries come while the first steps compile.
    let wanted: Vec<&'static Need> = steps.iter().filter(|s| s.lacks(allowed).is_none()).flat_map(Step::all).collect();
    let mut fetching = allowed.folders.then(|| std::thread::spawn(move || wanted.iter().for_each(|need| need.fetch())));
    for step in &steps {
        if step.all().any(Need::is_of_registry)
            && let Some(fetching) = fetching.take()
        {
            let _ = fetching.join();
        }
        skipped.extend(step.wants.iter().filter(|n| !n.is_there()).map(|n| format!("{}, in part: no {n}", step.name)));
        match step.lacks(allowed) {
            Some(need) => skipped.push(format!("{}: no {need}", step.name)),
            None => clock.time(step.name, || (step.check)(&mut skipped))?,
        }
    }
    match extent {
        Extent::Quick => skipped.push("what `cargo xtask test` without --quick does besides".into()),
        Extent::Usual => skipped.push("what `cargo xtask test --whole` does besides, once a week".into()),
        Extent::Whole => {}
    }
    report(&skipped, &clock);
    Ok(())
}

/// What each step lacks, and where that will come from.
fn say_plan(steps: &[Step], allowed: Allowed) {
    println!("Steps:");
    for step in steps {
        if let Some(need) = step.lacks(allowed) {
            println!("  {} (skipped)\n    missing: {need}", step.name);
            continue;
        }
        println!("  {}", step.name);
        for need in step.all().filter(|need| !need.is_there()) {
            println!("    {} {need}", if need.is_within_reach(allowed) { "will be installed:" } else { "missing:" });
        }
    }
    if !allowed.folders {
        println!("Nothing is installed (--no-install).");
    }
}

/// Whether packages of the system may be installed: whoever sits before a terminal is asked.
fn is_agreed(steps: &[Step], allowed: Allowed) -> bool {
    let asked = || steps.iter().flat_map(Step::all).any(|need| need.is_of_system() && need.is_within_reach(allowed));
    if !std::io::stdin().is_terminal() || !asked() {
        return true;
    }
    println!("Shall the packages of the system be installed? [Y/n]");
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer).is_ok() && !answer.trim().to_lowercase().starts_with('n')
}

/// How long each check took.
#[derive(Default)]
struct Clock(Vec<(&'static str, Duration)>);

impl Clock {
    fn time(&mut self, what: &'static str, check: impl FnOnce() -> Result<()>) -> Result<()> {
        let start = Instant::now();
        let result = check();
        let took = start.elapsed();
        println!("\n{what}: {} s", took.as_secs());
        self.0.push((what, took));
        result.with_context(|| format!("{what}, after {self}"))
    }
}

impl std::fmt::Display for Clock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let words: Vec<String> = self.0.iter().map(|(what, took)| format!("{what} {} s", took.as_secs())).collect();
        write!(f, "{}", words.join(", "))
    }
}

/// Builds the documentation, with broken links and missing pieces as errors.
pub fn docs() -> Result<()> {
    run::workspace("doc").arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings").run()
}

fn report(skipped: &[String], clock: &Clock) {
    println!("\n{clock}");
    if skipped.is_empty() {
        println!(
            "Everything passed; nothing was skipped by cargo xtask. Tests that lack real footage say `skipped:` themselves."
        );
    } else {
        println!("Everything that could be run passed. Skipped:");
        skipped.iter().for_each(|s| println!("  - {s}"));
    }
}
