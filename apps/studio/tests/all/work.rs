//! What is done in a trial is kept: undone and done again, in a folder as it goes, read back from files.

use crate::common::{Opened, open, studio, without_times};
use pursuit_studio::Options;
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

const SCENE: &str = "scene:drift?seed=7&duration=3";

fn truth(frame: u64) -> [f64; 4] {
    let b = pursuit::open(SCENE).unwrap().info().truth_at(frame).bbox().unwrap();
    [b.left(), b.top(), b.width(), b.height()]
}

fn begun(studio: &Opened, tracker: &str) -> String {
    let trial = studio.trial(&json!({ "source": SCENE, "tracker": tracker }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": truth(0) }));
    trial
}

fn seek(studio: &Opened, trial: &str, frame: u64) -> Value {
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": frame }))
}

fn csv(studio: &Opened, trial: &str) -> String {
    studio.get(&format!("{trial}/trajectory")).text()
}

/// What the folder of a trial holds.
fn kept(root: &Path, facts: &Value) -> (String, Value, Value) {
    let folder = root.join(facts["folder"].as_str().unwrap());
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let json = |name: &str| serde_json::from_str(&text(name)).unwrap();
    (text("trajectory.csv"), json("run.json"), json("edits.json"))
}

#[test]
fn every_change_is_undone_and_done_again() {
    let (studio, root) = studio();
    let trial = begun(&studio, "mosse");
    studio.follow_to_the_end(&trial);
    let names = |facts: &Value| (facts["undo"].clone(), facts["redo"].clone());
    let mut states = vec![csv(&studio, &trial)];
    // A correction, another target, a parameter, a name, another tracker: each is a state that comes back.
    seek(&studio, &trial, 40);
    studio.ok("PUT", &format!("{trial}/targets/1"), &json!({ "box": truth(42) }));
    states.push(csv(&studio, &trial));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [5, 5, 20, 20] }));
    states.push(csv(&studio, &trial));
    studio.ok("PUT", &format!("{trial}/parameters"), &json!({ "motion.model": "imm" }));
    states.push(csv(&studio, &trial));
    studio.ok("PUT", &format!("{trial}/targets/2/label"), &json!({ "name": "post", "color": "#10ff20" }));
    let facts = studio.ok("PUT", &format!("{trial}/method"), &json!({ "tracker": "kcf" }));
    states.push(csv(&studio, &trial));
    assert_eq!(names(&facts), (json!("another tracker"), json!(null)));
    assert_eq!(facts["names"], json!({ "2": { "name": "post", "color": "#10ff20" } }));
    let mut seen = vec![facts["revision"].as_u64().unwrap()];
    for (i, wanted) in [(3, true), (3, false), (2, false), (1, false), (0, false)] {
        let facts = studio.order(&trial, "undo");
        assert_eq!(csv(&studio, &trial), states[i], "undone to {i}");
        assert_eq!(facts["names"].as_object().is_some_and(|names| !names.is_empty()), wanted);
        assert_eq!(kept(root.path(), &facts).0, states[i], "the file is undone too");
        seen.push(facts["revision"].as_u64().unwrap());
    }
    let facts = studio.get(&trial).json();
    assert_eq!((&facts["tracker"], &facts["head"], &facts["phase"]), (&json!("mosse"), &json!(89), &json!("ended")));
    for i in [1, 2, 3, 3, 4] {
        let facts = studio.order(&trial, "redo");
        assert_eq!(csv(&studio, &trial), states[i], "done again to {i}");
        seen.push(facts["revision"].as_u64().unwrap());
    }
    assert!(seen.is_sorted_by(|a, b| a < b), "whoever has read rows is told that they are others: {seen:?}");
    assert_eq!(studio.send("POST", &format!("{trial}/orders"), &json!({ "order": "redo" })).status, 409);
    assert_eq!(studio.get(&trial).json()["tracker"], "kcf");
}

