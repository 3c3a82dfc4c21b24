use crate::args::{Global, Mavlink};
use crate::commands::ptz::Manner;
use crate::commands::{ptz, track};
use crate::console;
use anyhow::Context;
use pursuit::mavlink::{Endpoint, Identity, LinkCounts, MavlinkOptions, SigningKey};
use pursuit::ptz::control::Follower;
use pursuit::ptz::drivers::{GimbalHead, Pilot};
use pursuit::ptz::geometry::FieldsOfView;
use pursuit::{Finished, Run, RunConfig, RunError, StartFrom, head};
use std::fmt::Write;
use std::process::ExitCode;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// `pursuit mavlink`: a run as `pursuit track` makes it, which ground stations tell what to track.
pub fn run(args: &Mavlink, global: &Global) -> anyhow::Result<ExitCode> {
    if args.track.inputs.len() > 1 {
        return Err(RunError::usage("a camera of a drone shows one input; give no more than one").into());
    }
    let mut config = track::config(&args.track)?;
    let manner = Manner::take(&mut config, args.follower.as_deref())?;
    let config = until_told(config);
    // A picture of everything that was seen is made when asked for.
    let config = RunConfig { video: config.video.or(Some(false)), ..config };
    let Some(config) = track::with_box(config, &args.track)? else { return Ok(ExitCode::SUCCESS) };
    let config = if args.gimbal.is_some() { manner.on_a_head(config) } else { config };
    let is_told = config.start == Some(StartFrom::Command);
    let mavlink = pursuit::mavlink::Mavlink::open(options(args)?)?;
    let input = config.input.clone();
    let open = || Run::prepare(config, &track::open_options(&args.track));
    let run = console::connecting(input.as_ref(), global, open)?;
    let run = match (args.gimbal, args.camera_view) {
        (Some(device), Some(view)) => {
            let views = FieldsOfView::fixed(0.5 * view)?;
            let device = Some(device).filter(|device| *device > 0);
            let mut gimbal = GimbalHead::find(mavlink.endpoint().clone(), device).map_err(ptz::said)?;
            let attitude = gimbal.attitude();
            let params = manner.of(&mut gimbal)?;
            let follower = Follower::new(params, views, run.input().input_size(), 0.0)?;
            let thread = ptz::on_a_thread(Box::new(gimbal), Pilot::WATCHDOG)?;
            let run = mavlink.serve(run, Some(attitude))?;
            head::follow(run, Pilot::new(follower, thread), |_| {})
        }
        _ => mavlink.serve(run, None)?,
    };
    // Whoever looks for a gimbal in vain has said so by now.
    let _watched = tell_of_silence(mavlink.endpoint().clone(), is_told, global);
    let say = |finished: &Finished| match (&finished.out, args.track.json) {
        (None, _) => Ok(String::new()),
        (Some(_), true) => {
            let mut value: serde_json::Value = serde_json::from_str(&track::json(finished)?)?;
            value["links"] = serde_json::to_value(links(&mavlink))?;
            Ok(serde_json::to_string_pretty(&value)? + "\n")
        }
        (Some(_), false) => Ok(console::printable(&(track::summary(finished, false)? + &told(&mavlink)?))),
    };
    track::carry_out(run, global, say)
}

/// Nothing is tracked until a ground station says what, unless something else says so.
fn until_told(config: RunConfig) -> RunConfig {
    let says = !config.boxes.is_empty() || config.detect.is_some() || config.detections.is_some();
    let start = config.start.or((!says).then_some(StartFrom::Command));
    RunConfig { start, ..config }
}

/// Says, as long as the sender lives, that nobody was heard after a moment, and when somebody is.
fn tell_of_silence(endpoint: Endpoint, is_told: bool, global: &Global) -> Sender<()> {
    /// A ground station says every second that it is there.
    const MOMENT: Duration = Duration::from_secs(3);
    const AGAIN: Duration = Duration::from_millis(500);
    let (lives, ends) = channel::<()>();
    let is_quiet = global.quiet;
    std::thread::spawn(move || {
        let heard = || endpoint.counts().iter().any(|counts| counts.received > 0);
        let waits = |time| ends.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
        if is_quiet || !waits(MOMENT) || heard() {
            return;
        }
        anstream::eprintln!("{}", console::printable(&silence(&endpoint.counts(), is_told)));
        while !heard() {
            if !waits(AGAIN) {
                return;
            }
        }
        anstream::eprintln!("somebody is heard");
    });
    lives
}

/// What is waited for.
fn silence(links: &[LinkCounts], is_told: bool) -> String {
    let how = |counts: &LinkCounts| {
        let link = &counts.link;
        match link.split(':').next() {
            Some("udpin") => format!("{link} (point the ground station or the autopilot at this port of this machine)"),
            Some("udpout") => format!("{link} (nothing came back from there)"),
            Some("tcp") if counts.connections == 0 => format!("{link} (nothing listens there)"),
            Some("serial") if counts.connections == 0 => format!("{link} (it cannot be opened)"),
            _ => format!("{link} (it is open; is its other end sending, at this rate?)"),
        }
    };
    let places = links.iter().map(how).collect::<Vec<_>>().join(", ");
    let until = if is_told { "; nothing is tracked until a ground station says what" } else { "" };
    format!("no ground station and no vehicle heard yet: waiting on {places}{until}")
}

fn options(args: &Mavlink) -> anyhow::Result<MavlinkOptions> {
    let key = match &args.signing_key_file {
        Some(path) => {
            let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
            Some(SigningKey::from_text(&text).map_err(|e| RunError::usage(e.to_string()))?)
        }
        None => None,
    };
    Ok(MavlinkOptions {
        identity: Identity { system: args.system_id, component: args.component_id },
        links: args.links.clone(),
        key,
        field_of_view_deg: args.camera_view,
        pitch_deg: args.camera_pitch,
        stream: args.stream_uri.clone(),
        landing_target: args.landing_target,
        target_width_m: args.target_width,
        ..MavlinkOptions::default()
    })
}

fn links(mavlink: &pursuit::mavlink::Mavlink) -> Vec<serde_json::Value> {
    let one = |counts: pursuit::mavlink::LinkCounts| {
        serde_json::json!({
            "link": counts.link, "received": counts.received, "sent": counts.sent, "dropped": counts.dropped,
            "connections": counts.connections,
        })
    };
    mavlink.counts().into_iter().map(one).collect()
}

fn told(mavlink: &pursuit::mavlink::Mavlink) -> anyhow::Result<String> {
    let mut text = String::from("links\n");
    for counts in mavlink.counts() {
        let (received, sent, dropped) = (counts.received, counts.sent, counts.dropped);
        writeln!(text, "  {}: {received} messages came, {sent} went, {dropped} dropped", counts.link)?;
    }
    Ok(text)
}
