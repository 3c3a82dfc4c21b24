//! One file a command.

pub mod demo;
pub mod eval;
pub mod licences;
pub mod ptz;
#[cfg(feature = "reproduce")]
pub mod reproduce;
pub mod track;
pub mod trackers;
pub mod version;

use crate::args::Cli;
use clap::CommandFactory;
use clap_complete::Shell;
use pursuit::RunError;
use pursuit::config::parse_setting;
use std::io::Write;
use std::process::ExitCode;

/// `pursuit completions SHELL`.
pub fn completions(shell: Shell) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "pursuit", &mut script);
    print(&script)
}

/// `pursuit man`: the manual page, those of all commands after one another.
pub fn man() -> anyhow::Result<ExitCode> {
    let mut command = Cli::command();
    command.build();
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    for sub in command.get_subcommands().filter(|c| c.get_name() != "help") {
        let named = sub.clone().display_name(format!("pursuit {}", sub.get_name()));
        let man = clap_mangen::Man::new(named);
        man.render_name_section(&mut page)?;
        man.render_synopsis_section(&mut page)?;
        man.render_description_section(&mut page)?;
        man.render_options_section(&mut page)?;
    }
    print(&page)
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