#[test]
fn after_an_undo_it_is_followed_as_if_nothing_had_been_done() {
    let (studio, _root) = studio();
    let (plain, other) = (begun(&studio, "kcf"), begun(&studio, "kcf"));
    studio.follow_to_the_end(&plain);
    // Before the end: the follower has to catch up by itself, from wherever it is.
    seek(&studio, &other, 50);
    for at in [20, 45] {
        seek(&studio, &other, at);
        studio.ok("PUT", &format!("{other}/targets/1"), &json!({ "box": truth(at + 3) }));
    }
    for _ in 0..2 {
        studio.order(&other, "undo");
    }
    assert_eq!(studio.get(&other).json()["head"], 50);
    studio.follow_to_the_end(&other);
    assert_eq!(without_times(&csv(&studio, &other)), without_times(&csv(&studio, &plain)));
    // And after the first box itself was given up for another.
    let third = begun(&studio, "kcf");
    studio.ok("PUT", &format!("{third}/targets/1"), &json!({ "box": [3, 3, 12, 12] }));
    let facts = studio.order(&third, "undo");
    assert_eq!(facts["now"]["records"][0]["box"], json!(truth(0)));
    studio.follow_to_the_end(&third);
    assert_eq!(without_times(&csv(&studio, &third)), without_times(&csv(&studio, &plain)));
    for bad in [json!({ "name": "x".repeat(61) }), json!({ "color": "red" }), json!({ "name": "a\nb" })] {
        assert_eq!(studio.send("PUT", &format!("{third}/targets/1/label"), &bad).status, 422, "{bad}");
    }
    assert_eq!(studio.send("PUT", &format!("{third}/targets/9/label"), &json!({ "name": "x" })).status, 404);
}

#[test]
fn a_box_before_the_first_step_begins_elsewhere_and_leaves_no_trace() {
    let (studio, root) = studio();
    let trial = studio.trial(&json!({ "source": SCENE, "tracker": "mosse" }));
    assert_eq!(studio.get(&trial).json()["folder"], json!(null), "nothing is written of what nobody has touched");
    assert!(!root.path().join("pursuit-out").exists());
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [3, 3, 12, 12] }));
    let facts = studio.ok("PUT", &format!("{trial}/targets/1"), &json!({ "box": truth(0) }));
    assert_eq!((&facts["targets"], &facts["edits"][1]), (&json!([1]), &json!(null)), "{facts}");
    let facts = studio.follow_to_the_end(&trial);
    let (_, run, edits) = kept(root.path(), &facts);
    assert_eq!((&run["status"], &run["recipe"]["boxes"]), (&json!("done"), &json!([truth(0)])));
    assert_eq!(edits["edits"], json!([{ "frame": 0, "what": "add", "target": 1, "box": truth(0) }]));
    let plain = begun(&studio, "mosse");
    studio.follow_to_the_end(&plain);
    assert_eq!(without_times(&csv(&studio, &trial)), without_times(&csv(&studio, &plain)));
}

