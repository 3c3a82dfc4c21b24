//! `pursuit ptz …`: heads, simulated and real.

mod calibrate;
mod follow;
mod outlook;
mod probe;
mod simulate;

use crate::args::{Global, Ptz, PtzCommand, Secret};
use anyhow::Context;
use pursuit_ptz::PtzError;
use pursuit_ptz::drivers::{Head, HeadAddress, HeadThread, Password, Pilot, Timeouts, open};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// `pursuit ptz …`.
pub fn run(args: &Ptz, global: &Global) -> anyhow::Result<ExitCode> {
    match &args.command {
        PtzCommand::Simulate(args) => simulate::run(args),
        PtzCommand::Follow(args) => follow::run(args, global),
        PtzCommand::Calibrate(args) => calibrate::run(args),
        PtzCommand::Probe(args) => probe::run(args),
    }
}

/// Reaches the head at an address.
fn reach(address: &str, secret: &Secret) -> anyhow::Result<Box<dyn Head>> {
    let address: HeadAddress = address.parse().map_err(said)?;
    open(&address, password(secret)?.as_ref(), Timeouts::default()).map_err(said)
}

/// An error whose text says its cause already.
fn said(error: PtzError) -> anyhow::Error {
    anyhow::Error::msg(error.to_string())
}

/// Parameters from a TOML file; `what` it does not say when it says something else.
fn read<T: serde::de::DeserializeOwned>(path: &Path, what: &str) -> anyhow::Result<T> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let parsed = toml::from_str(&text);
    // The message alone: the error shows the place in several lines.
    parsed.map_err(|e: toml::de::Error| anyhow::Error::msg(format!("{} {what}: {}", path.display(), e.message())))
}

#[allow(clippy::disallowed_methods, reason = "the command is told by the environment where a secret is")]
fn password(secret: &Secret) -> anyhow::Result<Option<Password>> {
    Ok(match &secret.password_file {
        Some(path) => Some(Password::from_file(path).map_err(said)?),
        None => std::env::var(&secret.password_env).ok().map(Password::new),
    })
}

/// Puts a head on a thread of its own, which stops it when nobody tells it anything.
fn on_a_thread(head: Box<dyn Head>, watchdog: Duration) -> anyhow::Result<HeadThread> {
    let waits = Timeouts::default();
    // One call under way, and the stop after it.
    let patience = waits.connect + 2 * waits.answer;
    Ok(HeadThread::start(head, watchdog.max(Pilot::WATCHDOG), None, patience)?)
}
