//! What the monitor shows of a frame beside its picture.

use crate::common::{Opened, studio};
use pursuit::imaging::{Image, Rgb8};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::time::Duration;
use tungstenite::{Message, client};

/// What a viewer who comes now is shown of this frame, looked at in this way.
fn shown(studio: &Opened, trial: &str, look: &str, frame: u64) -> (Value, Image<Rgb8>) {
    let stream = TcpStream::connect(("127.0.0.1", studio.address.port())).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let mut socket = client(format!("ws://{}{trial}/live?video=jpeg", studio.host()), stream).unwrap().0;
    loop {
        if let Message::Binary(bytes) = socket.read().unwrap() {
            let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
            let facts: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
            // What was shown to the viewer before may come first.
            if facts["look"] != look || facts["picture"]["frame"] != frame {
                continue;
            }
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("0001.jpg"), &bytes[4 + length..]).unwrap();
            let mut source = pursuit::open(folder.path().to_str().unwrap()).unwrap();
            let frame = source.next_frame().unwrap().unwrap();
            return (facts, frame.color().to_image());
        }
    }
}

fn look(studio: &Opened, trial: &str, at: &str) -> Value {
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "look", "at": at }))
}

#[test]
fn depth_is_shown_in_false_colours_where_there_is_depth() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:depth-occluder?seed=3&duration=2", "tracker": "mosse" }));
    let facts = studio.get(&trial).json();
    assert_eq!((&facts["look"], &facts["looks"]), (&json!("picture"), &json!(["picture", "depth", "foreground"])));
    let (_, picture) = shown(&studio, &trial, "picture", 0);
    assert_eq!(look(&studio, &trial, "depth")["look"], "depth");
    let (_, depth) = shown(&studio, &trial, "depth", 0);
    assert_eq!(depth.size(), picture.size());
    // What is near is red, what is far is blue; grey there is none but where nothing is known.
    let mut source = pursuit::open("scene:depth-occluder?seed=3&duration=2").unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    let mm = frame.depth_mm().unwrap();
    let places = (0..depth.height()).flat_map(|y| (0..depth.width()).map(move |x| (x, y)));
    let by_distance = |far: bool| {
        let known = places.clone().filter(|(x, y)| mm.row(*y)[*x] > 0);
        let key = |(x, y): &(usize, usize)| mm.row(*y)[*x];
        let (x, y) = if far { known.max_by_key(key).unwrap() } else { known.min_by_key(key).unwrap() };
        depth.row(y)[x]
    };
    let (near, far) = (by_distance(false), by_distance(true));
    assert!(near[0] > 150 && near[2] < 100, "near: {near:?}");
    assert!(far[2] > 150 && far[0] < 100, "far: {far:?}");
    // A step shows the next frame in the same way, and the picture comes back as it was.
    studio.order(&trial, "step");
    assert_eq!(shown(&studio, &trial, "depth", 1).0["now"]["frame"], 1);
    studio.order(&trial, "back");
    look(&studio, &trial, "picture");
    assert_eq!(shown(&studio, &trial, "picture", 0).1.as_slice(), picture.as_slice());
    let flat = studio.trial(&json!({ "source": "scene:drift?duration=1", "tracker": "mosse" }));
    assert_eq!(studio.get(&flat).json()["looks"], json!(["picture", "foreground"]));
    let body = json!({ "order": "look", "at": "depth" });
    let refused = studio.send("POST", &format!("{flat}/orders"), &body);
    assert_eq!(refused.status, 409, "{}", refused.text());
    let unknown = json!({ "order": "look", "at": "x-ray" });
    assert_eq!(studio.send("POST", &format!("{flat}/orders"), &unknown).status, 422);
}

#[test]
fn what_moves_stands_out_of_the_background() {
    let (studio, _root) = studio();
    let scene = "scene:person?seed=3&duration=6";
    let trial = studio.trial(&json!({ "source": scene, "tracker": "mosse" }));
    let info = pursuit::open(scene).unwrap().info().clone();
    let there: Vec<u64> = (70..180).filter(|frame| info.truth_at(*frame).bbox().is_some()).collect();
    look(&studio, &trial, "foreground");
    // Forward, a step on, and back to where the background must be learnt anew.
    for frame in [there[there.len() / 2], there[there.len() / 2] + 1, there[there.len() / 4]] {
        studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "seek", "frame": frame }));
        let (_, mask) = shown(&studio, &trial, "foreground", frame);
        let b = info.truth_at(frame).bbox().unwrap();
        let (mut inside, mut outside) = ([0.0, 0.0], [0.0, 0.0]);
        for y in 0..mask.height() {
            for (x, pixel) in mask.row(y).iter().enumerate() {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let within = px > b.left() && px < b.right() && py > b.top() && py < b.bottom();
                let [white, all] = if within { &mut inside } else { &mut outside };
                (*white, *all) = (*white + f64::from(u8::from(pixel[0] > 180)), *all + 1.0);
            }
        }
        let (inside, outside) = (inside[0] / inside[1], outside[0] / outside[1]);
        assert!(inside > 0.15 && inside > 8.0 * outside, "frame {frame}: {inside:.3} inside, {outside:.3} outside");
    }
}
