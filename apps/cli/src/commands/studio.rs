use super::Remarks;
use crate::args::Studio;
use crate::console;
use pursuit::media::{Locator, OpenOptions};
use pursuit::{Run, RunConfig, RunError, open_with};
use pursuit_studio::{Options, Server, StudioError, Watch};
use std::io::{IsTerminal, Write};
use std::process::{Command, ExitCode, Stdio};
use std::sync::atomic::Ordering;

/// `pursuit studio [INPUT]`: until Ctrl-C.
pub fn run(args: &Studio) -> anyhow::Result<ExitCode> {
    let input = args.input.clone().map(Locator::from);
    let open = OpenOptions::from_env();
    if let Some(input) = &input {
        check(input, &open)?;
    }
    let options = Options {
        input,
        host: args.host.clone(),
        port: args.port,
        root: args.root.clone(),
        open,
        ..Options::default()
    };
    let server = Server::open(options).map_err(|error| match error {
        StudioError::System(_) => anyhow::Error::from(error),
        wrong => RunError::usage(wrong.to_string()).into(),
    })?;
    let url = server.url();
    let mut out = std::io::stdout().lock();
    writeln!(out, "{url}")?;
    out.flush()?;
    drop(out);
    if !args.no_open && std::io::stdout().is_terminal() {
        open_browser(&url);
    }
    let stop = console::stop_flag();
    server.run(|| stop.load(Ordering::Relaxed))?;
    // Ctrl-C is how a studio is closed.
    Ok(ExitCode::SUCCESS)
}

/// `pursuit track … --pick`: the configuration with the box that the user draws, and the frame it is drawn in for the first.
/// `None` when the user gave up (Ctrl-C).
pub fn pick(config: RunConfig, open: &OpenOptions) -> anyhow::Result<Option<RunConfig>> {
    let Some(input) = config.input.clone() else { return Ok(Some(config)) };
    check(&input, open)?;
    let name = input.to_string();
    let options = Options { input: Some(input), pick: true, open: open.clone(), ..Options::default() };
    let server = Server::open(options)?;
    let url = server.url();
    // Results on standard output, everything else here.
    anstream::eprintln!("draw a box around the target in {name}: {url}");
    if std::io::stderr().is_terminal() {
        open_browser(&url);
    }
    let stop = console::stop_flag();
    let picked = server.pick(|| stop.load(Ordering::Relaxed))?;
    Ok(picked.map(|picked| {
        let (l, t, w, h) = picked.bbox.ltwh();
        let from = (picked.frame > 0 || config.from.is_some()).then_some(picked.frame);
        RunConfig { boxes: vec![[l, t, w, h]], from, ..config }
    }))
}

/// `--watch`: has the run carried out while whoever opens the address printed can look at it. `carry_out` is also given what
/// takes remarks to be shown.
pub fn watched(run: Run, carry_out: impl FnOnce(Run, Remarks) -> anyhow::Result<ExitCode>) -> anyhow::Result<ExitCode> {
    let recipe = run.recipe();
    let watch = Watch::open(run.input().clone(), &recipe.tracker, recipe.parameters.clone())?;
    // Results on standard output, everything else here.
    anstream::eprintln!("watch {} at {}", console::printable(&run.input().name), watch.url());
    let sink = watch.sink();
    let outcome = carry_out(run.with_sink(sink), Box::new(watch.remarks()));
    watch.end(outcome.as_ref().err().map(ToString::to_string));
    outcome
}

/// An input that cannot be read is an error here, where it was named, and not in the page. Live ones are opened there: some
/// can be opened only once.
fn check(input: &Locator, open: &OpenOptions) -> Result<(), RunError> {
    let name = input.reveal();
    if name == "-" {
        return Err(RunError::usage("the studio goes back and forth, which standard input cannot; name a file"));
    }
    let live = name.contains("://") || name.starts_with("camera:") || name.starts_with("/dev/");
    if live { Ok(()) } else { open_with(input.clone(), open).map(drop) }
}

/// On a desktop, the browser that the user has chosen there; where there is none, the address printed must do.
fn open_browser(url: &str) {
    let (program, first): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("explorer", &[])
    } else {
        ("xdg-open", &[])
    };
    let started = Command::new(program)
        .args(first)
        .arg(url)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Err(error) = started {
        tracing::info!("no browser was opened ({program}: {error})");
    }
}