#[test]
fn the_folder_holds_everything_after_every_frame_and_is_gone_on_with() {
    let root = tempfile::tempdir().unwrap();
    let options = || Options { root: root.path().to_owned(), ..Options::default() };
    let studio = open(options());
    let trial = begun(&studio, "kcf");
    for frame in 1..6 {
        let facts = studio.order(&trial, "step");
        let lines = kept(root.path(), &facts).0.lines().count() as u64;
        assert_eq!(lines, frame + 2, "header and frames 0 to {frame}");
    }
    seek(&studio, &trial, 60);
    seek(&studio, &trial, 30);
    studio.ok("PUT", &format!("{trial}/targets/1"), &json!({ "box": truth(31) }));
    studio.ok("PUT", &format!("{trial}/targets/1/label"), &json!({ "name": "queen" }));
    let facts = seek(&studio, &trial, 44);
    let (told, run, edits) = kept(root.path(), &facts);
    assert_eq!(told, csv(&studio, &trial));
    assert_eq!((&run["status"], &run["frame_count"]), (&json!("running"), &json!(45)));
    assert_eq!(edits["edits"].as_array().unwrap().len(), 2);
    drop(studio);
    assert_eq!(kept(root.path(), &facts).1["status"], "interrupted");

    // Another studio opens it with its corrections, goes on in the same folder, and comes to what it would have been.
    let studio = open(options());
    let folder = facts["folder"].as_str().unwrap();
    assert_eq!(studio.get("/api/runs").json()[0]["edited"], true);
    let trial = studio.trial(&json!({ "run": folder }));
    let again = studio.get(&trial).json();
    assert_eq!((&again["head"], &again["names"]["1"]["name"]), (&json!(44), &json!("queen")));
    assert_eq!(again["edits"].as_array().unwrap().len(), 2);
    let end = studio.follow_to_the_end(&trial);
    assert_eq!(end["folder"], folder);
    let whole = kept(root.path(), &end).0;
    assert_eq!(whole.lines().count(), 91);
    let plain = begun(&studio, "kcf");
    seek(&studio, &plain, 30);
    studio.ok("PUT", &format!("{plain}/targets/1"), &json!({ "box": truth(31) }));
    studio.follow_to_the_end(&plain);
    assert_eq!(without_times(&whole), without_times(&csv(&studio, &plain)));
    // Two trials do not write into one folder.
    let second = studio.trial(&json!({ "run": folder }));
    let facts = studio.ok("PUT", &format!("{second}/targets/1/label"), &json!({ "name": "drone" }));
    assert_ne!(facts["folder"], folder);
}

#[test]
fn trials_that_nobody_looks_at_are_closed_and_kept() {
    let root = tempfile::tempdir().unwrap();
    let patience = Duration::from_millis(2000);
    let studio = open(Options { root: root.path().to_owned(), patience, ..Options::default() });
    let (forgotten, seen) = (begun(&studio, "mosse"), begun(&studio, "mosse"));
    let folder = studio.order(&forgotten, "step")["folder"].as_str().unwrap().to_owned();
    let _looking = tungstenite::connect(format!("ws://{}{seen}/live", studio.host())).unwrap();
    let listed = || studio.get("/api/trials").json()["trials"].as_array().unwrap().len();
    let began = Instant::now();
    while listed() > 1 {
        assert!(began.elapsed() < Duration::from_secs(60), "it stays open");
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_eq!((studio.get(&forgotten).status, studio.get(&seen).status), (404, 200));
    assert_eq!(studio.ok("POST", "/api/trials", &json!({ "run": folder }))["facts"]["head"], 1);
}

#[test]
fn one_trial_waits_for_the_other_and_is_never_ahead() {
    let (studio, _root) = studio();
    let (slow, fast) = (begun(&studio, "pursuit"), begun(&studio, "mosse"));
    let number = |trial: &str| trial.rsplit('/').next().unwrap().parse::<u64>().unwrap();
    let beside = |other: Value| json!({ "order": "beside", "trial": other });
    assert_eq!(studio.send("POST", &format!("{fast}/orders"), &beside(json!(number(&fast)))).status, 422);
    assert_eq!(studio.send("POST", &format!("{fast}/orders"), &beside(json!(1_u64 << 60))).status, 404);
    studio.ok("POST", &format!("{fast}/orders"), &beside(json!(number(&slow))));
    for trial in [&slow, &fast] {
        studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "speed", "times": null }));
        studio.order(trial, "start");
    }
    loop {
        let facts = studio.get(&fast).json();
        // What is shown beside is of the same frame, so the one that waits is never ahead.
        assert_eq!(facts["beside"]["now"]["frame"], facts["now"]["frame"], "{facts}");
        if facts["phase"] == "ended" {
            break;
        }
        assert_eq!(facts["phase"], "running");
        std::thread::sleep(Duration::from_millis(5));
    }
    let facts = seek(&studio, &fast, 30);
    assert_eq!(
        (&facts["beside"]["now"]["frame"], &facts["beside"]["now"]["records"][0]["target"]),
        (&json!(30), &json!(1))
    );
    let facts = studio.ok("POST", &format!("{fast}/orders"), &beside(json!(null)));
    assert_eq!(facts["beside"], json!(null));
}

