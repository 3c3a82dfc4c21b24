//! `pursuit eval` as a user would call it: what is left behind, going on, wrong input.

use crate::common::{fails, pursuit, rows, stderr, stdout};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// A sequence of `count` images of a bright square that moves, with its truth.
pub fn sequence(folder: &Path, count: usize) {
    std::fs::create_dir_all(folder).unwrap();
    let mut text = "index,image,x,y,w,h\n".to_owned();
    for i in 0..count {
        let (left, top) = (20 + i, 16);
        let pixel = |k: usize| {
            let (x, y) = (k % 64, k / 64);
            let inside = (left..left + 16).contains(&x) && (top..top + 16).contains(&y);
            if inside { 120 + ((x - left) * 37 + (y - top) * 11) % 120 } else { 20 + (x * 7 + y * 13) % 40 }
        };
        let data: Vec<u8> = (0..64 * 48).map(|k| pixel(k) as u8).collect();
        let mut encoder = png::Encoder::new(std::fs::File::create(folder.join(format!("{i}.png"))).unwrap(), 64, 48);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&data).unwrap();
        text += &format!("{i},{i}.png,{left},{top},16,16\n");
    }
    std::fs::write(folder.join("frames.csv"), text).unwrap();
}

fn evaluate(data: &Path, out: &Path, more: &[&str]) -> Value {
    let fixed = ["eval", data.to_str().unwrap(), "--out", out.to_str().unwrap(), "--json"];
    let output = pursuit(&[&fixed[..], more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(output.stderr.is_empty(), "{}", stderr(&output));
    serde_json::from_str(&stdout(&output)).unwrap()
}

fn record(out: &Path, path: &str) -> Value {
    serde_json::from_slice(&std::fs::read(out.join("boxes").join(path)).unwrap()).unwrap()
}

#[test]
fn every_protocol_leaves_what_the_contract_says_in_one_folder() {
    let root = tempfile::tempdir().unwrap();
    let (data, out) = (root.path().join("data"), root.path().join("out"));
    sequence(&data.join("mover"), 26);
    let mut said = Vec::new();
    for protocol in ["ope", "long-term", "reset", "sre", "tre"] {
        let results = evaluate(&data, &out, &["--trackers", "kcf,mosse", "--protocol", protocol]);
        let kept: Value = serde_json::from_slice(&std::fs::read(out.join("results.json")).unwrap()).unwrap();
        assert_eq!(results, kept);
        assert_eq!(results["protocol"], protocol);
        for key in ["auc", "precision20", "success50", "fps"] {
            assert!(results["trackers"]["kcf"]["mean"][key].is_number(), "{protocol}: {key}");
            assert!(results["trackers"]["mosse"]["sequences"]["mover"][key].is_number(), "{protocol}: {key}");
        }
        let report = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(report.contains("<svg") && report.contains("kcf"), "{protocol}");
        said.push((protocol, results));
    }
    for (protocol, results) in said {
        let again = evaluate(&data, &out, &["--trackers", "kcf,mosse", "--protocol", protocol]);
        // Not even the times differ: nothing was run.
        assert_eq!(again, results, "{protocol}");
    }
    let boxes = std::fs::read_to_string(out.join("boxes/kcf/mover.csv")).unwrap();
    assert!(boxes.starts_with("frame,x,y,w,h,state,score\n") && boxes.lines().count() == 27, "{boxes}");
}

#[test]
fn trajectories_of_track_are_scored() {
    let root = tempfile::tempdir().unwrap();
    let (data, out, tracked) = (root.path().join("data"), root.path().join("out"), root.path().join("tracked"));
    sequence(&data.join("mover"), 12);
    let (clip, into) = (data.join("mover"), tracked.to_str().unwrap());
    let track = ["track", clip.to_str().unwrap(), "--box", "20,16,16,16", "--tracker", "mosse", "--no-video"];
    let output = pursuit(&[&track[..], &["--out", into]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let results = evaluate(&data, &out, &["--trackers", "mosse", "--results", &format!("mine={into}")]);
    let auc = |name: &str| results["trackers"][name]["mean"]["auc"].as_f64().unwrap();
    assert!((auc("mine") - auc("mosse")).abs() < 1e-9, "{} {}", auc("mine"), auc("mosse"));
    // Alone, by its file.
    let file = format!("mine={into}/trajectory.csv");
    let alone = evaluate(&data, &root.path().join("alone"), &["--results", &file]);
    assert_eq!(alone["trackers"].as_object().unwrap().keys().collect::<Vec<_>>(), ["mine"]);

    let path = tracked.join("trajectory.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let shorter: Vec<&str> = text.lines().take(9).collect();
    std::fs::write(&path, shorter.join("\n")).unwrap();
    let call = ["eval", data.to_str().unwrap(), "--out", out.to_str().unwrap(), "--results", &file];
    fails(&pursuit(&call), 3, &["8 frames of mover, which has 12", "trajectory.csv"]);
    fails(&pursuit(&[&call[..], &["--protocol", "tre"]].concat()), 2, &["one pass", "tre"]);
    let unnamed = pursuit(&["eval", data.to_str().unwrap(), "--results", "mine"]);
    assert_eq!(unnamed.status.code(), Some(2));
    assert!(stderr(&unnamed).contains("give NAME=PATH"), "{}", stderr(&unnamed));
}

#[test]
fn what_another_build_left_is_run_again() {
    let root = tempfile::tempdir().unwrap();
    let (data, out) = (root.path().join("data"), root.path().join("out"));
    sequence(&data.join("mover"), 6);
    let first = evaluate(&data, &out, &["--trackers", "mosse", "--no-report"]);
    let build = record(&out, "mosse/mover.json")["build"].as_str().unwrap().to_owned();
    let (version, digest) = build.split_once('+').unwrap();
    assert_eq!(version, env!("CARGO_PKG_VERSION"));
    assert_eq!(digest.len(), 16);
    let path = out.join("boxes/mosse/mover.json");
    let foreign = std::fs::read_to_string(&path).unwrap().replace(&build, &format!("{version}+0123456789abcdef"));
    std::fs::write(&path, foreign).unwrap();
    let second = evaluate(&data, &out, &["--trackers", "mosse", "--no-report"]);
    assert_eq!(record(&out, "mosse/mover.json")["build"], build.as_str(), "it was run again");
    assert_eq!(first["trackers"]["mosse"]["mean"]["auc"], second["trackers"]["mosse"]["mean"]["auc"]);
}

#[test]
fn what_went_wrong_is_said_and_run_again() {
    let root = tempfile::tempdir().unwrap();
    let (data, out) = (root.path().join("data"), root.path().join("out"));
    sequence(&data.join("mover"), 6);
    // A tracker that never ran has no figures: that is no success, even where warnings are not wanted.
    let lost = root.path().join("no-such-network");
    let setting = format!("siamese.model={}", lost.display());
    let args = ["-q", "eval", data.to_str().unwrap(), "--out", out.to_str().unwrap(), "--trackers", "siamese,mosse"];
    let output = pursuit(&[&args[..], &["--set", &setting, "--no-report"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("siamese stopped on every sequence") && stderr(&output).contains("no-such-network")
    );
    assert!(stdout(&output).contains("mosse"));

    let path = out.join("boxes/mosse/mover.json");
    let mut kept = record(&out, "mosse/mover.json");
    kept["error"] = "frame 0: a library was missing".into();
    std::fs::write(&path, kept.to_string()).unwrap();
    let results = evaluate(&data, &out, &["--trackers", "mosse", "--no-report"]);
    assert!(results["trackers"]["mosse"]["sequences"]["mover"]["error"].is_null());
}

#[test]
fn what_cannot_be_evaluated_is_named() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let call = |data: &Path, more: &[&str]| {
        let fixed = ["eval", data.to_str().unwrap(), "--out", out.to_str().unwrap(), "--trackers", "mosse"];
        pursuit(&[&fixed[..], more].concat())
    };
    fails(&call(&root.path().join("nowhere"), &[]), 3, &["nowhere"]);
    let empty = root.path().join("empty");
    std::fs::create_dir_all(&empty).unwrap();
    fails(&call(&empty, &[]), 3, &["empty", "frames.csv", "OTB"]);
    let data = root.path().join("data");
    sequence(&data.join("mover"), 6);
    fails(&call(&data, &["--sequences", "nothing*"]), 2, &["nothing*", "mover"]);
    fails(&call(&data, &["--set", "kcf.padding=2"]), 2, &["kcf.padding", "mosse"]);
    let occupied = root.path().join("file");
    std::fs::write(&occupied, "").unwrap();
    let args = ["eval", data.to_str().unwrap(), "--out", occupied.to_str().unwrap(), "--trackers", "mosse"];
    fails(&pursuit(&args), 4, &[occupied.to_str().unwrap()]);
}

#[test]
fn rubbish_beside_good_sequences_is_left_out_and_said() {
    let root = tempfile::tempdir().unwrap();
    let (data, out) = (root.path().join("data"), root.path().join("out"));
    sequence(&data.join("good"), 6);
    sequence(&data.join("bad"), 6);
    std::fs::write(data.join("bad/frames.csv"), "index,image,x,y,w,h\n0,0.png,1,2,wide,4\n").unwrap();
    std::fs::write(data.join("notes.txt"), "nothing to see").unwrap();
    std::fs::create_dir_all(data.join("empty/folder")).unwrap();
    let args = ["eval", data.to_str().unwrap(), "--out", out.to_str().unwrap(), "--trackers", "mosse", "--json"];
    let output = pursuit(&args);
    assert!(output.status.success(), "{}", stderr(&output));
    let warning = stderr(&output);
    assert!(warning.contains("bad") && warning.contains("wide") && warning.lines().count() == 1, "{warning}");
    let results: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(results["trackers"]["mosse"]["sequences"].as_object().unwrap().keys().collect::<Vec<_>>(), ["good"]);
    assert!(results["problems"][0].as_str().unwrap().contains("frames.csv"));
    assert!(std::fs::read_to_string(out.join("report.html")).unwrap().contains("wide"));
}

#[test]
fn trackers_are_compared_on_a_clip_in_one_pass() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let clip = ["track", "scene:occluding-bar?seed=3&duration=2", "--out", out.to_str().unwrap()];
    let output = pursuit(&[&clip[..], &["--compare", "kcf,mosse", "--set", "mosse.motion.model=per-frame"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let run: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!((&run["recipe"]["tracker"], &run["recipe"]["compared"][0]["tracker"]), (&"kcf".into(), &"mosse".into()));
    assert_eq!(run["recipe"]["compared"][0]["parameters"]["motion"]["model"], "per-frame");
    let compared = run["compared"].as_array().unwrap();
    assert_eq!(compared.len(), 2);
    assert_eq!(compared[0]["accuracy"]["mean_iou"], run["accuracy"]["mean_iou"]);
    assert!(compared[0]["agreement"].is_null() && compared[1]["agreement"].as_f64().unwrap() > 0.1);
    let rows = rows(&out.join("trajectory.csv"));
    for (number, name) in [("1", "kcf"), ("2", "mosse")] {
        let own: Vec<_> = rows.iter().filter(|row| row["target"] == number).collect();
        assert!(!own.is_empty() && own.iter().all(|row| row["class"] == name));
        let states: u64 = compared[number.parse::<usize>().unwrap() - 1]["states"]
            .as_object()
            .unwrap()
            .values()
            .map(|n| n.as_u64().unwrap())
            .sum();
        assert_eq!(states as usize, own.len());
    }
    // The first is followed as it is alone.
    let alone = root.path().join("alone");
    let single = ["track", clip[1], "--tracker", "kcf", "--no-video", "--out", alone.to_str().unwrap()];
    assert!(pursuit(&single).status.success());
    let without_time = |row: &HashMap<String, String>| -> Vec<String> {
        ["frame", "state", "x", "y", "w", "h", "score"].iter().map(|column| row[*column].clone()).collect()
    };
    let first: Vec<_> = rows.iter().filter(|row| row["target"] == "1").map(without_time).collect();
    assert_eq!(first, crate::common::rows(&alone.join("trajectory.csv")).iter().map(without_time).collect::<Vec<_>>());
    let table = stdout(&output);
    assert!(table.lines().any(|l| l.starts_with("mosse ")) && table.contains("false alive"), "{table}");

    let fail = |more: &[&str], words: &[&str]| fails(&pursuit(&[&clip[..2], more].concat()), 2, words);
    fail(&["--compare", "kcf,kcf"], &["kcf", "twice"]);
    fail(&["--compare", "kcf,kfc"], &["kfc"]);
    fail(&["--compare", "kcf,mosse", "--detect", "ball"], &["--box", "detector"]);
    fail(&["--compare", "kcf,mosse", "--box", "1,2,30,30", "--box", "9,9,30,30"], &["one box"]);
}
