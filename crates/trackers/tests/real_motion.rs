//! People in front of cameras that stand still, by motion alone, where the footage is present:
//! `<repository>/../shared/data/human`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::BBox;
use pursuit_media::{OpenOptions, open};
use pursuit_trackers::registry;
use pursuit_tracking::many::{Associating, AssociationParams};
use pursuit_tracking::{MultiTracker, Track};
use std::path::PathBuf;

/// The clip's folder, `None` (said aloud) where it is absent.
fn clip(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/human").join(name);
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

fn follow(input: &str, fps: f64, last: u64, set: &str) -> Vec<Vec<Track>> {
    let entry = registry::detector("motion").unwrap();
    let detector = entry.detector(&set.parse().unwrap()).unwrap();
    let many: toml::Table = std::env::var("MANY").unwrap_or_default().parse().unwrap();
    let params = AssociationParams { motion: entry.motion(), ..AssociationParams::default() };
    let params = pursuit_tracking::parameters::Parameters::with(&params, "many", &many).unwrap();
    let mut targets = Associating::new(detector, params).unwrap();
    let mut source = open(input, &OpenOptions { default_fps: fps, ..OpenOptions::from_env() }).unwrap();
    let mut all = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        let mut tracks = Vec::new();
        targets.step(&frame, &mut tracks).unwrap();
        all.push(tracks);
        if frame.index() >= last {
            break;
        }
    }
    all
}

#[test]
fn office() {
    let Some(folder) = clip("office") else { return };
    let set = std::env::var("SET").unwrap_or_default();
    let all = follow(folder.join("input").to_str().unwrap(), 25.0, 500, &set);
    dump(&all);
}

#[test]
fn pets() {
    let Some(folder) = clip("pets09_s2l1") else { return };
    let set = std::env::var("SET").unwrap_or_default();
    let all = follow(std::env::var("PICTURES").unwrap().as_str(), 7.0, 1000, &set);
    dump(&all);
}

fn dump(all: &[Vec<Track>]) {
    let mut text = String::from("frame,target,state,x,y,w,h,meas\n");
    for (k, tracks) in all.iter().enumerate() {
        for t in tracks {
            let e = t.estimate.as_ref().unwrap();
            let [x, y, w, h]: [f64; 4] = e.bbox.ltwh().into();
            text += &format!("{k},{},{},{x:.2},{y:.2},{w:.2},{h:.2},{}\n", t.id, e.state.as_str(), e.measurement.is_some());
        }
    }
    std::fs::write(std::env::var("DUMP").unwrap(), text).unwrap();
}

#[allow(dead_code)]
fn unused(_: BBox) {}
