//! Folders of runs, evaluations and reproductions are looked at, below the root and nowhere else.

use crate::common::{studio, without_times};
use pursuit::BBox;
use pursuit::evaluation::{EvalOptions, Protocol, evaluate, spatial_variants};
use pursuit::media::OpenOptions;
use pursuit::{Run, RunConfig};
use serde_json::json;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A bright square that moves, and in the second half jumps away from whoever follows it; with its truth.
fn clip(folder: &Path, name: &str) {
    std::fs::create_dir_all(folder).unwrap();
    let (mut video, mut truth) = (b"YUV4MPEG2 W96 H64 F25:1 Ip A1:1 Cmono\n".to_vec(), "index,x,y,w,h\n".to_owned());
    for i in 0..40 {
        let (left, top) = if i < 20 { (8 + i, 10) } else { (70, 40 + (i - 20) / 4) };
        video.extend_from_slice(b"FRAME\n");
        video.extend((0..96 * 64).map(|k| {
            let (x, y) = (k % 96, k / 96);
            let inside = (left..left + 16).contains(&x) && (top..top + 16).contains(&y);
            let gray = if inside { 120 + ((x - left) * 37 + (y - top) * 11) % 120 } else { 20 + (x * 7 + y * 13) % 40 };
            gray as u8
        }));
        truth += &format!("{i},{left},{top},16,16\n");
    }
    std::fs::write(folder.join(format!("{name}.y4m")), video).unwrap();
    std::fs::write(folder.join(format!("{name}.csv")), truth).unwrap();
}

#[test]
fn an_evaluation_is_listed_shown_and_its_worst_frames_can_be_opened() {
    let (studio, root) = studio();
    assert_eq!(studio.get("/api/runs").json(), json!([]));
    let (data, out) = (root.path().join("data"), root.path().join("out/eval"));
    clip(&data, "mover");
    let recipe = pursuit::recipe("mosse").unwrap().with(&"policy.model = 'always'".parse().unwrap()).unwrap();
    let mut options = EvalOptions::new(vec![data], vec![recipe.into()], out.clone());
    options.report = false;
    let results = evaluate(&options, &|_| {}, &AtomicBool::new(false)).unwrap();
    let listed = studio.get("/api/runs").json();
    assert_eq!(
        (&listed[0]["path"], &listed[0]["kind"], &listed[1]),
        (&json!("out/eval"), &json!("evaluation"), &json!(null))
    );
    let run = studio.get("/api/runs/results?folder=out/eval").json();
    let shown = &run["trackers"][0];
    assert_eq!(
        (&run["kind"], &run["protocol"], &shown["name"]),
        (&json!("evaluation"), &json!("ope"), &json!("mosse"))
    );
    let auc = results.trackers["mosse"].sequences["mover"].auc;
    assert_eq!(shown["sequences"]["mover"]["auc"].as_f64(), Some(auc));
    let worst = studio.get("/api/runs/worst?folder=out/eval&tracker=mosse&sequence=mover").json();
    assert_eq!((&worst["source"], &worst["first"]), (&json!("data/mover.y4m"), &json!(0)));
    let frames = worst["frames"].as_array().unwrap();
    assert!(frames.len() > 2, "{worst}");
    let of = |i: usize| (frames[i]["frame"].as_u64().unwrap(), frames[i]["overlap"].as_f64().unwrap());
    assert!(of(0).0 >= 20 && of(0).1 < 0.1, "it jumped at 20: {worst}");
    assert!((1..frames.len()).all(|i| of(i).1 >= of(i - 1).1));
    // The source that it names can be opened.
    let trial = studio.trial(&json!({ "source": worst["source"], "tracker": "mosse" }));
    assert_eq!(studio.get(&trial).json()["input"]["frame_count"], 40);
    for (query, status) in [
        ("folder=out/eval&tracker=kcf&sequence=mover", 404),
        ("folder=out/eval&tracker=mosse&sequence=../mover", 404),
        ("folder=../eval&tracker=mosse&sequence=mover", 404),
        ("folder=data&tracker=mosse&sequence=mover", 422),
        ("folder=out/eval", 400),
    ] {
        assert_eq!(studio.get(&format!("/api/runs/worst?{query}")).status, status, "{query}");
    }
    // Without its footage, the figures are still there.
    std::fs::remove_file(root.path().join("data/mover.y4m")).unwrap();
    std::fs::remove_file(root.path().join("data/mover.csv")).unwrap();
    let worst = studio.get("/api/runs/worst?folder=out/eval&tracker=mosse&sequence=mover").json();
    assert_eq!(worst, json!({ "source": null, "first": 0, "frames": [] }));
}

