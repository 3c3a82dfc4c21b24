//! Boxes from files: `associate`, `track --detections` and `eval --protocol mot` on good files of every form and on hostile ones.

use crate::common::{fails, footage, pursuit, rows, stderr, stdout};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Frames of the sequence.
const FRAMES: u32 = 30;

/// Boxes of a frame: two that walk toward each other on two levels, left, top, width, height and score.
fn boxes(frame: u32) -> [[f64; 5]; 2] {
    let x = 8.0 * f64::from(frame);
    [[10.0 + x, 40.0, 40.0, 90.0, 0.9], [400.0 - x, 200.0, 40.0, 90.0, 0.8]]
}

/// The sequence as `line` writes a box, given its frame from 0.
fn lines(line: impl Fn(u32, &[f64; 5]) -> String) -> String {
    (0..FRAMES).flat_map(|k| boxes(k).map(|b| line(k, &b) + "\n")).collect()
}

fn mot() -> String {
    lines(|k, [l, t, w, h, s]| format!("{},-1,{},{},{w},{h},{s}", k + 1, l + 1.0, t + 1.0))
}

/// The sequence in every form, and the words that name them.
fn forms(folder: &Path) -> Vec<(&'static str, PathBuf)> {
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    };
    let kitti =
        |k: u32, [l, t, w, h, s]: &[f64; 5]| format!("{k} -1 Car 0 0 0 {l} {t} {} {} 0 0 0 0 0 0 0 {s}", l + w, t + h);
    let coco = |k: u32, [l, t, w, h, s]: &[f64; 5]| {
        format!(r#"{{"image_id": {k}, "bbox": [{l}, {t}, {w}, {h}], "score": {s}, "category_id": 2}},"#)
    };
    let jsonl = |k: u32, [l, t, w, h, s]: &[f64; 5]| {
        format!(r#"{{"frame": {k}, "box": [{l}, {t}, {w}, {h}], "score": {s}, "class": "car"}}"#)
    };
    for k in 0..FRAMES {
        let yolo = |[l, t, w, h, s]: [f64; 5]| {
            format!("2 {} {} {} {} {s}\n", (l + w / 2.0) / 640.0, (t + h / 2.0) / 480.0, w / 640.0, h / 480.0)
        };
        put(&format!("yolo/clip_{k}.txt"), boxes(k).map(yolo).concat());
    }
    let coco = lines(coco);
    vec![
        ("mot", put("mot.txt", mot())),
        ("kitti", put("kitti.txt", lines(kitti))),
        ("coco", put("coco.json", format!("[{}]", coco.trim_end().trim_end_matches(',')))),
        ("jsonl", put("boxes.jsonl", lines(jsonl))),
        ("yolo", folder.join("yolo")),
    ]
}

fn associate(input: &Path, out: &Path, more: &[&str]) -> Output {
    let args = ["associate", input.to_str().unwrap(), "--out", out.to_str().unwrap()];
    pursuit(&[&args[..], more].concat())
}

/// Numbers of a MOT file, line by line.
fn numbers(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|l| l.split(',').map(|n| n.parse().unwrap()).collect()).collect()
}

#[test]
fn every_form_makes_the_same_tracks() {
    let folder = tempfile::tempdir().unwrap();
    let mut first: Option<Vec<Vec<f64>>> = None;
    for (form, path) in forms(folder.path()) {
        for told in [&["--format", form][..], &[]] {
            let out = tempfile::tempdir().unwrap();
            let ended = associate(&path, out.path(), &[&["--fps", "25", "--size", "640x480"], told].concat());
            assert_eq!(ended.status.code(), Some(0), "{form}: {}", stderr(&ended));
            assert!(stdout(&ended).contains("2 targets") && stderr(&ended).is_empty(), "{form}: {}", stdout(&ended));
            let name = path.file_stem().unwrap().to_str().unwrap();
            let found = numbers(&out.path().join(format!("{name}.txt")));
            let ids: BTreeSet<u64> = found.iter().map(|row| row[1] as u64).collect();
            assert_eq!(ids, BTreeSet::from([1, 2]), "{form}");
            assert!(found.len() >= 2 * (FRAMES as usize - 3), "{form}: {} rows", found.len());
            let same = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02);
            let first = first.get_or_insert_with(|| found.clone());
            assert!(found.len() == first.len() && found.iter().zip(&*first).all(|(a, b)| same(a, b)), "{form}");
        }
    }
}

