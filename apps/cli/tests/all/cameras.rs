//! Several cameras in one process, from one file.

use crate::common::{command, fails, rows, stderr, stdout};
use std::path::Path;

fn write(folder: &Path, text: &str) -> String {
    let path = folder.join("cameras.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

const TWO: &str = "tracker = 'mosse'\nvideo = false\n\
    [events]\nzones = ['all=0,0,2000,0,2000,2000,0,2000']\n\
    [cameras.yard]\ninput = 'scene:drift?seed=7&duration=2'\n\
    [cameras.door]\ninput = 'scene:drift?seed=8&duration=2'\ntracker = 'kcf'\n";

#[test]
fn each_camera_has_a_folder_and_what_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("days");
    let file = write(folder.path(), TWO);
    let output = command(&["track", "--config", &file, "--out"]).arg(&out).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    for (name, tracker) in [("yard", "mosse"), ("door", "kcf")] {
        assert_eq!(rows(&out.join(name).join("trajectory.csv")).len(), 60);
        let facts: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join(name).join("run.json")).unwrap()).unwrap();
        assert_eq!(facts["recipe"]["tracker"], tracker);
        assert!(std::fs::read_to_string(out.join(name).join("events.jsonl")).unwrap().contains("\"zone\":\"all\""));
    }
    let said = stdout(&output);
    assert!(said.contains("door\n") && said.contains("yard\n") && said.contains("tracker   kcf"), "{said}");
}

#[test]
fn one_that_is_not_there_holds_up_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("days");
    let file = write(folder.path(), &TWO.replace("scene:drift?seed=8&duration=2", "nowhere.mp4"));
    let output = command(&["track", "--json", "--config", &file, "--out"]).arg(&out).output().unwrap();
    fails(&output, 3, &["camera door", "nowhere.mp4"]);
    let told: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&told["yard"]["frame_count"], told.get("door")), (&60.into(), None));
}

#[test]
fn what_makes_no_sense_is_told_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("days");
    for (text, words) in [
        (TWO.replace("'kcf'", "'kfc'"), "kfc"),
        (TWO.replace("[cameras.door]", "[cameras.'the door']"), "no name of a camera"),
        (TWO.replace("video = false", "vidoe = false"), "vidoe"),
    ] {
        let file = write(folder.path(), &text);
        let output = command(&["track", "--config", &file, "--out"]).arg(&out).output().unwrap();
        fails(&output, 2, &[words]);
        assert!(!out.exists(), "{words}");
    }
    let file = write(folder.path(), TWO);
    let output = command(&["track", "--config", &file, "--out", "-"]).output().unwrap();
    fails(&output, 2, &["name a folder"]);
}

#[cfg(unix)]
#[test]
fn one_interrupt_stops_them_all() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("days");
    let file = write(folder.path(), &TWO.replace("duration=2", "duration=3600"));
    let mut child = command(&["track", "--config", &file, "--out"]).arg(&out).spawn().unwrap();
    let began = std::time::Instant::now();
    let is_going = |name: &str| std::fs::metadata(out.join(name).join("trajectory.csv")).is_ok_and(|m| m.len() > 4000);
    while !(is_going("yard") && is_going("door")) {
        assert!(began.elapsed().as_secs() < 60, "they do not begin");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    for name in ["yard", "door"] {
        let facts: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join(name).join("run.json")).unwrap()).unwrap();
        assert_eq!(facts["status"], "interrupted");
        assert_eq!(rows(&out.join(name).join("trajectory.csv")).len() as u64, facts["frame_count"].as_u64().unwrap());
    }
}