/// The recipe of a run as a whole, followed and left in `out/run` below the root.
fn tracked(root: &Path, change: impl FnOnce(&mut RunConfig)) -> String {
    clip(&root.join("data"), "mover");
    let _ = std::fs::remove_dir_all(root.join("out/run"));
    let mut config = RunConfig {
        input: Some(root.join("data/mover.y4m").into()),
        tracker: Some("kcf".into()),
        boxes: vec![[8.0, 10.0, 16.0, 16.0]],
        out: Some(root.join("out/run")),
        video: Some(false),
        ..RunConfig::default()
    };
    change(&mut config);
    Run::prepare(config, &OpenOptions::default()).unwrap().run(|_| {}).unwrap();
    std::fs::read_to_string(root.join("out/run/trajectory.csv")).unwrap()
}

#[test]
fn a_run_of_a_tracker_is_opened_with_what_it_said_and_followed_again_from_a_correction() {
    let (studio, root) = studio();
    let told = tracked(root.path(), |_| {});
    let listed = studio.get("/api/runs").json();
    let run = json!({ "path": "out/run", "kind": "tracking", "tracker": "kcf", "edited": false, "written_ms": listed[0]["written_ms"] });
    assert_eq!(listed, json!([run]));
    assert!(listed[0]["written_ms"].as_u64().is_some_and(|ms| ms > 1_700_000_000_000));
    let run = studio.get("/api/runs/results?folder=out/run").json();
    assert_eq!((&run["kind"], &run["run"]["recipe"]["tracker"]), (&json!("tracking"), &json!("kcf")));
    let opened = studio.ok("POST", "/api/trials", &json!({ "run": "out/run" }));
    assert_eq!(opened["source"], "data/mover.y4m", "as a source names it");
    let trial = format!("/api/trials/{}", opened["trial"]);
    let facts = studio.get(&trial).json();
    assert_eq!(
        (&facts["phase"], &facts["recorded"], &facts["tracker"]),
        (&json!("paused"), &json!(true), &json!("kcf"))
    );
    assert_eq!((&facts["first"], &facts["head"], &facts["now"]["frame"]), (&json!(0), &json!(39), &json!(0)));
    let csv = |trial: &str| studio.get(&format!("{trial}/trajectory?format=csv")).text();
    assert_eq!(csv(&trial), told);
    // Played to its end, it is as it was.
    let end = studio.follow_to_the_end(&trial);
    assert_eq!((&end["phase"], &end["recorded"], &end["now"]["frame"]), (&json!("ended"), &json!(true), &json!(39)));
    assert_eq!(csv(&trial), told);
    // A correction is followed from there, as in a trial in which everything was followed.
    let own = studio.trial(&json!({ "source": "data/mover.y4m", "tracker": "kcf" }));
    studio.ok("POST", &format!("{own}/targets"), &json!({ "box": [8, 10, 16, 16] }));
    studio.follow_to_the_end(&own);
    for trial in [&trial, &own] {
        studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": 25 }));
        let facts = studio.ok("PUT", &format!("{trial}/targets/1"), &json!({ "box": [70, 41, 16, 16] }));
        assert_eq!((&facts["recorded"], &facts["head"]), (&json!(false), &json!(25)));
        studio.follow_to_the_end(trial);
    }
    assert_eq!(without_times(&csv(&trial)), without_times(&csv(&own)));
    let before = studio.get(&format!("{trial}/trajectory?format=csv&version=1")).text();
    assert_eq!(before, told, "the recorded version is kept");
    // The folder of the command's run is left as it was: what is done to it here has one of its own.
    assert_eq!(std::fs::read_to_string(root.path().join("out/run/trajectory.csv")).unwrap(), told);
    assert!(studio.get(&trial).json()["folder"].as_str().is_some_and(|f| f.starts_with("pursuit-out/mover")));
}

