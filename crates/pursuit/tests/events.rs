//! What happens in a run: the events file, clips and pictures.
#![cfg(feature = "encode")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use pursuit::media::OpenOptions;
use pursuit::{Finished, Run, RunConfig};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A target that drifts to the right through 320 x 240 pixels.
const SCENE: &str = "input = 'scene:drift?seed=7&duration=12'\ntracker = 'mosse'\nvideo = false\n";

fn run(text: &str, out: &Path) -> Finished {
    let config: RunConfig = toml::from_str(text).unwrap();
    let config = RunConfig { out: Some(out.to_owned()), ..config };
    Run::prepare(config, &OpenOptions::default()).unwrap().run(|_| {}).unwrap()
}

fn lines(file: &Path) -> Vec<Value> {
    std::fs::read_to_string(file).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn clips(out: &Path, end: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(out.join("clips")).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.to_str().unwrap().ends_with(end));
    files.sort();
    files
}

fn frames(film: &Path) -> usize {
    let mut source = pursuit::open(film.to_str().unwrap()).unwrap();
    std::iter::from_fn(|| source.next_frame().unwrap()).count()
}

#[test]
fn a_clip_begins_before_its_event_and_ends_after_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    // The whole picture is the zone: it is entered .5 s after the target has appeared.
    let events = "[events]\nzones = ['all=0,0,320,0,320,240,0,240']\nclips = true\nbefore_s = 0.5\nafter_s = 1.5\nappear_s = 3.0\n";
    let finished = run(&format!("{SCENE}{events}"), &out);
    let told = lines(&out.join("events.jsonl"));
    let kinds: Vec<&str> = told.iter().map(|e| e["event"].as_str().unwrap()).collect();
    assert_eq!(kinds[..2], ["appear", "enter"]);
    let enter = &told[1];
    let entered = enter["frame"].as_u64().unwrap() as usize;
    assert_eq!((enter["zone"].as_str(), enter["schema"].as_str()), (Some("all"), Some("pursuit.event/1")));
    let (films, pictures) = (clips(&out, ".mp4"), clips(&out, ".jpg"));
    assert_eq!((films.len(), pictures.len()), (1, 1));
    assert!(films[0].ends_with(enter["clip"].as_str().unwrap()));
    assert!(pictures[0].ends_with(enter["snapshot"].as_str().unwrap()));
    // Half a second before and up to a second more, as decoding can begin once a second; 1.5 s after it, at 30 frames a second.
    let count = frames(&films[0]);
    assert!((15 + 46..=15 + 46 + 31).contains(&count), "{count} frames, entered in {entered}");
    let picture = pursuit::open(pictures[0].to_str().unwrap()).unwrap().next_frame().unwrap().unwrap();
    assert_eq!((picture.size().width, picture.size().height), (320, 240));
    let segments = finished.facts.segments.unwrap();
    assert_eq!((segments.clips, segments.files.len()), (2, 0));
}

#[test]
fn long_events_become_several_clips_and_old_ones_go() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let events = "[events]\nclips = true\nclip_on = ['dwell', 'enter']\nbefore_s = 0.2\nafter_s = 0.2\ndwell_s = 2.0\n\
                  zones = ['a=0,0,320,0,320,240,0,240', 'b=0,0,320,0,320,240,0,239']\n";
    let finished = run(&format!("{SCENE}segment = '1s'\nkeep = '4s'\n{events}"), &out);
    let segments = finished.facts.segments.unwrap();
    assert!(segments.files.iter().any(|f| f.starts_with("events-")), "{segments:?}");
    assert_eq!(segments.clips, 0, "both events are older than 4 s");
    assert!(clips(&out, "").is_empty() && segments.removed > 10);
    // What is younger stays.
    let finished = run(&format!("{SCENE}segment = '1s'\nkeep = '11s'\n{events}"), &out);
    assert_eq!(finished.facts.segments.unwrap().clips, 4);
    for film in clips(&out, ".mp4") {
        assert!(frames(&film) > 6, "{}", film.display());
    }
    // A run without clips takes them away with all else of the earlier one.
    run(SCENE, &out);
    assert!(clips(&out, "").is_empty() && !out.join("segments.jsonl").exists());
}

#[test]
fn a_run_that_is_stopped_in_a_clip_leaves_one_that_plays() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let config: RunConfig = toml::from_str(&format!("{SCENE}[events]\nclips = true\nappear_s = 0.2")).unwrap();
    let run = Run::prepare(RunConfig { out: Some(out.clone()), ..config }, &OpenOptions::default()).unwrap();
    let remote = run.remote();
    let finished = run
        .run(|progress| {
            if progress.frames == 50 {
                remote.stop()
            }
        })
        .unwrap();
    assert_eq!(finished.facts.status, "interrupted");
    let films = clips(&out, ".mp4");
    assert_eq!(films.iter().map(|f| frames(f)).collect::<Vec<_>>(), [50]);
}
