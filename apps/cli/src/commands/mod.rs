//! One file a command.

pub mod associate;
pub mod batch;
pub mod credentials;
pub mod demo;
pub mod eval;
mod eval_many;
pub mod flow;
pub mod licences;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod measure;
pub mod ptz;
#[cfg(feature = "reproduce")]
pub mod reproduce;
#[cfg(feature = "studio")]
pub mod studio;
pub mod survey;
pub mod track;
pub mod trackers;
pub mod version;

use crate::args::Cli;
use clap::CommandFactory;
use clap_complete::Shell;
use pursuit::RunError;
use pursuit::config::parse_setting;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Takes what is said of a run besides, for those who watch it.
pub type Remarks = Box<dyn Fn(String) + Send>;

/// `pursuit completions SHELL`.
pub fn completions(shell: Shell) -> anyhow::Result<ExitCode> {
    print(&completion_script(shell))
}

/// What a shell reads to complete our command line.
pub fn completion_script(shell: Shell) -> Vec<u8> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "pursuit", &mut script);
    script
}

/// `pursuit man`: the manual; of all commands after one another, of one, or each in a file of its own.
pub fn man(path: &[String], out: Option<&Path>) -> anyhow::Result<ExitCode> {
    let mut root = Cli::command();
    root.build();
    if let Some(folder) = out {
        std::fs::create_dir_all(folder).map_err(RunError::output(folder))?;
        return write_pages(&named(&root, "pursuit"), folder).map(|()| ExitCode::SUCCESS);
    }
    if path.is_empty() {
        return print(&manual(&root)?);
    }
    let (mut command, mut whole) = (root.clone(), "pursuit".to_owned());
    for word in path {
        let Some(found) = subcommands(&command).find(|c| c.get_name() == word) else {
            let names: Vec<&str> = subcommands(&command).map(clap::Command::get_name).collect();
            return Err(RunError::usage(format!("{whole} has no command `{word}`; it has {}", names.join(", "))).into());
        };
        command = named(found, &whole);
        whole = format!("{whole} {word}");
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page)?;
    print(&page)
}

/// The manual of `root` and of all commands below it, after one another.
pub fn manual(root: &clap::Command) -> anyhow::Result<Vec<u8>> {
    let mut page = Vec::new();
    clap_mangen::Man::new(root.clone()).render(&mut page)?;
    subcommands(root).try_for_each(|sub| section(&named(sub, "pursuit"), &mut page))?;
    Ok(page)
}

/// The commands of `command` that have a page: `help` has none.
fn subcommands(command: &clap::Command) -> impl Iterator<Item = &clap::Command> {
    command.get_subcommands().filter(|c| c.get_name() != "help")
}

/// `command` under its whole name.
fn named(command: &clap::Command, parent: &str) -> clap::Command {
    if command.get_name() == parent {
        return command.clone();
    }
    let words = format!("{parent} {}", command.get_name());
    command.clone().display_name(words.replace(' ', "-")).bin_name(words)
}

/// The sections of a command, and of those below it, for the manual of everything.
fn section(command: &clap::Command, page: &mut Vec<u8>) -> anyhow::Result<()> {
    let man = clap_mangen::Man::new(command.clone());
    man.render_name_section(page)?;
    man.render_synopsis_section(page)?;
    man.render_description_section(page)?;
    man.render_options_section(page)?;
    let name = command.get_bin_name().unwrap_or_default();
    subcommands(command).try_for_each(|sub| section(&named(sub, name), page))
}

/// A page for `command` and for each below it.
fn write_pages(command: &clap::Command, folder: &Path) -> anyhow::Result<()> {
    let name = command.get_bin_name().unwrap_or("pursuit");
    let path = folder.join(format!("{}.1", name.replace(' ', "-")));
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    std::fs::write(&path, page).map_err(RunError::output(&path))?;
    subcommands(command).try_for_each(|sub| write_pages(&named(sub, name), folder))
}

/// What `--set` says, in every command.
pub fn settings(texts: &[String]) -> Result<toml::Table, RunError> {
    texts.iter().map(|s| parse_setting(s)).collect()
}

/// Writes results to standard output; a reader that has gone away is an error that `main` takes for success.
pub fn print(bytes: &[u8]) -> anyhow::Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}
