//! The camera of a drone from the command line, without any drone: what ground stations see is tested by `cargo xtask peers drones`.
#![cfg(feature = "mavlink")]

use crate::common::{command, fails, stderr, stdout};
use std::net::UdpSocket;
use std::process::Output;

const SCENE: &str = "scene:drift?seed=7&duration=1";

fn mavlink(args: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    command(&[&["mavlink", "--out", out.to_str().unwrap()], args].concat()).output().unwrap()
}

fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

#[test]
fn nothing_is_tracked_until_somebody_says_what() {
    let link = format!("udpin:127.0.0.1:{}", free_port());
    let output = mavlink(&[SCENE, "--link", &link, "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&said["recipe"]["start"], said["frame_count"].as_u64()), (&"command".into(), Some(30)));
    assert_eq!(said["states"]["tracking"].as_u64(), Some(0));
    assert_eq!(said["links"][0]["link"].as_str(), Some(&*link));
    assert_eq!(said["timing"]["latency_ms"]["count"].as_u64(), Some(30));
}

#[test]
fn a_box_is_tracked_at_once_and_said_to_who_listens() {
    let station = UdpSocket::bind("127.0.0.1:0").unwrap();
    let link = format!("udpout:{}", station.local_addr().unwrap());
    // At the pace of a camera, so that a busy machine has the time to send all of it.
    let scene = [SCENE, "--real-time", "--link", &link, "--box", "145.5,105.5,30,30", "--camera-view", "60"];
    let output = mavlink(&scene);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("latency") && stdout(&output).contains(&link), "{}", stdout(&output));
    let mut messages = Vec::new();
    station.set_nonblocking(true).unwrap();
    let mut bytes = [0; 400];
    while let Ok(count) = station.recv(&mut bytes) {
        messages.push((u32::from_le_bytes([bytes[7], bytes[8], bytes[9], 0]), bytes[..count].to_vec()));
    }
    // Zeros at the end are not sent: the status stands behind seven numbers, and that nothing is tracked is 0.
    let status = |message: &[u8]| if message[1] > 28 { message[10 + 28] } else { 0 };
    let said: Vec<u8> = messages.iter().filter(|(id, _)| *id == 275).map(|(_, message)| status(message)).collect();
    assert!(messages.iter().any(|(id, _)| *id == 0), "it says that it is there");
    assert!(said.contains(&1), "{said:?}");
    assert_eq!(said.last(), Some(&0), "nothing is tracked any more");
}

#[test]
fn who_is_waited_for_is_said() {
    let (link, folder) = (format!("udpin:127.0.0.1:{}", free_port()), tempfile::tempdir().unwrap());
    let out = folder.path().join("out");
    let args = ["mavlink", "scene:drift?seed=7&duration=6", "--real-time", "--no-video", "--link", &link];
    let said = stderr(&command(&args).arg("--out").arg(&out).output().unwrap());
    let waits = format!("no ground station and no vehicle heard yet: waiting on {link}");
    assert!(said.contains(&waits) && said.contains("until a ground station says what"), "{said}");
    let said = stderr(&command(&args).args(["--quiet", "--out"]).arg(folder.path().join("quiet")).output().unwrap());
    assert!(!said.contains("waiting"), "{said}");
}

#[test]
fn wrong_uses_say_what_would_do() {
    let link = format!("udpin:127.0.0.1:{}", free_port());
    for (args, says) in [
        (&[SCENE, "--link", "ftp:nowhere"][..], "udpin:HOST:PORT"),
        (&[SCENE], "--link"),
        (&[SCENE, "--link", &link, "--gimbal"], "--camera-view"),
    ] {
        let output = mavlink(args);
        assert!(output.status.code() == Some(2) && stderr(&output).contains(says), "{}", stderr(&output));
    }
    fails(&mavlink(&[SCENE, "--link", &link, "--camera-view", "200"]), 2, &["between 1° and 170°"]);
    fails(&mavlink(&[SCENE, "--link", &link, "--gimbal", "--camera-view", "60"]), 1, &["no gimbal manager answered"]);
    fails(&mavlink(&[SCENE, SCENE, "--link", &link]), 2, &["no more than one"]);
    fails(&mavlink(&[SCENE, "--link", &link, "--signing-key-file", "/nowhere"]), 1, &["/nowhere"]);
    fails(&mavlink(&[SCENE, "--link", &link, "--start", "command", "--box", "1,2,30,40"]), 2, &["--start command"]);
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let link = format!("udpin:{}", taken.local_addr().unwrap());
    fails(&mavlink(&[SCENE, "--link", &link]), 4, &["opening the link"]);
}
