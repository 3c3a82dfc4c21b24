//! What viewers are shown, and that nobody who looks can hold the tracker up.

use crate::common::{Opened, studio};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket, client};

type Socket = WebSocket<TcpStream>;

fn look(studio: &Opened, trial: &str) -> Socket {
    look_as(studio, trial, "jpeg")
}

fn look_as(studio: &Opened, trial: &str, video: &str) -> Socket {
    let stream = TcpStream::connect(("127.0.0.1", studio.address.port())).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    client(format!("ws://{}{trial}/live?video={video}", studio.host()), stream).unwrap().0
}

/// The next message: facts and JPEG; `None` at the end.
fn next(socket: &mut Socket) -> Option<(Value, Vec<u8>)> {
    loop {
        match socket.read() {
            Ok(Message::Binary(bytes)) => {
                let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                let facts = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
                return Some((facts, bytes[4 + length..].to_vec()));
            }
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}

/// Messages up to the first of which this holds.
fn until(socket: &mut Socket, holds: impl Fn(&Value) -> bool) -> (Value, Vec<u8>) {
    loop {
        let (facts, jpeg) = next(socket).expect("the connection to stay");
        if holds(&facts) {
            return (facts, jpeg);
        }
    }
}

#[test]
fn a_viewer_sees_picture_and_boxes_at_once_and_after_every_step() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?seed=7&duration=2", "tracker": "mosse" }));
    let truth = studio.get(&trial).json()["now"]["truth"].clone();
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": truth }));
    // Nothing moves when this one comes.
    let mut socket = look(&studio, &trial);
    let (facts, jpeg) = until(&mut socket, |_| true);
    assert_eq!((facts["now"]["frame"].as_u64(), facts["targets"].clone()), (Some(0), json!([1])));
    assert!(jpeg.starts_with(&[0xff, 0xd8]) && jpeg.ends_with(&[0xff, 0xd9]), "{} bytes", jpeg.len());
    studio.order(&trial, "step");
    let (facts, _) = until(&mut socket, |f| f["now"]["frame"] == 1);
    let record = &facts["now"]["records"][0];
    assert_eq!(record["state"], "tracking");
    for part in ["box", "predicted", "measured", "searched"] {
        assert_eq!(record[part].as_array().map(Vec::len), Some(4), "{part}: {record}");
    }
    assert_eq!(record["covariance"].as_array().map(Vec::len), Some(3));
    assert!(record["error_px"].as_f64().unwrap() < 5.0 && !record["why"].as_object().unwrap().is_empty());
    studio.ok("DELETE", &trial, &json!({}));
    while next(&mut socket).is_some() {}
}

#[test]
fn viewers_that_stand_still_hold_nobody_up() {
    let (studio, _root) = studio();
    let scene = "scene:drift?seed=7&duration=10";
    let trial = studio.trial(&json!({ "source": scene, "tracker": "mosse" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [145.5, 105.5, 30.0, 30.0] }));
    let kind = |i: usize| if i.is_multiple_of(2) { "h264" } else { "jpeg" };
    let _stalled: Vec<Socket> = (0..6).map(|i| look_as(&studio, &trial, kind(i))).collect();
    let mut awake: Vec<Socket> = (0..4).map(|i| look_as(&studio, &trial, kind(i))).collect();
    let watching = std::thread::spawn(move || {
        for socket in &mut awake {
            let (facts, _) = until(socket, |f| f["phase"] == "ended");
            assert_eq!(facts["now"]["frame"], facts["head"]);
        }
    });
    let facts = studio.follow_to_the_end(&trial);
    assert_eq!(facts["head"], 299);
    watching.join().unwrap();
    let csv = studio.get(&format!("{trial}/trajectory")).text();
    assert_eq!(csv.lines().count(), 301, "no frame was left out for anybody");
}

#[test]
fn while_it_runs_the_picture_is_video_that_begins_with_a_key_frame_and_stands_still_as_jpeg() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?seed=7&duration=4", "tracker": "mosse" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [145.5, 105.5, 30.0, 30.0] }));
    let mut first = look_as(&studio, &trial, "h264");
    let (facts, still) = next(&mut first).unwrap();
    assert_eq!((facts["picture"]["kind"].as_str(), &still[..2]), (Some("jpeg"), &[0xff, 0xd8][..]));
    studio.order(&trial, "start");
    let (mut stills, mut late) = (look(&studio, &trial), None);
    let (mut pictures, mut begun, mut bytes) = (0, false, 0);
    loop {
        let (facts, data) = next(&mut first).unwrap();
        let about = &facts["picture"];
        match about["kind"].as_str().unwrap() {
            "h264" => {
                assert!(data.starts_with(&[0, 0, 0, 1]), "{:?}", &data[..8]);
                assert!(begun || about["key"] == true, "a beginning that is none: {about}");
                assert_eq!((&about["frame"], &about["time_s"]), (&facts["now"]["frame"], &facts["now"]["time_s"]));
                assert_eq!((about["width"].as_u64(), about["height"].as_u64()), (Some(320), Some(240)));
                assert!(about["codec"].as_str().unwrap().starts_with("avc1."), "{about}");
                begun = true;
                pictures += 1;
                bytes += data.len();
            }
            "none" => assert!(begun && data.is_empty()),
            _ if facts["phase"] == "ended" => break,
            kind => assert!(!begun && kind == "jpeg", "{about}"),
        }
        if pictures == 20 && late.is_none() {
            let mut socket = look_as(&studio, &trial, "h264");
            let (facts, data) = next(&mut socket).unwrap();
            assert_eq!((facts["picture"]["key"].as_bool(), data[4] & 31), (Some(true), 7), "{}", facts["picture"]);
            late = Some(socket);
        }
    }
    assert!(pictures > 30, "{pictures} pictures");
    assert!(bytes < pictures * still.len(), "{bytes} bytes of {pictures} pictures, a JPEG has {}", still.len());
    // Who cannot decode it is shown the same run.
    let (facts, jpeg) = until(&mut stills, |f| f["phase"] == "ended");
    assert_eq!((facts["picture"]["kind"].as_str(), jpeg.starts_with(&[0xff, 0xd8])), (Some("jpeg"), true));
    let mut late = late.unwrap();
    let (facts, _) = until(&mut late, |f| f["phase"] == "ended");
    assert_eq!(facts["picture"]["kind"], "jpeg");
    let handshake = [
        ("Connection", "Upgrade"),
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    assert_eq!(studio.request("GET", &format!("{trial}/live?video=vhs"), &handshake, b"").status, 400);
}

#[test]
fn at_the_input_s_own_pace_a_run_takes_as_long_as_the_input() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?seed=7&duration=1.5", "tracker": "mosse" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [145.5, 105.5, 30.0, 30.0] }));
    let mut socket = look(&studio, &trial);
    let began = Instant::now();
    studio.order(&trial, "start");
    until(&mut socket, |f| f["phase"] == "ended");
    // Never faster; how much slower depends on the machine.
    assert!(began.elapsed() > Duration::from_secs_f64(1.3), "{:?}", began.elapsed());
}

