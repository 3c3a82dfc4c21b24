//! What the user sees while it runs: colours, log lines, the progress bar, Ctrl-C.

use crate::args::{ColorWhen, Global};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pursuit::media::Locator;
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// The word before an error.
pub const ERROR: &str = "\u{1b}[1;31merror\u{1b}[0m";

/// Colours and log lines as asked for.
pub fn set_up(global: &Global) {
    let choice = match global.color {
        ColorWhen::Auto => anstream::ColorChoice::Auto,
        ColorWhen::Always => anstream::ColorChoice::Always,
        ColorWhen::Never => anstream::ColorChoice::Never,
    };
    choice.write_global();
    let level = match (global.quiet, global.verbose) {
        (true, _) => LevelFilter::ERROR,
        (false, 0) => LevelFilter::WARN,
        (false, 1) => LevelFilter::INFO,
        (false, _) => LevelFilter::DEBUG,
    };
    let colored = match global.color {
        ColorWhen::Auto => std::io::stderr().is_terminal(),
        ColorWhen::Always => true,
        ColorWhen::Never => false,
    };
    let lines = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_ansi(colored)
        .without_time()
        .with_target(global.verbose > 1)
        .finish();
    // What this library says is said in our words too.
    let told_twice = if global.verbose > 1 { level } else { LevelFilter::OFF };
    lines.with(Targets::new().with_default(level).with_target("async_nats", told_twice)).init();
}

/// Text with what a terminal would take for a command shown as `\u{1b}`: names of files come from anybody.
pub fn printable(text: &str) -> String {
    let shown = |c: char| !c.is_control() || c == '\n' || c == '\t';
    text.chars().fold(String::with_capacity(text.len()), |mut out, c| {
        if shown(c) {
            out.push(c)
        } else {
            out.extend(c.escape_unicode())
        }
        out
    })
}

/// A bar on a terminal, nothing when piped or when told to be quiet.
pub fn progress_bar(total: Option<u64>, global: &Global) -> ProgressBar {
    let hidden = global.quiet || !std::io::stderr().is_terminal();
    let target = if hidden { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(total, target);
    let template = match total {
        Some(_) => "{bar:30} {pos}/{len}  {per_sec}  {msg}  {eta} left",
        None => "{spinner} {pos}  {per_sec}  {msg}",
    };
    // The templates above are fixed and valid.
    bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// Does what may wait for a camera or a server, and says so where it takes more than a moment. `input` is as the user gave it; of a
/// file nothing is said.
pub fn connecting<T>(input: Option<&Locator>, global: &Global, open: impl FnOnce() -> T) -> T {
    /// Whoever waits for longer wonders.
    const MOMENT: Duration = Duration::from_millis(500);
    let far = |input: &&Locator| input.scheme().is_some_and(|scheme| !matches!(scheme, "scene" | "file"));
    let Some(input) = input.filter(far).filter(|_| !global.quiet) else { return open() };
    let (opened, waits) = std::sync::mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            if waits.recv_timeout(MOMENT) == Err(RecvTimeoutError::Timeout) {
                anstream::eprintln!("{}", printable(&format!("connecting to {input} …")));
            }
        });
        let outcome = open();
        drop(opened);
        outcome
    })
}

static STOP: AtomicBool = AtomicBool::new(false);
/// The signal that asked to stop; 0 while none has.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// What ends the run in hand.
static STOPPER: Mutex<Option<Box<dyn Fn() + Send>>> = Mutex::new(None);

/// Calls `stop`, and no longer what was given before, at Ctrl-C, or when the process is asked to terminate or loses its
/// terminal. A second time ends the program at once.
pub fn on_interrupt(stop: impl Fn() + Send + 'static) {
    let stopper = || STOPPER.lock().unwrap_or_else(PoisonError::into_inner);
    if stopper().replace(Box::new(stop)).is_some() {
        return;
    }
    let handler = move |signal: u8| {
        SIGNAL.store(signal, Ordering::Relaxed);
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(status_of(signal)));
        }
        anstream::eprintln!("stopping after this frame (Ctrl-C again to stop at once)");
        stopper().iter().for_each(|stop| stop());
    };
    if let Err(e) = listen(handler) {
        tracing::warn!("Ctrl-C will stop at once, without closing files: {e}");
    }
}

#[cfg(unix)]
fn listen(handler: impl Fn(u8) + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    let listener = move || signals.forever().for_each(|signal| handler(signal as u8));
    std::thread::Builder::new().name("signals".to_owned()).spawn(listener).map(|_| ())
}

#[cfg(not(unix))]
fn listen(handler: impl Fn(u8) + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || handler(2))
}

/// The exit status of a program that a signal ended, as shells count it.
const fn status_of(signal: u8) -> u8 {
    128 + signal
}

/// The exit status of a program that was asked to stop, where it was.
pub fn interrupted() -> Option<ExitCode> {
    let signal = SIGNAL.load(Ordering::Relaxed);
    (signal != 0).then(|| ExitCode::from(status_of(signal)))
}

/// A flag that becomes true at Ctrl-C.
pub fn stop_flag() -> &'static AtomicBool {
    on_interrupt(|| {});
    &STOP
}
