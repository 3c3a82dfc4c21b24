use clap::Args;
use pursuit::events::{EventOptions, Kind, Zone};
use pursuit::{RunError, Span};
use std::str::FromStr;

/// Runs that go on for days, and what happens in them.
#[derive(Debug, Args)]
#[command(next_help_heading = "For days on end")]
pub struct Days {
    /// Cut the trajectory, the overlay and all else that grows into files of this length, named by their time: `15m`, `1h`
    #[arg(long, value_name = "LENGTH", value_parser = span)]
    pub segment: Option<Span>,
    /// Remove segments, clips and pictures of events that are older than this: `7d`
    #[arg(long, value_name = "LENGTH", value_parser = span)]
    pub keep: Option<Span>,
    /// Tell who enters, dwells in and leaves this polygon, in pixels of the input (repeat)
    #[arg(long = "zone", value_name = "NAME=X,Y,X,Y,…", value_parser = zone, allow_hyphen_values = true)]
    pub zones: Vec<String>,
    /// After how long in a zone that is told [default: 10]
    #[arg(long, value_name = "SECONDS")]
    pub dwell: Option<f64>,
    /// After how long without being seen a target counts as present no more [default: 2]
    #[arg(long, value_name = "SECONDS")]
    pub unseen: Option<f64>,
    /// Write what happens to events.jsonl [default: with --zone or --clips]
    #[arg(long)]
    pub events: bool,
    /// Make clips and pictures of events, in the folder `clips`
    #[arg(long)]
    pub clips: bool,
    /// Of which events: appear, enter, dwell, leave, lost, found, gone [default: enter with --zone, else appear]
    #[arg(long, value_name = "EVENT", value_parser = kind, value_delimiter = ',', requires = "clips")]
    pub clip_on: Vec<String>,
    /// How long a clip begins before its event [default: 5]
    #[arg(long, value_name = "SECONDS", requires = "clips")]
    pub clip_before: Option<f64>,
    /// How long it goes on after its last event [default: 5]
    #[arg(long, value_name = "SECONDS", requires = "clips")]
    pub clip_after: Option<f64>,
}

impl Days {
    /// What is said of what happens.
    pub fn options(&self) -> EventOptions {
        EventOptions {
            file: self.events.then_some(true),
            zones: self.zones.clone(),
            dwell_s: self.dwell,
            unseen_s: self.unseen,
            clips: self.clips.then_some(true),
            clip_on: self.clip_on.clone(),
            before_s: self.clip_before,
            after_s: self.clip_after,
            ..EventOptions::default()
        }
    }
}

/// Takes a length of time.
fn span(text: &str) -> Result<Span, String> {
    text.parse().map_err(|e: RunError| e.to_string())
}

/// Takes a zone, as it is written.
fn zone(text: &str) -> Result<String, String> {
    Zone::from_str(text).map(|_| text.to_owned()).map_err(|e| e.to_string())
}

/// Takes the name of a kind of event.
fn kind(word: &str) -> Result<String, String> {
    Kind::from_str(word).map(|_| word.to_owned()).map_err(|e| e.to_string())
}