#[test]
fn the_time_line_comes_in_parts_and_pictures_one_by_one() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:static?duration=90", "tracker": "mosse" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [100.0, 80.0, 40.0, 40.0] }));
    studio.follow_to_the_end(&trial);
    let first = studio.get(&format!("{trial}/rows")).json();
    assert_eq!((first["rows"].as_array().unwrap().len(), first["next"].as_u64()), (2000, Some(2000)));
    let second = studio.get(&format!("{trial}/rows?from=2000")).json();
    assert_eq!((second["rows"].as_array().unwrap().len(), second["next"].clone()), (700, Value::Null));
    let [frame, time, records] = second["rows"][0].as_array().unwrap().as_slice() else { panic!("{second}") };
    assert_eq!((frame.as_u64(), time.as_f64().map(|t| (t * 30.0).round())), (Some(2000), Some(2000.0)));
    assert_eq!(records[0][0], 1);
    let picture = studio.get(&format!("{trial}/picture?frame=5"));
    assert_eq!((picture.status, picture.header("content-type").as_deref()), (200, Some("image/jpeg")));
    assert_eq!(studio.get(&format!("{trial}/picture?frame=2700")).status, 404);
}

#[test]
fn trackers_and_counts_are_told() {
    let (studio, _root) = studio();
    studio.trial(&json!({ "source": "scene:drift?duration=1", "tracker": "mosse" }));
    let catalogue = studio.get("/api/trackers").json();
    let names = catalogue["trackers"].as_array().unwrap().len();
    assert_eq!(names, pursuit::trackers::registry::trackers().len());
    let metrics = studio.get("/metrics").text();
    assert!(metrics.contains("\npursuit_studio_trials 1\n"), "{metrics}");
}
