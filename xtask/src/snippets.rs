//! The commands of the book, run as they stand, and its pieces of Rust, held to the programs that they were taken from.
//!
//! In `docs/book` a block of `sh` is run: all those of a page one after the other, in an empty folder, with the `pursuit` that the
//! suite has built. A block of `text` is shown only. A block of `rust` stands after a comment that names a program of `examples`,
//! which holds it word for word.

use crate::run;
use anyhow::{Context, Result, bail};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The pages.
const BOOK: &str = "docs/book";

/// Runs all blocks of all pages.
pub fn check() -> Result<()> {
    run::build_programs()?;
    let programs = programs()?;
    let mut count = 0;
    for page in pages()? {
        let blocks = blocks(&std::fs::read_to_string(&page)?);
        let name = page.strip_prefix(run::root()).unwrap_or(&page).display().to_string();
        for block in blocks.iter().filter(|b| b.language == "rust") {
            held(block).with_context(|| format!("{name}:{}", block.line))?;
            count += 1;
        }
        let commands: Vec<&Block> = blocks.iter().filter(|b| b.language == "sh").collect();
        if !commands.is_empty() {
            run_page(&name, &commands, &programs)?;
            count += commands.len();
        }
    }
    println!("snippets: {count} blocks of {BOOK} do what they say");
    Ok(())
}

/// All pages of the book, in the order of their names.
fn pages() -> Result<Vec<PathBuf>> {
    let (mut folders, mut pages) = (vec![run::root().join(BOOK)], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    Ok(pages)
}

/// A folder in which `pursuit` is the one that the suite has built, and `tour` the programs of `examples`.
pub fn programs() -> Result<PathBuf> {
    let folder = std::path::absolute(run::target_dir().join("snippets/bin"))?;
    std::fs::create_dir_all(&folder)?;
    for (name, product) in [("pursuit", "pursuit"), ("tour", "examples/tour")] {
        let link = folder.join(name);
        if link.symlink_metadata().is_ok() {
            std::fs::remove_file(&link)?;
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(run::product(product)?, &link)?;
        #[cfg(not(unix))]
        std::fs::copy(run::product(product)?, &link)?;
    }
    Ok(folder)
}

/// The path with those programs before all others.
pub fn path(programs: &Path) -> Result<OsString> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    Ok(std::env::join_paths(std::iter::once(programs.to_path_buf()).chain(std::env::split_paths(&path)))?)
}

/// A fenced block.
#[derive(Debug, PartialEq)]
struct Block {
    language: String,
    /// Number of its first line, from 1.
    line: usize,
    text: String,
    /// What the comment on the line before it says.
    source: Option<String>,
}

fn blocks(page: &str) -> Vec<Block> {
    let (mut blocks, mut open, mut source): (Vec<Block>, Option<Block>, Option<String>) = (Vec::new(), None, None);
    for (number, line) in page.lines().enumerate() {
        if let Some(language) = line.strip_prefix("```") {
            match open.take() {
                Some(block) => blocks.push(block),
                None => {
                    let language = language.trim().to_owned();
                    open = Some(Block { language, line: number + 2, text: String::new(), source: source.take() });
                }
            }
        } else if let Some(block) = &mut open {
            block.text.push_str(line);
            block.text.push('\n');
        } else if !line.trim().is_empty() {
            source = line.strip_prefix("<!-- ").and_then(|l| l.strip_suffix(" -->")).map(str::to_owned);
        }
    }
    blocks
}

/// Whether a block of Rust stands in the program that it names, indented or not.
fn held(block: &Block) -> Result<()> {
    let source = block.source.as_ref().context("a block of Rust without the comment that names its program")?;
    let program = std::fs::read_to_string(run::root().join(source)).with_context(|| source.clone())?;
    if !is_part(&block.text, &program) {
        bail!("{source} has no such lines; take them from there anew");
    }
    Ok(())
}

/// Whether the lines stand one after the other, whatever all of them are indented by.
fn is_part(part: &str, whole: &str) -> bool {
    let trimmed = |text: &str| text.lines().map(|l| l.trim().to_owned()).collect::<Vec<_>>();
    let (part, whole) = (trimmed(part.trim()), trimmed(whole));
    whole.windows(part.len().max(1)).any(|window| window == part)
}

/// Runs the blocks of a page in an empty folder; the first command that fails is named by its line.
fn run_page(name: &str, blocks: &[&Block], programs: &Path) -> Result<()> {
    let folder = run::target_dir().join("snippets").join(name.replace('/', "-").trim_end_matches(".md"));
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    let mut script = String::from("set -euo pipefail\n");
    for block in blocks {
        script.push_str(&format!("echo '{name}:{}' >&2\n{}", block.line, block.text));
    }
    run::program("bash").args(["-c", &script]).in_folder(&folder).env("PATH", path(programs)?).quietly(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_know_their_language_line_and_source() {
        let page = "# A\n\n```sh\npursuit man\n```\n<!-- examples/imm.rs -->\n```rust\nlet a = 1;\nlet b = 2;\n```\ntext\n```text\nno\n```\n";
        let found = blocks(page);
        let seen: Vec<_> = found.iter().map(|b| (b.language.as_str(), b.line, b.source.as_deref())).collect();
        assert_eq!(seen, [("sh", 4, None), ("rust", 8, Some("examples/imm.rs")), ("text", 13, None)]);
        assert_eq!(found[1].text, "let a = 1;\nlet b = 2;\n");
    }

    #[test]
    fn a_part_is_found_whatever_it_is_indented_by() {
        let whole = "fn main() {\n    let a = 1;\n    if a > 0 {\n        go();\n    }\n}\n";
        assert!(is_part("let a = 1;\nif a > 0 {\n    go();\n}\n", whole));
        assert!(!is_part("let a = 1;\ngo();\n", whole));
        assert!(!is_part("let a = 2;\n", whole));
    }
}
