//! Runs that are cut into segments: nothing is lost at a cut, each piece opens by itself, old ones go.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use pursuit::media::OpenOptions;
use pursuit::{Finished, Run, RunConfig, RunError};
use std::path::{Path, PathBuf};

const SCENE: &str = "input = 'scene:drift?seed=7&duration=12'\ntracker = 'mosse'\n";

fn prepare(text: &str, out: &Path) -> Result<Run, RunError> {
    let config: RunConfig = toml::from_str(text).unwrap();
    Run::prepare(RunConfig { out: Some(out.to_owned()), ..config }, &OpenOptions::default())
}

fn run(text: &str, out: &Path) -> Finished {
    prepare(text, out).unwrap().run(|_| {}).unwrap()
}

/// The files of a run with this beginning and end, by their times.
fn files(out: &Path, start: &str, end: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(out).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| {
        let name = f.file_name().unwrap().to_str().unwrap();
        name.starts_with(start) && name.ends_with(end)
    });
    files.sort();
    files
}

/// The rows of all segments without what differs from run to run: how long the tracker took.
fn rows<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Vec<String> {
    let of = |file: &PathBuf| {
        let text = std::fs::read_to_string(file).unwrap();
        let untimed = |row: &str| {
            let mut cells: Vec<&str> = row.split(',').collect();
            cells.remove(17);
            cells.join(",")
        };
        text.lines().skip(1).map(untimed).collect::<Vec<_>>()
    };
    files.into_iter().flat_map(of).collect()
}

fn frames(film: &Path) -> u64 {
    let mut source = pursuit::open(film.to_str().unwrap()).unwrap();
    std::iter::from_fn(|| source.next_frame().unwrap()).count() as u64
}

#[test]
fn all_segments_together_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, cut) = (folder.path().join("whole"), folder.path().join("cut"));
    run(&format!("{SCENE}video = false"), &whole);
    let finished = run(&format!("{SCENE}segment = '5s'\nformats = ['jsonl', 'coco']"), &cut);
    let parts = files(&cut, "trajectory-", ".csv");
    assert_eq!(parts.len(), 3);
    assert_eq!(rows(&parts), rows([&whole.join("trajectory.csv")]));
    let lines = |file: &PathBuf| std::fs::read_to_string(file).unwrap().lines().count();
    assert_eq!(files(&cut, "trajectory-", ".jsonl").iter().map(lines).sum::<usize>(), 360);
    for file in files(&cut, "", ".json").iter().filter(|f| !f.ends_with("run.json")) {
        let whole: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
        assert!(whole.is_object());
    }
    if pursuit::NO_OVERLAY.is_none() {
        let films = files(&cut, "overlay-", ".mp4");
        assert_eq!(films.iter().map(|f| frames(f)).collect::<Vec<_>>(), [150, 150, 60]);
    }
    let segments = finished.facts.segments.unwrap();
    assert_eq!((segments.every_s, segments.removed), (Some(5.0), 0));
    assert!(segments.files.iter().all(|file| cut.join(file).is_file()));
    assert_eq!(finished.facts.frame_count, 360);
}

#[test]
fn old_segments_go_and_strangers_stay() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let mine = out.join("trajectory-20000101T000000Z.csv");
    std::fs::write(&mine, "mine").unwrap();
    let finished = run(&format!("{SCENE}video = false\nsegment = '2s'\nkeep = '3s'"), &out);
    assert_eq!(std::fs::read_to_string(&mine).unwrap(), "mine");
    // The last begins at 10 s; what is younger than 7 s begins in the segment from 6 s on.
    let left = files(&out, "trajectory-2", ".csv");
    assert_eq!(rows(&left[1..]).len(), 180);
    assert_eq!(finished.facts.segments.unwrap().removed, 3);
    let run_json = std::fs::read_to_string(out.join("run.json")).unwrap();
    assert!(run_json.contains(left[1].file_name().unwrap().to_str().unwrap()) && !run_json.contains("20000101"));
    // A run without segments replaces all of that, and nothing else.
    run(&format!("{SCENE}video = false"), &out);
    assert_eq!(files(&out, "trajectory", ".csv"), [mine, out.join("trajectory.csv")]);
    assert!(!out.join("segments.jsonl").exists());
}

#[test]
fn an_interrupted_run_goes_on_in_further_segments() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, cut) = (folder.path().join("whole"), folder.path().join("cut"));
    run(&format!("{SCENE}video = false"), &whole);
    let text = format!("{SCENE}video = false\nsegment = '4s'");
    let first = prepare(&text, &cut).unwrap();
    let remote = first.remote();
    let stopped = first
        .run(|progress| {
            if progress.frames == 200 {
                remote.stop()
            }
        })
        .unwrap();
    assert_eq!((stopped.facts.status, stopped.facts.frame_count), ("interrupted", 200));
    // As after a crash: what was written after the state was saved is written anew.
    let last = files(&cut, "trajectory-", ".csv").pop().unwrap();
    let more = "200,6.666667,1,tracking,0,0,1,1,0.5,,,,,,,,,1\n201,6.7,1,trac";
    let text_before = std::fs::read_to_string(&last).unwrap();
    std::fs::write(&last, text_before + more).unwrap();
    let resumed = run(&format!("{text}\nresume = true"), &cut);
    assert_eq!((resumed.facts.status, resumed.facts.frame_count), ("done", 360));
    assert_eq!(rows(&files(&cut, "trajectory-", ".csv")), rows([&whole.join("trajectory.csv")]));
}

#[test]
fn a_folder_that_takes_no_more_ends_the_run_with_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let run = prepare(&format!("{SCENE}video = false\nsegment = '2s'"), &out).unwrap();
    let list = out.join("segments.jsonl");
    let finished = run
        .run(|progress| {
            if progress.frames == 30 {
                std::fs::remove_file(&list).unwrap();
                std::fs::create_dir(&list).unwrap();
            }
        })
        .unwrap();
    let failure = finished.outcome.failure.unwrap();
    assert_eq!((failure.exit_code(), finished.facts.status), (4, "broken"));
    assert!(failure.to_string().contains("segments.jsonl"), "{failure}");
    assert_eq!(rows(&files(&out, "trajectory-", ".csv")).len(), 60);
}

#[test]
fn what_makes_no_sense_of_segments_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (more, word) in
        [("keep = '1d'", "--segment"), ("segment = '0.1s'", "a second"), ("segment = '1h'\nplots = true", "plots")]
    {
        let error = prepare(&format!("{SCENE}{more}"), &folder.path().join("out")).err().unwrap();
        assert!(error.exit_code() == 2 && error.to_string().contains(word), "{error}");
    }
    let config: Result<RunConfig, _> = toml::from_str("segment = 'soon'");
    assert!(config.unwrap_err().to_string().contains("15m"));
}
