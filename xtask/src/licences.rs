//! Licences of the dependencies: permissive ones, and file-level copyleft.

use crate::metadata;
use anyhow::{Result, bail};

const ACCEPTED: &[&str] = &[
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "IJG",
    "ISC",
    "MIT",
    "MIT-0",
    "MPL-2.0",
    "NCSA",
    "OFL-1.1",
    "Ubuntu-font-1.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

pub fn check() -> Result<()> {
    let packages = metadata::packages()?;
    let refused: Vec<String> = packages
        .iter()
        .filter(|p| !p.ours && !p.license.as_deref().is_some_and(acceptable))
        .map(|p| format!("{}: {}", p.name, p.license.as_deref().unwrap_or("no licence stated")))
        .collect();
    if !refused.is_empty() {
        bail!("dependencies under licences we do not accept:\n  {}", refused.join("\n  "));
    }
    println!("licences: {} packages, all acceptable", packages.len());
    Ok(())
}

/// Whether an SPDX expression (`A OR B`, `A AND (B OR C)`, the old `A/B`) can be met with accepted licences.
fn acceptable(expression: &str) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    let met = alternatives(&words, &mut at);
    met && at == words.len()
}

fn alternatives(words: &[&str], at: &mut usize) -> bool {
    let mut met = conjunction(words, at);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        met |= conjunction(words, at);
    }
    met
}

fn conjunction(words: &[&str], at: &mut usize) -> bool {
    let mut met = one(words, at);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        met &= one(words, at);
    }
    met
}

fn one(words: &[&str], at: &mut usize) -> bool {
    let word = words.get(*at);
    // Also past the end, so that an expression that breaks off is not taken for a whole one.
    *at += 1;
    let Some(word) = word else { return false };
    if *word == "(" {
        let met = alternatives(words, at);
        let closed = words.get(*at) == Some(&")");
        *at += 1;
        return met && closed;
    }
    if words.get(*at) == Some(&"WITH") {
        let with = format!("{word} WITH {}", words.get(*at + 1).copied().unwrap_or_default());
        *at += 2;
        return ACCEPTED.contains(&with.as_str());
    }
    ACCEPTED.contains(word)
}

#[cfg(test)]
mod tests {
    use super::acceptable;

    #[test]
    fn expressions_are_read_as_spdx_means_them() {
        for good in [
            "MIT",
            "MIT/Apache-2.0",
            "GPL-3.0 OR MIT",
            "(MIT OR Apache-2.0) AND IJG",
            "Apache-2.0 WITH LLVM-exception OR MIT",
        ] {
            assert!(acceptable(good), "{good}");
        }
        for bad in ["", "GPL-3.0", "MIT AND GPL-2.0", "(MIT", "MIT OR", "MIT Apache-2.0"] {
            assert!(!acceptable(bad), "{bad}");
        }
    }
}
