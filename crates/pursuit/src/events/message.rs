use super::{Event, Kind, Reason, Watched};
use pursuit_tracking::Class;
use serde::Serialize;
use std::path::Path;

/// Name and version: a field that changes its meaning or goes changes the number, one that is added does not.
const EVENT_SCHEMA: &str = "pursuit.event/1";
/// What targets are called of which nobody has said what they are.
pub(crate) const UNKNOWN: &str = "target";

/// An event as a line of `events.jsonl` and a message.
#[derive(Serialize)]
pub(crate) struct EventMessage<'a> {
    schema: &'static str,
    event: &'static str,
    frame: u64,
    time_s: f64,
    unix_time_s: f64,
    target: u64,
    class: Option<&'a str>,
    zone: Option<&'a str>,
    reason: Option<&'static str>,
    lasted_s: Option<f64>,
    r#box: Option<[f64; 4]>,
    clip: Option<String>,
    snapshot: Option<String>,
}

impl<'a> EventMessage<'a> {
    /// Of an event of a frame.
    pub fn of(event: &'a Event, watched: &Watched) -> Self {
        Self {
            schema: EVENT_SCHEMA,
            event: event.kind.as_str(),
            frame: event.frame,
            time_s: event.time_s,
            unix_time_s: event.unix_time_s,
            target: event.target.0,
            class: event.class.as_ref().map(Class::as_str),
            zone: event.zone.as_deref(),
            reason: event.reason.map(Reason::as_str),
            lasted_s: event.lasted_s,
            r#box: event.bbox.map(|b| [b.left(), b.top(), b.width(), b.height()]),
            clip: watched.clip.as_ref().and_then(|path| shown(path)),
            snapshot: watched.snapshot.as_ref().and_then(|path| shown(path)),
        }
    }

    /// As JSON.
    pub fn json(&self) -> Vec<u8> {
        // What is serialised here has nothing that can fail; numbers that are none are `null`.
        serde_json::to_vec(self).unwrap_or_default()
    }
}

/// A file of the folder `clips` as it is named from the run's folder.
fn shown(path: &Path) -> Option<String> {
    Some(format!("clips/{}", path.file_name()?.to_str()?))
}

/// How an event reads to a person.
pub(super) fn in_words(event: &Event) -> String {
    let who = format!("{} {}", event.class.as_ref().map_or(UNKNOWN, Class::as_str), event.target);
    let zone = event.zone.as_deref().unwrap_or_default();
    match (event.kind, event.reason) {
        (Kind::Appear, _) => format!("{who} appeared"),
        (Kind::Enter, _) => format!("{who} entered {zone}"),
        (Kind::Dwell, _) => format!("{who} has been in {zone} for {:.0} s", event.lasted_s.unwrap_or_default()),
        (Kind::Leave, Some(Reason::Unseen)) => format!("{who} is not seen any more in {zone}"),
        (Kind::Leave, _) => format!("{who} left {zone}"),
        (Kind::Lost, _) => format!("{who} is not seen any more"),
        (Kind::Found, _) => format!("{who} is seen again"),
        (Kind::Gone, _) => format!("{who} is gone"),
    }
}
