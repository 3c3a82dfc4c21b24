//! What comes out of the studio is what comes out of the command line, to the last digit, also after going back, changing
//! one's mind and correcting.

use crate::common::{studio, without_times};
use pursuit::media::OpenOptions;
use pursuit::{Run, RunConfig};
use serde_json::json;

const SCENE: &str = "scene:occluding-bar?seed=3&duration=3";

/// What `pursuit track` leaves in `trajectory.csv` for this configuration.
fn by_command_line(config: &str) -> String {
    let out = tempfile::tempdir().unwrap();
    let config: RunConfig = pursuit::toml::from_str(config).unwrap();
    let config = RunConfig { out: Some(out.path().join("run")), video: Some(false), ..config };
    let finished = Run::prepare(config, &OpenOptions::default()).unwrap().run(|_| {}).unwrap();
    assert!(finished.outcome.failure.is_none());
    std::fs::read_to_string(out.path().join("run/trajectory.csv")).unwrap()
}

fn first_box(scene: &str) -> [f64; 4] {
    let source = pursuit::open(scene).unwrap();
    let b = source.info().truth_at(0).bbox().unwrap();
    [b.left(), b.top(), b.width(), b.height()]
}

#[test]
fn equals_that_of_the_command_line() {
    let (studio, _root) = studio();
    let [l, t, w, h] = first_box(SCENE);
    for (tracker, parameters, as_toml) in [
        ("kcf", json!({}), ""),
        ("pursuit-light", json!({ "motion": { "model": "imm" } }), "[parameters]\nmotion.model = 'imm'"),
        ("dsst", json!({ "policy.model": "always" }), "[parameters]\npolicy.model = 'always'"),
    ] {
        let config =
            format!("input = '{SCENE}'\ntracker = '{tracker}'\nboxes = [[{l:?}, {t:?}, {w:?}, {h:?}]]\n{as_toml}");
        let wanted = by_command_line(&config);
        let trial = studio.trial(&json!({ "source": SCENE, "tracker": tracker, "parameters": parameters }));
        studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [l, t, w, h] }));
        studio.follow_to_the_end(&trial);
        let csv = studio.get(&format!("{trial}/trajectory")).text();
        assert_eq!(without_times(&csv), without_times(&wanted), "{tracker}");
        assert!(wanted.lines().count() > 60);
        studio.ok("DELETE", &trial, &json!({}));
    }
}

#[test]
fn stays_the_same_by_steps_back_and_forth_and_after_starting_again() {
    let (studio, _root) = studio();
    let ltwh = first_box(SCENE);
    let trial = studio.trial(&json!({ "source": SCENE, "tracker": "mosse" }));
    // Parameters chosen before anything was followed are those of the recipe.
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": ltwh }));
    studio.ok("PUT", &format!("{trial}/parameters"), &json!({ "motion.model": "singer" }));
    for order in ["step", "step", "back", "back", "step", "step", "step", "step"] {
        studio.order(&trial, order);
    }
    let facts = studio.get(&trial).json();
    assert_eq!((facts["now"]["frame"].as_u64(), facts["head"].as_u64()), (Some(4), Some(4)));
    studio.follow_to_the_end(&trial);
    let csv = |number: &str| studio.get(&format!("{trial}/trajectory?format=csv{number}")).text();
    let first = csv("");
    let [l, t, w, h] = ltwh;
    let wanted = by_command_line(&format!(
        "input = '{SCENE}'\ntracker = 'mosse'\nboxes = [[{l:?}, {t:?}, {w:?}, {h:?}]]\n[parameters]\nmotion.model = 'singer'"
    ));
    assert_eq!(without_times(&first), without_times(&wanted));
    // From its end, it begins again.
    let facts = studio.follow_to_the_end(&trial);
    assert_eq!(without_times(&csv("")), without_times(&wanted));
    let number = facts["versions"][0]["number"].as_u64().unwrap();
    assert_eq!(csv(&format!("&version={number}")), first, "the version before is kept");
}