#[test]
fn a_set_is_worked_on_and_scored() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set");
    for name in ["a", "b"] {
        let sequence = set.join(name);
        std::fs::create_dir_all(&sequence).unwrap();
        std::fs::write(sequence.join("det.txt"), mot()).unwrap();
        let truth = |k: u32, b: &[f64; 5]| {
            let id = if b[1] < 100.0 { 1 } else { 2 };
            format!("{},{id},{},{},{},{},1", k + 1, b[0] + 1.0, b[1] + 1.0, b[2], b[3])
        };
        std::fs::write(sequence.join("gt.txt"), lines(truth)).unwrap();
        let facts = format!("[Sequence]\nframeRate=25\nseqLength={FRAMES}\nimWidth=640\nimHeight=480\n");
        std::fs::write(sequence.join("seqinfo.ini"), facts).unwrap();
    }
    let out = folder.path().join("out");
    let ended = associate(&set, &out, &["--json", "--write", "csv,jsonl"]);
    assert_eq!(ended.status.code(), Some(0), "{}", stderr(&ended));
    let done: serde_json::Value = serde_json::from_str(&stdout(&ended)).unwrap();
    let names: Vec<_> = done["sequences"].as_array().unwrap().iter().map(|s| s["sequence"].as_str().unwrap()).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(rows(&out.join("times.csv"))[1]["sequence"], "b");
    assert!(rows(&out.join("csv/a.csv")).iter().any(|r| r["target"] == "2") && out.join("jsonl/b.jsonl").is_file());
    let results = folder.path().join("results");
    let given = format!("others={}", out.display());
    let (set, results) = (set.to_str().unwrap(), results.to_str().unwrap());
    let args = ["eval", set, "--protocol", "mot", "--out", results, "--results", &given, "--json"];
    let ended = pursuit(&[&args[..], &["--trackers", "pursuit,buffered"]].concat());
    assert_eq!(ended.status.code(), Some(0), "{}", stderr(&ended));
    assert!(Path::new(results).join("report.html").is_file(), "{}", stderr(&ended));
    let said = stdout(&ended);
    assert!(["pursuit", "buffered", "others"].iter().all(|name| said.contains(name)), "{said}");
}

