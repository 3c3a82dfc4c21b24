//! Who is where, as a message.

use super::Occupancy;
use super::message::UNKNOWN;
use pursuit_tracking::Class;
use serde::Serialize;
use std::collections::BTreeMap;

/// Name and version: a field that changes its meaning or goes changes the number, one that is added does not.
const SCHEMA: &str = "pursuit.counts/1";

#[derive(Serialize)]
struct Counts<'a> {
    schema: &'static str,
    zone: Option<&'a str>,
    frame: u64,
    time_s: f64,
    unix_time_s: f64,
    present: bool,
    count: usize,
    classes: BTreeMap<&'a str, usize>,
    targets: Vec<u64>,
    unseen: Vec<u64>,
}

/// The message of who is where, of the frame with this number, time and time of day.
pub(crate) fn counts(occupancy: &Occupancy, (frame, time_s, unix_time_s): (u64, f64, f64)) -> Vec<u8> {
    let mut classes = BTreeMap::new();
    for (_, class) in &occupancy.present {
        *classes.entry(class.as_ref().map_or(UNKNOWN, Class::as_str)).or_insert(0) += 1;
    }
    let message = Counts {
        schema: SCHEMA,
        zone: occupancy.zone.as_deref(),
        frame,
        time_s,
        unix_time_s,
        present: !occupancy.present.is_empty(),
        count: occupancy.present.len(),
        classes,
        targets: occupancy.present.iter().map(|(id, _)| id.0).collect(),
        unseen: occupancy.unseen.iter().map(|id| id.0).collect(),
    };
    serde_json::to_vec(&message).unwrap_or_default()
}