#[test]
fn who_is_who_is_said_afterwards_and_followed_so() {
    let (studio, root) = studio();
    let trial = begun(&studio, "mosse");
    seek(&studio, &trial, 30);
    // The same target once more, as if it had been lost and found.
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": truth(30) }));
    seek(&studio, &trial, 40);
    let identity =
        |target: u64, change: Value| studio.send("PUT", &format!("{trial}/targets/{target}/identity"), &change);
    let before = csv(&studio, &trial);
    for (target, change, status) in [
        (1, json!({ "change": "merge", "into": 1 }), 422),
        (1, json!({ "change": "merge", "into": 9 }), 422),
        (2, json!({ "change": "swap", "with": 1, "from": 10, "to": 20 }), 422),
        (9, json!({ "change": "split" }), 422),
        (1, json!({ "change": "marry" }), 422),
    ] {
        assert_eq!(identity(target, change.clone()).status, status, "{change}");
    }
    assert_eq!(csv(&studio, &trial), before);
    assert_eq!(identity(2, json!({ "change": "merge", "into": 1 })).json()["targets"], json!([1]));
    let merged = csv(&studio, &trial);
    assert_eq!(merged.lines().count(), 42, "one line a frame");
    // Where it goes on, it is a target that was put right in frame 30.
    let facts = studio.follow_to_the_end(&trial);
    assert_eq!(kept(root.path(), &facts).0, csv(&studio, &trial));
    let plain = begun(&studio, "mosse");
    seek(&studio, &plain, 30);
    studio.ok("PUT", &format!("{plain}/targets/1"), &json!({ "box": truth(30) }));
    studio.follow_to_the_end(&plain);
    assert_eq!(without_times(&csv(&studio, &trial)), without_times(&csv(&studio, &plain)));
    // From frame 50 on it is another.
    seek(&studio, &trial, 50);
    let facts = identity(1, json!({ "change": "split" })).json();
    assert_eq!((&facts["targets"], &facts["now"]["records"][0]["target"]), (&json!([3]), &json!(3)));
    studio.order(&trial, "undo");
    assert_eq!(without_times(&csv(&studio, &trial)), without_times(&csv(&studio, &plain)));
}

#[test]
fn what_is_exported_is_read_back() {
    let (studio, _root) = studio();
    let trial = begun(&studio, "kcf");
    studio.follow_to_the_end(&trial);
    let whole = csv(&studio, &trial);
    for format in ["csv", "mot", "coco", "cvat"] {
        let text = studio.get(&format!("{trial}/trajectory?format={format}")).body;
        let empty = studio.trial(&json!({ "source": SCENE, "tracker": "kcf" }));
        let answer = studio.request("POST", &format!("{empty}/import"), &[], &text);
        assert_eq!(answer.status, 200, "{format}: {}", answer.text());
        let facts = answer.json();
        assert_eq!(
            (&facts["head"], &facts["targets"], &facts["undo"]),
            (&json!(89), &json!([1]), &json!("a file read"))
        );
        let boxes =
            |csv: &str| csv.lines().map(|l| l.split(',').skip(4).take(4).collect::<String>()).collect::<Vec<_>>();
        assert_eq!(boxes(&csv(&studio, &empty)), boxes(&whole), "{format}");
        // From a correction on it is followed.
        seek(&studio, &empty, 80);
        studio.ok("PUT", &format!("{empty}/targets/1"), &json!({ "box": truth(80) }));
        assert_eq!(studio.follow_to_the_end(&empty)["head"], 89);
        studio.ok("DELETE", &empty, &json!({}));
    }
    let bad = studio.request("POST", &format!("{trial}/import"), &[], b"200,1,1,1,9,9,1,-1,-1,-1\n");
    assert!(bad.status == 422 && bad.text().contains("90 frames"), "{}", bad.text());
    assert_eq!(csv(&studio, &trial), whole, "what is refused changes nothing");
    let film = studio.get(&format!("{trial}/video"));
    assert_eq!((film.status, &film.body[4..8]), (200, &b"ftyp"[..]));
}
