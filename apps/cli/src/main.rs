//! The command `pursuit`: arguments in, calls of the facade, results out.

mod args;
mod commands;
mod console;
mod memory;
mod networks;

use args::{Cli, Command};
use clap::Parser;
use pursuit::RunError;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    console::set_up(&cli.global);
    match run(&cli) {
        Ok(code) => console::interrupted().unwrap_or(code),
        Err(error) => fail(&error),
    }
}

fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    let only_prints =
        matches!(cli.command, Some(Command::Licences | Command::Completions { .. } | Command::Man { .. }));
    if !(cli.version || only_prints) {
        // Before any thread: a limit too low for their stacks is told as a limit.
        memory::check(0)?;
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads(cli.global.threads)).build_global()?;
    if cli.version {
        return commands::version::run(cli.global.verbose > 0);
    }
    let Some(command) = &cli.command else {
        return Err(RunError::usage("say what to do: a command is missing; `pursuit --help` lists them").into());
    };
    match command {
        Command::Demo(args) => commands::demo::run(args, &cli.global),
        Command::Track(args) => commands::track::run(args, &cli.global),
        Command::Associate(args) => commands::associate::run(args),
        Command::Calibrate(args) => commands::measure::calibrate(args),
        Command::Measure(args) => commands::measure::run(args),
        Command::Batch(args) => commands::batch::run(args, &cli.global),
        Command::Eval(args) => commands::eval::run(args, &cli.global),
        Command::Survey(args) => commands::survey::run(args, &cli.global),
        Command::Flow(args) => commands::flow::run(args, &cli.global),
        #[cfg(feature = "reproduce")]
        Command::Reproduce(args) => commands::reproduce::run(args),
        #[cfg(feature = "studio")]
        Command::Studio(args) => commands::studio::run(args),
        #[cfg(feature = "mavlink")]
        Command::Mavlink(args) => commands::mavlink::run(args, &cli.global),
        Command::Ptz(args) => commands::ptz::run(args, &cli.global),
        Command::Trackers(args) => commands::trackers::run(args),
        Command::Licences => commands::licences::run(),
        Command::Completions { shell } => commands::completions(*shell),
        Command::Man { path, out } => commands::man(path, out.as_deref()),
    }
}

/// As many threads as asked for, up to a few a processor: more would only be in each other's way. 0 leaves the choice to the
/// pool.
fn threads(wanted: usize) -> usize {
    let most = 4 * std::thread::available_parallelism().map_or(1, usize::from);
    if wanted > most {
        tracing::warn!("--threads {wanted} is more than this machine can use; {most} threads are started");
    }
    wanted.min(most)
}

/// One line on standard error, and the exit status that belongs to the error.
pub(crate) fn fail(error: &anyhow::Error) -> ExitCode {
    if is_broken_pipe(error) {
        // Whoever read our output has seen enough.
        return ExitCode::SUCCESS;
    }
    anstream::eprintln!("{}: {}", console::ERROR, console::printable(&message(error)));
    let of_run = error.downcast_ref::<RunError>().map(RunError::exit_code);
    let of_experiment = || {
        #[cfg(feature = "reproduce")]
        return error.downcast_ref().map(pursuit_experiments::ExperimentError::exit_code);
        #[cfg(not(feature = "reproduce"))]
        None
    };
    ExitCode::from(of_run.or_else(of_experiment).unwrap_or(1))
}

/// What went wrong, each cause once: errors of runs name theirs themselves.
fn message(error: &anyhow::Error) -> String {
    error.downcast_ref::<RunError>().map_or_else(|| format!("{error:#}"), RunError::to_string)
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.chain().find_map(|e| e.downcast_ref::<std::io::Error>());
    io.is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}
