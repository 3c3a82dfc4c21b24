//! A detector in the studio: boxes to begin from, and runs that begin without any.

use crate::common::{studio, without_times};
use pursuit::media::OpenOptions;
use pursuit::{BBox, Run, RunConfig};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

const SCENE: &str = "scene:person?seed=3&duration=6";

/// The grey values of a scene as a clip without a truth; where its target is in each frame.
fn clip(path: &Path) -> Vec<Option<BBox>> {
    let mut source = pursuit::open(SCENE).unwrap();
    let info = source.info().clone();
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    writeln!(file, "YUV4MPEG2 W{} H{} F30:1 Ip A1:1 Cmono", info.size.width, info.size.height).unwrap();
    let mut truth = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        file.write_all(b"FRAME\n").unwrap();
        let gray = frame.gray();
        (0..info.size.height).for_each(|y| file.write_all(gray.row(y)).unwrap());
        truth.push(info.truth_at(frame.index()).bbox());
    }
    truth
}

fn boxes(proposals: &Value) -> Vec<BBox> {
    let all: Vec<[f64; 5]> = serde_json::from_value(proposals.clone()).unwrap();
    all.iter().map(|b| BBox::from_ltwh(b[0], b[1], b[2], b[3])).collect()
}

#[test]
fn its_boxes_are_shown_in_whatever_frame_is_shown() {
    let (studio, root) = studio();
    let truth = clip(&root.path().join("clip.y4m"));
    let trial = studio.trial(&json!({ "source": "clip.y4m", "tracker": "person" }));
    let facts = studio.get(&trial).json();
    assert_eq!((&facts["detector"], &facts["proposals"], &facts["seeking"]), (&Value::Null, &json!([]), &Value::Null));
    let facts = studio.ok("PUT", &format!("{trial}/detector"), &json!({ "detector": "motion" }));
    assert_eq!(facts["detector"]["name"], "motion");
    assert!(facts["detector"]["parameters"].as_object().unwrap().len() > 3, "{facts}");
    let mut overlaps = Vec::new();
    // Forward, and back to where the scene must be learnt anew.
    // It walks in; later it stands, which the scene is then thought to do.
    for frame in [100, 101, 118, 105] {
        let facts = studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": frame }));
        let there = truth[frame].unwrap();
        let best = boxes(&facts["proposals"]).iter().map(|b| b.iou(&there)).fold(0.0, f64::max);
        overlaps.push((frame, best));
    }
    // Its shadow moves too, and makes the box larger than the person.
    assert!(overlaps.iter().all(|(_, overlap)| *overlap > 0.3), "{overlaps:?}");
    // One of them is taken: it is a box like any other.
    let facts = studio.get(&trial).json();
    let first = boxes(&facts["proposals"])[0];
    let ltwh = [first.left(), first.top(), first.width(), first.height()];
    let facts = studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": ltwh }));
    assert_eq!((&facts["targets"], &facts["now"]["records"][0]["box"]), (&json!([1]), &json!(ltwh)));
    let facts = studio.ok("PUT", &format!("{trial}/detector"), &json!({ "detector": null }));
    assert_eq!((&facts["detector"], &facts["proposals"]), (&Value::Null, &json!([])));
    for (body, status) in [
        (json!({ "detector": "nobody" }), 422),
        (json!({ "detector": "motion", "parameters": { "nonsense": 1 } }), 422),
        (json!({ "detector": 7 }), 422),
    ] {
        let answer = studio.send("PUT", &format!("{trial}/detector"), &body);
        assert_eq!(answer.status, status, "{body}: {}", answer.text());
    }
}

#[test]
fn a_run_begins_without_a_box_as_that_of_the_command_line_does() {
    let (studio, root) = studio();
    let path = root.path().join("clip.y4m");
    clip(&path);
    let out = tempfile::tempdir().unwrap();
    let config = format!("input = {path:?}\ntracker = 'person'\ndetect = 'motion'\nparameters.detect.stirred = 0.3");
    let config: RunConfig = pursuit::toml::from_str(&config).unwrap();
    let config = RunConfig { out: Some(out.path().join("run")), video: Some(false), ..config };
    Run::prepare(config, &OpenOptions::default()).unwrap().run(|_| {}).unwrap();
    let wanted = std::fs::read_to_string(out.path().join("run/trajectory.csv")).unwrap();
    let found = |csv: &str| without_times(csv).into_iter().filter(|l| l.contains(",tracking,")).count();
    assert!(found(&wanted) > 60, "{wanted}");

    let trial = studio.trial(&json!({ "source": "clip.y4m", "tracker": "person" }));
    let detecting = json!({ "detector": "motion", "parameters": { "stirred": 0.3 } });
    studio.ok("PUT", &format!("{trial}/detector"), &detecting);
    (0..5).for_each(|_| drop(studio.order(&trial, "step")));
    let facts = studio.follow_to_the_end(&trial);
    assert_eq!((&facts["seeking"]["name"], &facts["targets"]), (&json!("motion"), &json!([1])));
    let csv = || without_times(&studio.get(&format!("{trial}/trajectory")).text());
    assert_eq!(csv(), without_times(&wanted));
    // The same when it is opened with it, and when it is followed again after a second target came and went.
    let opened = json!({ "source": "clip.y4m", "tracker": "person", "detector": "motion", "detector_parameters": { "stirred": 0.3 } });
    let other = studio.trial(&opened);
    studio.follow_to_the_end(&other);
    assert_eq!(without_times(&studio.get(&format!("{other}/trajectory")).text()), without_times(&wanted));
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": 170 }));
    let facts = studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [5.0, 5.0, 20.0, 20.0] }));
    assert_eq!(facts["targets"], json!([1, 2]));
    studio.ok("DELETE", &format!("{trial}/targets/2"), &json!({}));
    studio.follow_to_the_end(&trial);
    assert_eq!(csv()[..170], without_times(&wanted)[..170]);
    assert_eq!(studio.send("POST", "/api/trials", &json!({ "source": "clip.y4m", "detector": "nobody" })).status, 422);
}