#[test]
fn a_run_that_was_interrupted_goes_on_where_it_ended() {
    let (studio, root) = studio();
    let whole = tracked(root.path(), |_| {});
    let folder = root.path().join("out/run");
    // As if it had been killed after frame 14.
    let cut: Vec<&str> = whole.split_inclusive('\n').take(16).collect();
    std::fs::write(folder.join("trajectory.csv"), cut.concat()).unwrap();
    let facts = std::fs::read_to_string(folder.join("run.json")).unwrap().replace("\"done\"", "\"interrupted\"");
    std::fs::write(folder.join("run.json"), facts).unwrap();
    let trial = studio.trial(&json!({ "run": "out/run" }));
    assert_eq!(studio.get(&trial).json()["head"], 14);
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": 14 }));
    let facts = studio.order(&trial, "step");
    assert_eq!((&facts["now"]["frame"], &facts["head"], &facts["recorded"]), (&json!(15), &json!(15), &json!(false)));
    studio.follow_to_the_end(&trial);
    let csv = studio.get(&format!("{trial}/trajectory?format=csv")).text();
    assert_eq!(without_times(&csv), without_times(&whole));
}

#[test]
fn a_run_that_the_studio_cannot_repeat_is_looked_at_alone() {
    let (studio, root) = studio();
    let told = tracked(root.path(), |config| config.region = Some([0.0, 0.0, 64.0, 64.0]));
    let trial = studio.trial(&json!({ "run": "out/run" }));
    studio.follow_to_the_end(&trial);
    assert_eq!(studio.get(&format!("{trial}/trajectory?format=csv")).text(), told);
    let bad = studio.send("POST", &format!("{trial}/targets"), &json!({ "box": [8, 10, 16, 16] }));
    assert!(bad.status == 409 && bad.text().contains("a part of the picture"), "{}", bad.text());
    assert_eq!(studio.send("POST", &format!("{trial}/orders"), &json!({ "order": "start" })).status, 409);
    tracked(root.path(), |config| config.stride = std::num::NonZeroU64::new(3));
    let strided = studio.trial(&json!({ "run": "out/run" }));
    assert_eq!(studio.get(&strided).json()["recorded"], true);
    assert_eq!(studio.send("PUT", &format!("{strided}/parameters"), &json!({ "learning_rate": 0.05 })).status, 409);
    // What it names must be there, and below the root.
    std::fs::rename(root.path().join("data/mover.y4m"), root.path().join("data/other.y4m")).unwrap();
    let gone = studio.send("POST", "/api/trials", &json!({ "run": "out/run" }));
    assert!(gone.status == 404 && gone.text().contains("input is not below the root"), "{}", gone.text());
    for (folder, status) in [("data", 422), ("..", 404), ("out/none", 404)] {
        assert_eq!(studio.send("POST", "/api/trials", &json!({ "run": folder })).status, status, "{folder}");
    }
    for (file, text) in [("run.json", "{}"), ("trajectory.csv", "a,b\n1,2\n"), ("trajectory.csv", "")] {
        tracked(root.path(), |_| {});
        std::fs::write(root.path().join("out/run").join(file), text).unwrap();
        let damaged = studio.send("POST", "/api/trials", &json!({ "run": "out/run" }));
        assert_eq!(damaged.status, 422, "{file}: {}", damaged.text());
    }
}

#[test]
fn of_several_passes_the_worst_frames_say_which() {
    let (studio, root) = studio();
    let (data, out) = (root.path().join("data"), root.path().join("out/sre"));
    clip(&data, "mover");
    let recipe = pursuit::recipe("mosse").unwrap();
    let mut options = EvalOptions::new(vec![data], vec![recipe.into()], out);
    (options.report, options.protocol) = (false, Protocol::Sre);
    evaluate(&options, &|_| {}, &AtomicBool::new(false)).unwrap();
    let worst = studio.get("/api/runs/worst?folder=out/sre&tracker=mosse&sequence=mover").json();
    let frames = worst["frames"].as_array().unwrap();
    assert!(frames.len() > 2, "{worst}");
    let known: Vec<&str> =
        spatial_variants(BBox::from_ltwh(0.0, 0.0, 9.0, 9.0)).iter().map(|(label, _)| *label).collect();
    assert!(frames.iter().all(|f| f["pass"].as_str().is_some_and(|pass| known.contains(&pass))), "{worst}");
}

