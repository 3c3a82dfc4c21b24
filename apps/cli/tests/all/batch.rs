//! `pursuit batch`: many clips, of which some are broken, killed in the middle, gone on with.

#![allow(missing_docs)]

use crate::common::{command, fails, pursuit, rows, stdout};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// A manifest of short scenes, and whatever else is to be in it.
fn manifest(folder: &Path, scenes: u32, further: &[&str]) -> PathBuf {
    let mut text = String::from("# made by a test\n");
    for seed in 1..=scenes {
        text += &format!("{{\"name\": \"clip-{seed}\", \"input\": \"scene:drift?seed={seed}&duration=1\"}}\n");
    }
    further.iter().for_each(|line| text += &format!("{line}\n"));
    let path = folder.join("clips.jsonl");
    std::fs::write(&path, text).unwrap();
    path
}

fn batch(manifest: &Path, out: &Path, further: &[&str]) -> (i32, Value) {
    let fixed = ["-q", "batch", manifest.to_str().unwrap(), "--out", out.to_str().unwrap(), "--json", "--jobs", "2"];
    let output = pursuit(&[&fixed[..], &["--tracker", "mosse"], further].concat());
    let text = stdout(&output);
    let summary =
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text} {}", crate::common::stderr(&output)));
    (output.status.code().unwrap(), summary)
}

/// When each clip was finished.
fn finished(out: &Path) -> BTreeMap<String, SystemTime> {
    let Ok(entries) = std::fs::read_dir(out.join("clips")) else { return BTreeMap::new() };
    let of = |folder: PathBuf| {
        let at = std::fs::metadata(folder.join("finished.json")).ok()?.modified().ok()?;
        Some((folder.file_name()?.to_str()?.to_owned(), at))
    };
    entries.filter_map(|e| of(e.ok()?.path())).collect()
}

