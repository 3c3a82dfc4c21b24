//! Tells the program which commit it is built from: from git in a checkout, from what `cargo package` noted in a published
//! crate, and `unknown` elsewhere.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = packaged().or_else(checked_out).unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=PURSUIT_COMMIT={commit}");
}

/// The commit noted in a published crate.
fn packaged() -> Option<String> {
    let note = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let after = note.split_once("\"sha1\"")?.1;
    let commit = after.split('"').nth(1)?;
    short(commit)
}

/// The commit of the checkout, which is looked at again when it changes.
fn checked_out() -> Option<String> {
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo::rerun-if-changed={log}");
    }
    short(&git(&["rev-parse", "HEAD"])?)
}

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

/// Twelve digits, if it is a commit at all.
fn short(commit: &str) -> Option<String> {
    (commit.len() >= 12 && commit.bytes().all(|b| b.is_ascii_hexdigit())).then(|| commit.chars().take(12).collect())
}
