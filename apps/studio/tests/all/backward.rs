//! Following backward from a box that was put right.

use crate::common::{Opened, studio};
use pursuit::BBox;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// 300 frames, in which the target passes behind something once.
const SCENE: &str = "scene:occluding-bar?seed=3&duration=10&speed=60";

fn truth() -> Vec<Option<BBox>> {
    let source = pursuit::open(SCENE).unwrap();
    (0..300).map(|frame| source.info().truth_at(frame).bbox()).collect()
}

fn ltwh(b: BBox) -> [f64; 4] {
    [b.left(), b.top(), b.width(), b.height()]
}

fn overlap(row: &Value, truth: BBox) -> f64 {
    let b: [f64; 4] = serde_json::from_value(row[2][0][3].clone()).unwrap();
    BBox::from_ltwh(b[0], b[1], b[2], b[3]).iou(&truth)
}

fn until_back(studio: &Opened, trial: &str) -> Value {
    let began = Instant::now();
    loop {
        let facts = studio.get(trial).json();
        if !facts["backward"]["end"].is_null() {
            return facts;
        }
        assert!(began.elapsed() < Duration::from_secs(60), "{facts}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

struct Annotated {
    rows: Vec<Value>,
    truth: Vec<Option<BBox>>,
}

impl Annotated {
    fn of(studio: &Opened, trial: &str) -> Self {
        let rows = studio.get(&format!("{trial}/rows")).json()["rows"].as_array().unwrap().clone();
        Self { rows, truth: truth() }
    }

    /// Whether the box of this frame is right; none where the target is not to be seen.
    fn is_right(&self, frame: usize) -> Option<bool> {
        self.truth[frame].map(|truth| overlap(&self.rows[frame], truth) > 0.5)
    }

    fn wrong(&self) -> Vec<usize> {
        (0..self.rows.len()).filter(|frame| self.is_right(*frame) == Some(false)).collect()
    }
}

fn begin(studio: &Opened, parameters: &Value) -> String {
    let trial = studio.trial(&json!({ "source": SCENE, "tracker": "mosse", "parameters": parameters }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": ltwh(truth()[0].unwrap()) }));
    studio.follow_to_the_end(&trial);
    trial
}

/// Puts the target where it is in this frame, and waits until that was followed backward.
fn put_right(studio: &Opened, trial: &str, frame: usize) -> Value {
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": frame }));
    let body = json!({ "box": ltwh(truth()[frame].unwrap()), "backward": true });
    studio.ok("PUT", &format!("{trial}/targets/1"), &body);
    until_back(studio, trial)
}

#[test]
fn a_clip_with_one_loss_takes_two_boxes() {
    let (studio, _root) = studio();
    let trial = begin(&studio, &json!({}));
    let before = Annotated::of(&studio, &trial);
    let wrong = before.wrong();
    assert!(before.rows.len() == 300 && wrong.len() > 30, "{wrong:?}");
    // Somewhere in the stretch that is wrong, as one comes upon it.
    let frame = wrong[wrong.len() * 2 / 3];
    let facts = put_right(&studio, &trial, frame);
    let back = &facts["backward"];
    let to = back["to"].as_u64().unwrap() as usize;
    assert_eq!((back["target"].as_u64(), back["from"].as_u64()), (Some(1), Some(frame as u64)));
    assert!((&facts["now"]["frame"], &facts["head"]) == (&json!(frame), &json!(frame)) && facts["phase"] == "paused");
    studio.follow_to_the_end(&trial);
    let after = Annotated::of(&studio, &trial);
    assert_eq!(after.rows.len(), 300);
    let left = after.wrong();
    assert!(left.len() <= 8, "wrong before: {wrong:?}; after: {left:?}; {back}");
    // It says which frames came backward, and nothing before them has changed.
    for (row, old) in after.rows.iter().zip(&before.rows) {
        let frame_of = row[0].as_u64().unwrap() as usize;
        assert_eq!(row[2][0][5], json!((to..frame).contains(&frame_of)), "{row}");
        if frame_of < to {
            assert_eq!(row, old);
        }
    }
    let rows = studio.get(&format!("{trial}/rows")).json();
    assert_eq!(rows["backward"], json!([[1, to, frame - 1]]));
    let old = studio.get(&format!("{trial}/rows?version=1")).json();
    assert_eq!(
        (&old["backward"], old["rows"].as_array()),
        (&json!([]), Some(&before.rows)),
        "the version before is kept"
    );
    // Every export contains it.
    let shown = (to + frame) / 2;
    let b: [f64; 4] = serde_json::from_value(after.rows[shown][2][0][3].clone()).unwrap();
    let get = |format: &str| studio.get(&format!("{trial}/trajectory?format={format}")).text();
    assert!(get("csv").contains(&format!(",{:.3},{:.3},", b[0], b[1])));
    assert!(get("cvat").contains(&format!("xtl=\"{:.3}\" ytl=\"{:.3}\"", b[0], b[1])));
    let coco: Value = serde_json::from_str(&get("coco")).unwrap();
    let backward = coco["annotations"].as_array().unwrap().iter().filter(|a| a["attributes"]["backward"] == true);
    assert!(backward.count() > (frame - to) / 2);
}

#[test]
fn it_is_followed_backward_again_whenever_it_is_followed_again() {
    let (studio, _root) = studio();
    let trial = begin(&studio, &json!({}));
    let wrong = Annotated::of(&studio, &trial).wrong();
    put_right(&studio, &trial, wrong[wrong.len() / 2]);
    studio.follow_to_the_end(&trial);
    let first = Annotated::of(&studio, &trial).rows;
    // Another target in an early frame: everything after it is followed again.
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": 2 }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [10.0, 10.0, 30.0, 30.0] }));
    studio.follow_to_the_end(&trial);
    let again = Annotated::of(&studio, &trial).rows;
    let of_first = |rows: &[Value]| rows.iter().map(|row| row[2][0].clone()).collect::<Vec<_>>();
    assert_eq!(of_first(&first), of_first(&again));
}

#[test]
fn it_is_broken_off_by_other_orders_and_makes_start_wait() {
    let (studio, _root) = studio();
    let trial = begin(&studio, &json!({}));
    let wrong = Annotated::of(&studio, &trial).wrong();
    let frame = *wrong.last().unwrap();
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": frame }));
    let body = json!({ "box": ltwh(truth()[frame].unwrap()), "backward": true });
    studio.ok("PUT", &format!("{trial}/targets/1"), &body);
    let facts = studio.order(&trial, "pause");
    assert_eq!((&facts["phase"], &facts["now"]["frame"]), (&json!("paused"), &json!(frame)));
    assert!(!facts["backward"]["end"].is_null(), "{facts}");
    // Nothing is left to be found: what is there is met, or the same is gone over again.
    studio.ok("PUT", &format!("{trial}/targets/1"), &body);
    studio.order(&trial, "start");
    let began = Instant::now();
    while studio.get(&trial).json()["phase"] != "ended" {
        assert!(began.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
    let facts = studio.get(&trial).json();
    assert!(facts["backward"]["end"] != "stopped" && facts["head"] == 299, "{facts}");
    let unknown = studio.send("PUT", &format!("{trial}/targets/7"), &body);
    assert_eq!(unknown.status, 404, "{}", unknown.text());
}