#[test]
fn broken_clips_stop_no_other_and_what_is_done_is_done() {
    let folder = tempfile::tempdir().unwrap();
    let garbage = folder.path().join("garbage.mp4");
    std::fs::write(&garbage, [7u8; 5000]).unwrap();
    let (garbage, out) = (garbage.to_str().unwrap(), folder.path().join("out"));
    let own = r#"{"name": "other", "input": "scene:drift?seed=9&duration=1", "tracker": "kcf", "parameters": {"motion.model": "imm"}}"#;
    let list = manifest(folder.path(), 3, &[garbage, "no/such/clip.mp4", own]);
    let (code, summary) = batch(&list, &out, &[]);
    assert_eq!(code, 3, "{summary}");
    let names = |key: &str| -> Vec<String> {
        summary[key].as_array().unwrap().iter().map(|c| c["clip"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(names("clips"), ["clip-1", "clip-2", "clip-3", "other"]);
    assert_eq!(names("failed"), ["garbage", "clip"]);
    assert!(summary["failed"][1]["error"].as_str().unwrap().contains("clip.mp4"), "{summary}");
    assert_eq!((&summary["left"], &summary["clips"][0]["frames"]), (&0.into(), &30.into()));

    // Each is what `track` makes of it alone.
    let alone = folder.path().join("alone");
    let input = "scene:drift?seed=2&duration=1";
    pursuit(&["-q", "track", input, "--tracker", "mosse", "--no-video", "--out", alone.to_str().unwrap()]);
    let boxes = |file: &Path| -> Vec<[String; 5]> {
        rows(file).iter().map(|r| ["frame", "x", "y", "w", "score"].map(|c| r[c].clone())).collect()
    };
    assert_eq!(boxes(&out.join("clips/clip-2/trajectory.csv")), boxes(&alone.join("trajectory.csv")));
    let facts: Value = serde_json::from_slice(&std::fs::read(out.join("clips/other/run.json")).unwrap()).unwrap();
    assert_eq!(
        (&facts["recipe"]["tracker"], &facts["recipe"]["parameters"]["motion"]["model"]),
        (&"kcf".into(), &"imm".into())
    );

    // The same call does nothing again but what failed; another wish is another run.
    let before = finished(&out);
    let (code, again) = batch(&list, &out, &[]);
    assert_eq!((code, &again["earlier"]), (3, &4.into()));
    let after = finished(&out);
    for name in ["clip-1", "clip-2", "clip-3", "other"] {
        assert_eq!(before[name], after[name], "{name} was done again");
    }
    let (_, otherwise) = batch(&list, &out, &["--set", "motion.model=none"]);
    assert_eq!(otherwise["earlier"], 1, "what a clip says itself is as it was: {otherwise}");
    let kept: Value = serde_json::from_slice(&std::fs::read(out.join("batch.json")).unwrap()).unwrap();
    assert_eq!(kept["clips"].as_array().unwrap().len(), 4);
}

#[test]
fn finished_work_survives_being_killed() {
    let folder = tempfile::tempdir().unwrap();
    let (list, out) = (manifest(folder.path(), 24, &[]), folder.path().join("out"));
    let mut kills = 0;
    loop {
        let before = finished(&out);
        let arguments = ["-q", "batch", list.to_str().unwrap(), "--out", out.to_str().unwrap(), "--jobs", "2"];
        let mut child = command(&[&arguments[..], &["--tracker", "mosse"]].concat());
        let mut child = child.stdout(std::process::Stdio::null()).spawn().unwrap();
        let deadline = Instant::now() + Duration::from_secs(120);
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            // In the midst of some clip, with a few more done.
            if kills < 3 && finished(&out).len() >= before.len() + 3 {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            assert!(Instant::now() < deadline, "nothing goes on");
            std::thread::sleep(Duration::from_millis(2));
        };
        let after = finished(&out);
        before.iter().for_each(|(name, at)| assert_eq!(after[name], *at, "{name} was done again"));
        match ended {
            Some(status) => {
                assert!(status.success());
                break;
            }
            None => kills += 1,
        }
    }
    assert!(kills > 0, "it was over before it could be killed");
    let (code, summary) = batch(&list, &out, &[]);
    assert_eq!((code, summary["earlier"].as_u64(), summary["left"].as_u64()), (0, Some(24), Some(0)));
    for seed in 1..=24 {
        assert_eq!(rows(&out.join(format!("clips/clip-{seed}/trajectory.csv"))).len(), 30);
        let partition = out.join(format!("dataset/clip=clip-{seed}"));
        if summary["dataset"] == true {
            let names: Vec<_> = std::fs::read_dir(&partition).unwrap().map(|e| e.unwrap().file_name()).collect();
            assert_eq!(names, ["trajectory.parquet"], "nothing half-written is left");
        } else {
            assert!(!partition.exists());
        }
    }
}

#[test]
fn patterns_and_names_are_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let frame = [b"FRAME\n".to_vec(), vec![90; 64 * 48 * 3 / 2]].concat();
    let video = [b"YUV4MPEG2 W64 H48 F25:1 C420\n".to_vec(), frame.repeat(4)].concat();
    for name in ["a.y4m", "b.y4m"] {
        std::fs::write(folder.path().join(name), &video).unwrap();
    }
    let (pattern, out) = (folder.path().join("*.y4m"), folder.path().join("out"));
    let (code, summary) = batch(&pattern, &out, &["scene:drift?duration=1", "--box", "10,10,20,20"]);
    assert_eq!((code, summary["clips"].as_array().unwrap().len()), (0, 3), "{summary}");
    assert!(out.join("clips/b/trajectory.csv").is_file());
}

#[test]
fn wrong_usage_is_told_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    fails(&pursuit(&["batch", "no/such.jsonl", "--out", out]), 2, &["no/such.jsonl"]);
    fails(&pursuit(&["batch", "no/such/*.mp4", "--out", out]), 2, &["no file matches"]);
    fails(&pursuit(&["batch", "scene:drift", "--out", "-"]), 2, &["--out DIR"]);
    let list = manifest(folder.path(), 0, &["{\"input\": 1}"]);
    fails(&pursuit(&["batch", list.to_str().unwrap(), "--out", out]), 2, &["line 2"]);
    let list = manifest(folder.path(), 0, &[]);
    fails(&pursuit(&["batch", list.to_str().unwrap(), "--out", out]), 2, &["no clips"]);
    assert!(!Path::new(out).exists(), "nothing was begun");
}