#[test]
fn hostile_files_are_refused_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, text: &[u8], words: &[&str]| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let out = folder.path().join("out");
        fails(&associate(&path, &out, &["--fps", "25", "--size", "640x480"]), 3, &[&[name], words].concat());
        let clip = folder.path().join("clip.mp4");
        let detections = path.to_str().unwrap();
        let args = ["track", clip.to_str().unwrap(), "--detections", detections, "--out", "x", "--no-video"];
        let ended = pursuit(&args);
        assert!(!ended.status.success() && !stderr(&ended).contains("panicked"), "{}", stderr(&ended));
    };
    refused("nan.txt", b"1,-1,nan,2,3,4,0.5\n", &[":1:", "cannot be one"]);
    refused("infinite.txt", b"1,-1,1,2,3,4,0.5\n2,-1,1,2,inf,4,0.5\n", &[":2:"]);
    refused("huge.txt", b"1,-1,1e300,2,3,4,0.5\n", &[":1:"]);
    refused("negative.txt", b"1,-1,1,2,-3,4,0.5\n", &[":1:", "not below 0"]);
    refused("score.txt", b"1,-1,1,2,3,4,nan\n", &[":1:", "score"]);
    refused("frame.txt", b"0,-1,1,2,3,4,0.5\n", &[":1:", "frame"]);
    refused("late.txt", b"99999999999,-1,1,2,3,4,0.5\n", &[":1:", "frame"]);
    refused("columns.txt", b"1,-1,1,2,3\n", &[":1:", "5 cells"]);
    refused("words.txt", b"frame,id,left,top,width,height,score\n", &[":1:", "not a number"]);
    refused("bytes.txt", &[0xff, 0xfe, 0x00, 0x2c, 0x0a], &[":1:", "no text"]);
    refused("cut.json", br#"[{"image_id": 0, "bbox": [1, 2, 3, 4], "sco"#, &[":1:"]);
    refused("short.json", br#"[{"image_id": 0, "bbox": [1, 2, 3], "score": 0.5}]"#, &[]);
    refused("cut.jsonl", b"{\"frame\": 0, \"box\": [1, 2, 3, 4]}\n{\"frame\": 1, \"bo", &[":2:"]);
    refused("few.txt", b"0 -1 Car 0 0 0 1 2 3\n", &[":1:", "frame 0"]);
    let logits = folder.path().join("logits.txt");
    std::fs::write(&logits, "1,-1,1,2,3,4,0.5\n2,-1,1,2,3,4,17.5\n").unwrap();
    let out = folder.path().join("out");
    fails(&associate(&logits, &out, &[]), 2, &["logits.txt", "17.5", "no probability"]);
    let yolo = folder.path().join("yolo");
    std::fs::create_dir(&yolo).unwrap();
    std::fs::write(yolo.join("1.txt"), "0 0.5 0.5 0.1 0.1 0.9\n").unwrap();
    fails(&associate(&yolo, &out, &["--format", "yolo"]), 3, &["--size"]);
    fails(&associate(&folder.path().join("absent.txt"), &out, &[]), 3, &["absent.txt"]);
}

#[test]
fn odd_boxes_are_borne() {
    let folder = tempfile::tempdir().unwrap();
    let borne = |name: &str, line: &dyn Fn(u32) -> String| {
        let path = folder.path().join(format!("{name}.txt"));
        let text = (1..=20).fold(String::new(), |mut text, frame| {
            for _ in 0..40 {
                let _ = writeln!(text, "{frame},-1,{}", line(frame));
            }
            text
        });
        std::fs::write(&path, text).unwrap();
        for model in ["nearest", "two-stage", "buffered", "observation", "joint", "hypotheses"] {
            let out = folder.path().join(format!("{name}-{model}"));
            let setting = format!("many.association.model={model}");
            let ended = associate(&path, &out, &["--fps", "25", "--size", "640x480", "--set", &setting]);
            assert_eq!(ended.status.code(), Some(0), "{name}, {model}: {}", stderr(&ended));
            assert!(
                numbers(&out.join(format!("{name}.txt"))).iter().flatten().all(|n| n.is_finite()),
                "{name}, {model}"
            );
        }
    };
    borne("alike", &|_| "101,101,40,90,0.9".to_owned());
    borne("empty", &|_| "101,101,0,0,0.9".to_owned());
    borne("thin", &|_| "101,101,1e-9,1e-9,0.9".to_owned());
    borne("vast", &|_| "-400000000,-400000000,9e8,9e8,1".to_owned());
    borne("far", &|frame| format!("{},5,40,90,0.9", f64::from(frame) * 4e7));
    borne("unsure", &|_| "101,101,40,90,0".to_owned());
    let (none, out) = (folder.path().join("none.txt"), folder.path().join("none"));
    std::fs::write(&none, "").unwrap();
    let ended = associate(&none, &out, &["--fps", "25"]);
    assert_eq!(ended.status.code(), Some(0), "{}", stderr(&ended));
    assert!(numbers(&out.join("none.txt")).is_empty());
}

#[test]
fn what_makes_no_sense_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("det.txt");
    std::fs::write(&path, mot()).unwrap();
    let out = folder.path().join("out");
    for fps in ["0", "-3", "nan", "inf"] {
        fails(&associate(&path, &out, &["--fps", fps]), 2, &["--fps"]);
    }
    for size in ["640", "0x480", "640x", "axb", "99999999x9"] {
        fails(&associate(&path, &out, &["--size", size]), 2, &["--size", size]);
    }
    fails(&associate(&path, &out, &["--set", "many.association.model=guess"]), 2, &["guess", "nearest"]);
    fails(&associate(&path, &out, &["--set", "many.gait=3"]), 2, &["gait"]);
    fails(&associate(&path, &out, &["--set", "many.embedding.model=colors"]), 2, &["wants pixels", "--video"]);
    let unnamed = ["--video", "scene:drift?seed=1", "--set", "many.embedding.model=network"];
    fails(&associate(&path, &out, &unnamed), 2, &["names no network", "many.embedding.network.file"]);
    fails(&associate(folder.path(), folder.path(), &["--format", "yolo", "--size", "9x9"]), 3, &["det.txt"]);
    let ended = associate(&path, &out, &[]);
    assert!(ended.status.success() && stderr(&ended).contains("25 are assumed"), "{}", stderr(&ended));
    let data = folder.path().to_str().unwrap();
    let args = ["eval", data, "--protocol", "mot", "--out", out.to_str().unwrap()];
    fails(&pursuit(&args), 3, &["gt.txt"]);
    let args = ["track", "scene:drift?seed=1", "--detections", "absent.txt", "--out", out.to_str().unwrap()];
    fails(&pursuit(&args), 3, &["absent.txt"]);
}