#[test]
fn a_reproduction_has_its_table_and_pictures_and_nothing_else_is_given_out() {
    let (studio, root) = studio();
    let folder = root.path().join("reproduce-qu2010");
    std::fs::create_dir(&folder).unwrap();
    let row = json!({ "setting": "line", "figure": "rms", "paper": 1.5, "reference": null, "ours": { "value": 1.4, "low": null, "high": null },
        "tuned_plain": null, "imm": null, "bar": null, "verdict": "pass" });
    let results = json!({ "paper": "qu2010", "title": "prediction", "seeds": 2, "rows": [row], "findings": [] });
    std::fs::write(folder.join("results.json"), results.to_string()).unwrap();
    std::fs::write(folder.join("figure-5.svg"), "<svg xmlns=\"http://www.w3.org/2000/svg\"/>").unwrap();
    std::fs::write(folder.join("notes.txt"), "private").unwrap();
    std::fs::write(root.path().join("other.svg"), "<svg/>").unwrap();
    let run = studio.get("/api/runs/results?folder=reproduce-qu2010").json();
    assert_eq!((&run["kind"], &run["rows"][0]), (&json!("reproduction"), &row));
    assert_eq!(run["pictures"], json!(["figure-5.svg"]));
    let picture = |folder: &str, name: &str| studio.get(&format!("/api/runs/picture?folder={folder}&name={name}"));
    let figure = picture("reproduce-qu2010", "figure-5.svg");
    assert_eq!((figure.status, figure.header("content-type").as_deref()), (200, Some("image/svg+xml")));
    assert!(figure.header("content-security-policy").unwrap().contains("default-src 'none'"), "no script of it runs");
    for (folder, name) in [
        ("reproduce-qu2010", "notes.txt"),
        ("reproduce-qu2010", "../other.svg"),
        ("reproduce-qu2010", "figure-6.svg"),
        ("..", "other.svg"),
    ] {
        assert_eq!(picture(folder, name).status, 404, "{folder} {name}");
    }
    assert_eq!(picture("", "other.svg").status, 422, "a folder without results");
    for bad in ["{", "[]", "{\"rows\": 1}"] {
        std::fs::write(folder.join("results.json"), bad).unwrap();
        assert_eq!(studio.get("/api/runs/results?folder=reproduce-qu2010").status, 422, "{bad}");
    }
}

#[test]
#[cfg(unix)]
fn links_that_lead_outside_are_not_followed() {
    let (studio, root) = studio();
    let outside = tempfile::tempdir().unwrap();
    std::fs::write(outside.path().join("results.json"), "{\"protocol\":\"ope\",\"trackers\":{}}").unwrap();
    std::fs::write(outside.path().join("secret.svg"), "<svg/>").unwrap();
    std::os::unix::fs::symlink(outside.path(), root.path().join("run")).unwrap();
    assert_eq!(studio.get("/api/runs").json(), json!([]));
    assert_eq!(studio.get("/api/runs/results?folder=run").status, 404);
    let inside = root.path().join("own");
    std::fs::create_dir(&inside).unwrap();
    std::fs::write(inside.join("results.json"), "{\"paper\":\"qu2010\",\"rows\":[]}").unwrap();
    std::os::unix::fs::symlink(outside.path().join("secret.svg"), inside.join("figure.svg")).unwrap();
    assert_eq!(studio.get("/api/runs/picture?folder=own&name=figure.svg").status, 404);
    std::fs::remove_file(inside.join("results.json")).unwrap();
    std::os::unix::fs::symlink(outside.path().join("results.json"), inside.join("results.json")).unwrap();
    assert_eq!(studio.get("/api/runs/results?folder=own").status, 422);
}
