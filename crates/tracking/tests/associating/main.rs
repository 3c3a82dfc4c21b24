//! The four phases: identities through crossings, births and deaths, false alarms and misses.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;

mod commands;
mod fed;
mod hypotheses;
mod lives;
mod street;
mod whole_clips;

use common::{at, empty, frame, frame_at, recipe, recipe_of, scripted, seen};
use pursuit_geometry::BBox;
use pursuit_tracking::many::{Associating, AssociationModel, ManyParams};
use pursuit_tracking::{Class, Detection, Estimate, MultiTracker, TargetId, Track, TrackState, TrackingError};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

/// Three of five confirm a candidate: tests count frames.
fn params() -> ManyParams {
    use pursuit_parameters::Parameters;
    ManyParams::default().with("many", &"birth.model = 'hits'\nbirth.from = 0.5".parse().unwrap()).unwrap()
}

fn with(changes: &str) -> ManyParams {
    use pursuit_parameters::Parameters;
    params().with("many", &changes.parse().unwrap()).unwrap()
}

fn many(script: impl Fn(u64) -> Vec<Detection> + Send + Sync + 'static, params: ManyParams) -> Associating {
    Associating::new(scripted(script), params).unwrap()
}

fn step(many: &mut Associating, k: u64) -> Vec<Track> {
    let mut tracks = Vec::new();
    many.step(&empty(k), &mut tracks).unwrap();
    tracks
}

/// As `seen`, of a detector that has a word for it.
fn named(bbox: BBox, word: &str) -> Detection {
    Detection { class: Some(word.into()), ..seen(bbox) }
}

fn class(tracks: &[Track], id: u64) -> Option<&str> {
    tracks.iter().find(|t| t.id.0 == id)?.class.as_ref().map(Class::as_str)
}

fn states(tracks: &[Track]) -> Vec<(u64, TrackState)> {
    tracks.iter().map(|t| (t.id.0, t.estimate.as_ref().unwrap().state)).collect()
}

fn estimate(tracks: &[Track], id: u64) -> &Estimate {
    tracks.iter().find(|t| t.id.0 == id).unwrap().estimate.as_ref().unwrap()
}