#[test]
fn a_correction_is_followed_from_its_frame_on_and_versions_are_kept() {
    let (studio, _root) = studio();
    let scene = "scene:drift?seed=7&duration=4";
    let trial = studio.trial(&json!({ "source": scene, "tracker": "kcf" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": first_box(scene) }));
    studio.follow_to_the_end(&trial);
    let before = studio.get(&format!("{trial}/trajectory")).text();
    // Frame 70 is behind two snapshots.
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": 70 }));
    let truth = pursuit::open(scene).unwrap().info().truth_at(70).bbox().unwrap();
    let ltwh = [truth.left() + 1.0, truth.top() - 1.0, truth.width(), truth.height()];
    let facts = studio.ok("PUT", &format!("{trial}/targets/1"), &json!({ "box": ltwh }));
    assert_eq!((facts["head"].as_u64(), facts["version"].as_u64()), (Some(70), Some(2)), "{facts}");
    assert_eq!(facts["now"]["records"][0]["box"], json!(ltwh));
    studio.follow_to_the_end(&trial);
    let after = studio.get(&format!("{trial}/trajectory")).text();
    let (before, after) = (without_times(&before), without_times(&after));
    assert_eq!(before.len(), after.len());
    assert_eq!(before[..71], after[..71], "what came before the correction stays");
    assert!(before[72..].iter().zip(&after[72..]).any(|(a, b)| a != b), "what comes after is new");
    // From frame 70 on it is a run of its own: a tracker put there on the same box.
    let [l, t, w, h] = ltwh;
    let wanted = by_command_line(&format!(
        "input = '{scene}'\ntracker = 'kcf'\nfrom = 70\nboxes = [[{l:?}, {t:?}, {w:?}, {h:?}]]"
    ));
    assert_eq!(after[71..], without_times(&wanted)[1..]);
    let old = studio.get(&format!("{trial}/trajectory?version=1")).text();
    assert_eq!(without_times(&old), before);
}

#[test]
fn targets_keep_their_numbers_when_an_earlier_frame_gets_one() {
    let (studio, _root) = studio();
    let scene = "scene:drift?seed=7&duration=2";
    let trial = studio.trial(&json!({ "source": scene, "tracker": "mosse" }));
    (0..10).for_each(|_| drop(studio.order(&trial, "step")));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [100.0, 80.0, 40.0, 40.0] }));
    (0..5).for_each(|_| drop(studio.order(&trial, "step")));
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": 3 }));
    let facts = studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [60.0, 60.0, 30.0, 30.0] }));
    assert_eq!(facts["targets"], json!([2]));
    let facts = studio.follow_to_the_end(&trial);
    assert_eq!(facts["targets"], json!([1, 2]));
    let csv = studio.get(&format!("{trial}/trajectory")).text();
    let first = |target: &str| csv.lines().find(|l| l.split(',').nth(2) == Some(target)).unwrap().to_owned();
    assert!(first("1").starts_with("10,") && first("2").starts_with("3,"), "{csv}");
    let facts = studio.ok("DELETE", &format!("{trial}/targets/1"), &json!({}));
    assert_eq!(facts["targets"], json!([2]));
}

#[test]
fn other_formats_say_the_same() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": SCENE, "tracker": "kcf" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": first_box(SCENE) }));
    studio.follow_to_the_end(&trial);
    let get = |format: &str| studio.get(&format!("{trial}/trajectory?format={format}"));
    let csv = get("csv").text();
    let rows: Vec<Vec<String>> = csv.lines().skip(1).map(|l| l.split(',').map(str::to_owned).collect()).collect();
    let seen = rows.iter().filter(|r| r[3] != "lost").count();
    let coco = get("coco").json();
    assert_eq!(coco["images"].as_array().unwrap().len(), rows.len());
    assert_eq!(coco["annotations"].as_array().unwrap().len(), seen);
    let left = coco["annotations"][4]["bbox"][0].as_f64().unwrap();
    assert_eq!(format!("{left:.3}"), rows[4][4]);
    let mot = get("mot").text();
    assert_eq!(mot.lines().count(), rows.iter().filter(|r| r[3] == "tracking").count());
    let cvat = get("cvat").text();
    assert_eq!(cvat.matches("<box ").count(), rows.len());
    assert!(
        cvat.contains(&format!("frame=\"4\" outside=\"0\" occluded=\"0\" keyframe=\"0\" xtl=\"{}\"", rows[4][4])),
        "{cvat}"
    );
    let table = get("table");
    let lines: Vec<String> = table.text().lines().map(str::to_owned).collect();
    assert_eq!(lines.len(), rows.len() + 1);
    assert!(
        lines[0]
            .split_whitespace()
            .eq("frame time_s target actual_x actual_y pred_x pred_y error_px state score".split(' '))
    );
    assert_eq!(lines[5].split_whitespace().count(), 10);
    assert!(table.header("content-disposition").unwrap().contains("targets.txt"));
    assert_eq!(get("nonsense").status, 400);
}
