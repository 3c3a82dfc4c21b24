//! `pursuit ptz …`: heads, simulated and real.

mod calibrate;
mod follow;
mod grid;
mod manner;
mod probe;
mod simulate;

pub use manner::Manner;

use crate::args::{Global, Ptz, PtzCommand, Secret};
use anyhow::Context;
use pursuit::parameters::{Table, Value, merge, nested};
use pursuit::ptz::control::{FollowerParams, Scheme};
use pursuit::ptz::drivers::{Access, ByTurns, Head, HeadAddress, HeadThread, Password, Pilot, Timeouts, open};
use pursuit::ptz::{PtzError, Status};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// `pursuit ptz …`.
pub fn run(args: &Ptz, global: &Global) -> anyhow::Result<ExitCode> {
    match &args.command {
        PtzCommand::Simulate(args) => simulate::run(args),
        PtzCommand::Follow(args) => follow::run(args, global),
        PtzCommand::Calibrate(args) => calibrate::run(args, global),
        PtzCommand::Probe(args) => probe::run(args),
    }
}

/// Reaches the head at an address.
fn reach(address: &str, secret: &Secret) -> anyhow::Result<Box<dyn Head>> {
    let address: HeadAddress = address.parse().map_err(said)?;
    let access = Access { password: password(secret)?, certificates: secret.head_ca.clone() };
    open(&address, &access, Timeouts::default()).map_err(said)
}

/// An error whose text says its cause already.
pub fn said(error: PtzError) -> anyhow::Error {
    anyhow::Error::msg(error.to_string())
}

/// What a TOML file says, where one is given, with `settings` in its place.
pub fn read(path: Option<&Path>, settings: Table) -> anyhow::Result<Table> {
    let Some(path) = path else { return Ok(settings) };
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    // The message alone: the error shows the place in several lines.
    let parsed = text.parse::<Table>().map_err(|e| anyhow::anyhow!("{} is no TOML: {}", path.display(), e.message()));
    let mut table = nested(&parsed?);
    merge(&mut table, settings);
    Ok(table)
}

/// Sends a head home that has lost what a detector found, where nothing else is said: there the detector knows the scene.
pub fn go_home(follower: &mut Table) {
    let when_lost = follower.entry("when_lost").or_insert_with(|| Value::Table(Table::new()));
    if let Value::Table(when_lost) = when_lost {
        when_lost.entry("policy").or_insert("home".into());
    }
}

/// The name of a file for messages about what it says.
pub fn origin(path: Option<&Path>) -> String {
    path.map_or_else(|| "--set".to_owned(), |path| path.display().to_string())
}

#[allow(clippy::disallowed_methods, reason = "the command is told by the environment where a secret is")]
fn password(secret: &Secret) -> anyhow::Result<Option<Password>> {
    Ok(match &secret.password_file {
        Some(path) => Some(Password::from_file(path).map_err(said)?),
        None => std::env::var(&secret.password_env).ok().map(Password::new),
    })
}

/// Puts a head on a thread of its own, which stops it when nobody tells it anything.
pub fn on_a_thread(head: Box<dyn Head>, watchdog: Duration) -> anyhow::Result<HeadThread> {
    let waits = Timeouts::default();
    // One call under way, and the stop after it.
    let patience = waits.connect + 2 * waits.answer;
    let poll = head.capabilities().status.then_some(Pilot::POLL);
    Ok(HeadThread::start(head, watchdog.max(Pilot::WATCHDOG), poll, patience)?)
}

/// What is known of how a head moves, where it says so itself: its limits, and where it stands now.
pub fn known(head: &mut dyn Head) -> FollowerParams {
    let mut params = FollowerParams::default();
    if let Some(travel) = head.capabilities().travel {
        for (axis, (least, most)) in
            [(&mut params.limits.pan, travel.pan_deg), (&mut params.limits.tilt, travel.tilt_deg)]
        {
            (axis.min_deg, axis.max_deg) = (least, most);
        }
        if let Ok(Some(Status { position: Some(position), .. })) = head.status() {
            params.home = position;
        }
    }
    params
}

/// A head in a way that can be followed with: by velocities, else by turns, else by positions, which the parameters then say.
///
/// # Errors
/// Where it can do none of these.
fn able(head: Box<dyn Head>, params: &mut FollowerParams) -> anyhow::Result<Box<dyn Head>> {
    let can = head.capabilities();
    if can.velocity || (can.absolute && params.scheme == Scheme::Steps) {
        return Ok(head);
    }
    if can.relative {
        tracing::warn!("{} cannot move at a velocity; it is followed by turns, which is less smooth", head.name());
        return Ok(Box::new(ByTurns::new(head)));
    }
    if can.absolute {
        tracing::warn!("{} cannot move at a velocity; it is followed by positions (scheme = steps)", head.name());
        params.scheme = Scheme::Steps;
        return Ok(head);
    }
    anyhow::bail!(
        "{} can neither move at a velocity, nor turn by an angle, nor go to a position: there is nothing to follow with",
        head.name()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit::ptz::Command;
    use pursuit::ptz::drivers::Capabilities;

    struct Limited(Capabilities);

    impl Head for Limited {
        fn name(&self) -> &str {
            "limited"
        }
        fn capabilities(&self) -> Capabilities {
            self.0
        }
        fn send(&mut self, _: &Command) -> pursuit::ptz::Result<()> {
            Ok(())
        }
        fn status(&mut self) -> pursuit::ptz::Result<Option<Status>> {
            Ok(None)
        }
        fn leave(&mut self) {}
    }

    #[test]
    fn heads_are_followed_as_they_can_or_refused() {
        let none = Capabilities::default();
        let with = |capabilities: Capabilities| {
            let mut params = FollowerParams::default();
            let head = able(Box::new(Limited(capabilities)), &mut params).ok();
            (head.map(|head| head.capabilities().velocity), params.scheme)
        };
        assert_eq!(with(Capabilities { velocity: true, ..none }), (Some(true), Scheme::Velocity));
        assert_eq!(with(Capabilities { relative: true, ..none }), (Some(true), Scheme::Velocity));
        assert_eq!(with(Capabilities { absolute: true, ..none }), (Some(false), Scheme::Steps));
        assert_eq!(with(Capabilities { status: true, presets: true, ..none }).0, None);
    }
}