#[test]
fn detections_are_followed_beside_the_video() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "scene:drift?seed=7&duration=1";
    let (known, out) = (folder.path().join("known"), folder.path().join("out"));
    let known = known.to_str().unwrap();
    let ended = pursuit(&["track", scene, "--out", known, "--no-video", "--tracker", "mosse"]);
    assert!(ended.status.success(), "{}", stderr(&ended));
    let seen: Vec<[f64; 4]> = rows(&Path::new(known).join("trajectory.csv"))
        .iter()
        .map(|row| ["x", "y", "w", "h"].map(|cell| row[cell].parse().unwrap()))
        .collect();
    let text: String = (0..)
        .zip(&seen)
        .map(|(k, [x, y, w, h])| {
            format!("{{\"frame\": {k}, \"box\": [{x}, {y}, {w}, {h}], \"score\": 0.95, \"class\": \"ball\"}}\n")
        })
        .collect();
    let file = folder.path().join("found.jsonl");
    std::fs::write(&file, text).unwrap();
    let (file, place) = (file.to_str().unwrap(), out.to_str().unwrap());
    let ended = pursuit(&["track", scene, "--detections", file, "--out", place, "--format", "csv,jsonl", "--no-video"]);
    assert!(ended.status.success(), "{}", stderr(&ended));
    let found = rows(&out.join("trajectory.csv"));
    let tracked: Vec<_> = found.iter().filter(|r| r["state"] == "tracking").collect();
    assert!(tracked.len() + 3 >= seen.len() && tracked.iter().all(|r| r["target"] == "1"), "{} rows", tracked.len());
    for row in tracked {
        let at: usize = row["frame"].parse().unwrap();
        let x: f64 = row["x"].parse().unwrap();
        assert!((x - seen[at][0]).abs() < 0.01, "frame {at}: {x} for {}", seen[at][0]);
    }
    assert!(std::fs::read_to_string(out.join("trajectory.jsonl")).unwrap().contains("\"ball\""));
}

#[test]
fn boxes_beside_real_footage_are_followed() {
    let Some(data) = footage("sot2") else { return };
    let folder = tempfile::tempdir().unwrap();
    let name = "SegTrack2_bird_of_paradise";
    let known = rows(&data.join(format!("{name}.csv")));
    // Every fourth box is missed.
    let line = |(k, row): (usize, &std::collections::HashMap<String, String>)| {
        let [x, y, w, h] = ["x", "y", "w", "h"].map(|cell| row[cell].parse::<f64>().unwrap());
        format!("{},-1,{},{},{w},{h},0.9\n", k + 1, x + 1.0, y + 1.0)
    };
    let text: String = known.iter().enumerate().filter(|(k, _)| k % 4 != 3).map(line).collect();
    let file = folder.path().join("det.txt");
    std::fs::write(&file, text).unwrap();
    let (clip, out) = (data.join(format!("{name}.mp4")), folder.path().join("out"));
    let args =
        ["track", clip.to_str().unwrap(), "--detections", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let ended = pursuit(&[&args[..], &["--no-video"]].concat());
    assert!(ended.status.success(), "{}", stderr(&ended));
    let found = rows(&out.join("trajectory.csv"));
    let in_state = |state: &str| found.iter().filter(|r| r["state"] == state).count();
    assert!(found.iter().all(|r| r["target"] == "1"), "one thing is one target");
    assert!(
        4 * in_state("tracking") + 12 >= 3 * known.len() && in_state("occluded") > known.len() / 8,
        "{}",
        found.len()
    );
}
