//! The book: `docs` as pages that can be read without a network, with a reference made by the program itself. Dead links and
//! anchors are errors.

use crate::needs::{self, Need};
use crate::{peers, run};
use anyhow::Result;

/// What it is built with.
pub const NEEDS: [&Need; 2] = [&needs::PYTHON, &needs::BOOK];

/// Builds it into `target/book`.
pub fn build() -> Result<()> {
    let python = peers::environment("book-builder", "book.txt")?;
    run::build_programs()?;
    let site = std::path::absolute(run::target_dir().join("book"))?;
    run::program(python)
        .args(["-m", "mkdocs", "build", "--quiet", "--strict", "--clean", "--site-dir"])
        .arg(&site)
        .env("PURSUIT", run::product("pursuit")?)
        // It would tell of the next version of its theme.
        .env("NO_MKDOCS_2_WARNING", "1")
        .run()?;
    println!("book: {}", site.join("index.html").display());
    Ok(())
}

/// The same, where Python and its packages can be had.
pub fn build_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match peers::environment("book-builder", "book.txt") {
        Ok(_) => build(),
        Err(why) => {
            skipped.push(format!("the book: {why:#}"));
            Ok(())
        }
    }
}
