//! Heads from the command line: a program of the user's is the head.
#![cfg(unix)]

use crate::common::{fails, stderr, stdout};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

/// Long enough that nothing else looks like it.
const SECRET: &str = "hunter2-do-not-show";

/// As `crate::common::command`, where a shell can be found.
fn command(args: &[&str]) -> Command {
    let mut command = crate::common::command(args);
    command.env("PATH", "/usr/bin:/bin");
    command
}

fn pursuit(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

fn hook(log: &Path) -> String {
    format!("hook:while read -r line; do echo \"$line\" >> '{}'; done", log.display())
}

fn said(log: &Path) -> Vec<serde_json::Value> {
    let text = std::fs::read_to_string(log).unwrap();
    text.lines().map(|l| serde_json::from_str(l).unwrap()).collect()
}

#[test]
fn a_head_follows_a_target_and_is_stopped_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("log"), folder.path().join("out"));
    let head = hook(&log);
    let input = "scene:drift?seed=7&duration=3";
    let output =
        pursuit(&["ptz", "follow", input, "--tracker", "mosse", "--head", &head, "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("trajectory.csv") && out.join("run.json").is_file());
    assert!(!out.join("overlay.mp4").exists());
    let said = said(&log);
    assert!(said.iter().any(|c| c["command"] == "move"), "{said:?}");
    assert_eq!(said.last().unwrap()["command"], "stop");
}

#[test]
fn an_input_that_breaks_off_stops_the_head() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("log"), folder.path().join("out"));
    // Y4M of which the tenth frame is cut.
    let mut film = b"YUV4MPEG2 W64 H48 F25:1 Ip A1:1 C420jpeg\n".to_vec();
    for k in 0..10u32 {
        film.extend(b"FRAME\n");
        for i in 0..64 * 48 * 3 / 2u32 {
            let (x, y) = (i % 64, i / 64);
            let inside = y < 48 && (8 + 2 * k..20 + 2 * k).contains(&x) && (14..30).contains(&y);
            film.push(if inside {
                (90 + 13 * ((x - 2 * k) % 5) + 11 * (y % 4)) as u8
            } else {
                (40 + 5 * (x % 3)) as u8
            });
        }
    }
    film.truncate(film.len() - 700);
    let mut child =
        command(&["ptz", "follow", "-", "--box", "8,14,12,16", "--tracker", "mosse", "--head", &hook(&log), "--out"])
            .arg(&out)
            .stdin(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .stdout(std::process::Stdio::piped())
            .spawn()
            .unwrap();
    child.stdin.take().unwrap().write_all(&film).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert_eq!(said(&log).last().unwrap()["command"], "stop");
}

/// What a simulation says in JSON of its only run.
fn simulated(args: &[&str]) -> serde_json::Value {
    let folder = tempfile::tempdir().unwrap();
    let head = folder.path().join("head.toml");
    std::fs::write(&head, "duration_s = 5\njudged_from_s = 2\ncamera = { width = 192, height = 108 }").unwrap();
    let base = ["ptz", "simulate", "--controller", "velocity", "--json", "--head", head.to_str().unwrap()];
    let output = pursuit(&[&base[..], args].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let said: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&said["seeds"], said["runs"].as_array().unwrap().len()), (&1.into(), 1));
    said["runs"][0].clone()
}

#[test]
fn a_simulated_camera_crops_its_pictures_from_a_scene() {
    let run = simulated(&["--scene", "wide-world?seed=3&reach=30&duration=6", "--tracker", "kcf"]);
    assert_eq!(run["walk"], "wide-world?seed=3&reach=30&duration=6");
    assert!(run["shown"].as_f64().unwrap() > 0.99 && run["central"].as_f64().unwrap() > 0.8, "{run}");
    fails(&pursuit(&["ptz", "simulate", "--scene", "no-such"]), 2, &["no-such"]);
}

#[test]
fn a_simulated_run_says_its_seed_and_leaves_a_film() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("film.mp4");
    let film = film.to_str().unwrap();
    let scene =
        ["ptz", "simulate", "--scene", "wide-world?seed=3&reach=30&duration=4", "--tracker", "kcf", "--film", film];
    let output = pursuit(&[&scene[..], &["--controller", "velocity", "--first-seed", "7"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).starts_with("One run, seed 7. "), "{}", stdout(&output));
    // It is a video that is read like any other, with a picture for each that arrived within the four seconds.
    let read = pursuit(&["track", film, "--box", "300,160,20,40", "--tracker", "mosse", "--no-video", "--out", "-"]);
    let frames = stdout(&read).lines().filter(|line| line.starts_with('{')).count();
    assert!((90..=101).contains(&frames), "{frames}: {}", stderr(&read));
    fails(&pursuit(&scene), 2, &["one --controller"]);
    fails(&pursuit(&["ptz", "simulate", "--film", film]), 2, &["--scene"]);
}

#[test]
fn credentials_of_the_camera_are_kept_elsewhere_while_a_head_is_calibrated_too() {
    let calibrate = ["ptz", "calibrate", "rtsp://127.0.0.1:1/stream", "--head", "hook:true"];
    let without = pursuit(&[&calibrate[..], &["--credentials-env", "PURSUIT_NO_SUCH_VARIABLE"]].concat());
    fails(&without, 2, &["PURSUIT_NO_SUCH_VARIABLE", "USER:PASSWORD"]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("secret");
    std::fs::write(&file, "no colon\n").unwrap();
    fails(&pursuit(&[&calibrate[..], &["--credentials-file", file.to_str().unwrap()]].concat()), 2, &["first line"]);
}

#[test]
fn a_simulated_camera_crops_its_pictures_from_a_wide_clip() {
    let folder = tempfile::tempdir().unwrap();
    let mut list = "index,image,x,y,w,h\n".to_owned();
    let side = |k: u32| 60 + k;
    for k in 0..120_u32 {
        let name = format!("{k:04}.png");
        let file = std::fs::File::create(folder.path().join(&name)).unwrap();
        let mut encoder = png::Encoder::new(file, 320, 200);
        encoder.set_color(png::ColorType::Grayscale);
        let pixel = |i: u32| {
            let (x, y) = (i % 320, i / 320);
            let on = (side(k)..side(k) + 40).contains(&x) && (80..120).contains(&y);
            let (u, v) = (x.wrapping_sub(side(k)) / 8, y / 8);
            if on { (150 + 40 * ((u * 5 + v * 3) % 3)) as u8 } else { (40 + 10 * ((x / 16 + y / 16 * 3) % 5)) as u8 }
        };
        let data: Vec<u8> = (0..320 * 200).map(pixel).collect();
        encoder.write_header().unwrap().write_image_data(&data).unwrap();
        // Nobody is there at first.
        list +=
            &if k < 3 { format!("{k},{name},nan,nan,nan,nan\n") } else { format!("{k},{name},{},80,40,40\n", side(k)) };
    }
    std::fs::write(folder.path().join("frames.csv"), list).unwrap();
    let clip = folder.path().to_str().unwrap();
    let run = simulated(&["--clip", clip, "--clip-view", "100", "--tracker", "kcf"]);
    assert!(run["shown"].as_f64().unwrap() > 0.99 && run["rms_deg"].as_f64().unwrap() < 8.0, "{run}");
    std::fs::remove_file(folder.path().join("frames.csv")).unwrap();
    fails(&pursuit(&["ptz", "simulate", "--clip", clip]), 2, &["no true boxes"]);
}

/// A clip of a room through which somebody walks after a while, and its list of boxes.
fn room(folder: &std::path::Path, frames: u32, empty: u32) {
    let mut list = "index,image,x,y,w,h\n".to_owned();
    for k in 0..frames {
        let name = format!("{k:04}.png");
        let file = std::fs::File::create(folder.join(&name)).unwrap();
        let mut encoder = png::Encoder::new(file, 320, 200);
        encoder.set_color(png::ColorType::Grayscale);
        let left = (k >= empty).then(|| 100 + (k - empty) * 2);
        let pixel = |i: u32| {
            let (x, y) = (i % 320, i / 320);
            let on = left.is_some_and(|left| (left..left + 24).contains(&x) && (60..140).contains(&y));
            if on { (200 + 40 * ((y / 8) % 2)) as u8 } else { (50 + 22 * ((x / 16 + y / 12 * 3) % 5)) as u8 }
        };
        let data: Vec<u8> = (0..320 * 200).map(pixel).collect();
        encoder.write_header().unwrap().write_image_data(&data).unwrap();
        list += &left.map_or(format!("{k},{name},nan,nan,nan,nan\n"), |left| format!("{k},{name},{left},60,24,80\n"));
    }
    std::fs::write(folder.join("frames.csv"), list).unwrap();
}

#[test]
fn a_simulated_head_waits_finds_who_comes_and_follows() {
    let folder = tempfile::tempdir().unwrap();
    room(folder.path(), 150, 60);
    let clip = folder.path().to_str().unwrap();
    let found = ["--clip", clip, "--clip-view", "100", "--detect", "motion", "--set", "duration_s=30"];
    let run = simulated(&[&found[..], &["--tracker", "kcf"]].concat());
    assert!(run["walk"].as_str().unwrap().contains(" to "), "{run}");
    assert_eq!(run["before_deg"], 0.0, "{run}");
    assert!(run["shown"].as_f64().unwrap() > 0.99 && run["central"].as_f64().unwrap() > 0.8, "{run}");
    let wrong = pursuit(&[&["ptz", "simulate", "--set", "detect.hold_s=1"], &found[..4]].concat());
    fails(&wrong, 2, &["--detect motion"]);
    let unknown = ["ptz", "simulate", "--clip", clip, "--set", "judged_from_s=1", "--detect", "nobody"];
    fails(&pursuit(&unknown), 2, &["nobody"]);
}

#[test]
fn a_grid_is_printed_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let (head, map) = (folder.path().join("head.toml"), folder.path().join("map.svg"));
    std::fs::write(&head, "duration_s = 4\njudged_from_s = 2").unwrap();
    let (head, file) = (head.to_str().unwrap(), map.to_str().unwrap());
    let grid = |rest: &[&str]| {
        pursuit(
            &[&["ptz", "simulate", "--grid", "--seeds", "1", "--walk", "standing", "--head", head][..], rest].concat(),
        )
    };
    let output = grid(&["--heat-map", file]);
    let text = stdout(&output);
    assert!(output.status.success() && text.contains("of 60 are worse than unpredicted"), "{text}{}", stderr(&output));
    assert_eq!(text.lines().filter(|line| line.starts_with("standing")).count(), 60);
    assert!(std::fs::read_to_string(&map).unwrap().contains("standing, 20 % lost"));
    fails(&grid(&["--heat-map", file, "--controller", "steps"]), 2, &["name two controllers"]);
    fails(&grid(&["--heat-map", "/does/not/exist.svg"]), 1, &["heat map cannot be written"]);
}

#[test]
fn passwords_appear_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let (secret, out, log) = (folder.path().join("secret"), folder.path().join("out"), folder.path().join("log"));
    std::fs::write(&secret, format!("{SECRET}\n")).unwrap();
    let (secret, out) = (secret.to_str().unwrap(), out.to_str().unwrap());
    let show = |output: &Output| format!("{}{}", stdout(output), stderr(output));
    // In an address it is refused, without being repeated.
    for command in [
        vec!["-vv", "ptz", "probe", "onvif://admin:hunter2-do-not-show@127.0.0.1:9"],
        vec![
            "-vv",
            "ptz",
            "follow",
            "scene:drift?duration=1",
            "--out",
            out,
            "--head",
            "onvif://admin:hunter2-do-not-show@127.0.0.1:9",
        ],
    ] {
        let output = pursuit(&command);
        assert!(!output.status.success() && !show(&output).contains(SECRET), "{}", show(&output));
    }
    // By variable and by file, where the head cannot be reached or built.
    for address in ["onvif://admin@127.0.0.1:9", "visca+tcp://127.0.0.1:9"] {
        let probe = ["-vv", "ptz", "probe", address];
        let by_name = command(&probe).env("PURSUIT_PTZ_PASSWORD", SECRET).output().unwrap();
        let by_file = pursuit(&[&probe[..], &["--password-file", secret]].concat());
        for output in [by_name, by_file] {
            assert!(!output.status.success() && !show(&output).contains(SECRET), "{}", show(&output));
        }
    }
    // Nor in what a run leaves behind.
    let head = hook(&log);
    let follow =
        ["-vv", "ptz", "follow", "scene:drift?seed=7&duration=1", "--tracker", "mosse", "--out", out, "--head", &head];
    let output = command(&follow).env("PURSUIT_PTZ_PASSWORD", SECRET).output().unwrap();
    assert!(output.status.success() && !show(&output).contains(SECRET), "{}", show(&output));
    for file in std::fs::read_dir(out).unwrap() {
        let bytes = std::fs::read(file.unwrap().path()).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains(SECRET));
    }
    assert!(!std::fs::read_to_string(&log).unwrap().contains(SECRET));
}

#[test]
fn all_targets_are_followed_together_and_the_head_goes_home() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("log"), folder.path().join("out"));
    let (head, out) = (hook(&log), out.to_str().unwrap());
    let input = "scene:people?seed=2&duration=4";
    let follow = ["ptz", "follow", input, "--many", "--detect", "motion", "--head", &head, "--out", out];
    let manners = ["--set", "follower.subject=all", "--set", "follower.at_end.policy=home"];
    let output = pursuit(&[&follow[..], &manners].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let said = said(&log);
    assert!(said.iter().any(|c| c["command"] == "move"), "{said:?}");
    assert_eq!(said.last().unwrap()["command"], "home");
}

#[test]
fn zones_are_kept_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("log"), folder.path().join("out"));
    let (head, out) = (hook(&log), out.to_str().unwrap());
    let follow =
        ["ptz", "follow", "scene:drift?seed=7&duration=3", "--tracker", "mosse", "--head", &head, "--out", out];
    let with = |zone: &str| pursuit(&[&follow[..], &["--set", &format!("follower.zones=[\"{zone}\"]")]].concat());
    assert!(with("allowed pan -0.1..0.1 tilt -0.1..0.1").status.success());
    let said = said(&log);
    assert!(!said.iter().any(|c| c["command"] == "move" && c["pan_deg_s"].as_f64().unwrap().abs() > 1.0), "{said:?}");
    fails(&with("allowed yaw 1..2"), 1, &["allowed yaw 1..2", "pan -30..10"]);
}

#[test]
fn a_certificate_is_kept_of_onvifs_only() {
    let kept = |head: &str| pursuit(&["ptz", "probe", head, "--save-certificate", "/does/not/exist.pem"]);
    fails(&kept("visca://127.0.0.1"), 1, &["onvifs://"]);
    fails(&kept("onvifs://127.0.0.1:1"), 1, &[]);
}

#[test]
fn a_probe_of_nobody_fails() {
    let output = pursuit(&["ptz", "probe", "hook:/does/not/exist"]);
    assert!(output.status.code() == Some(1) && stderr(&output).contains("no such command"), "{}", stderr(&output));
    // A port of this machine at which nobody listens.
    let free = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let output = pursuit(&["ptz", "probe", &format!("visca://127.0.0.1:{free}")]);
    assert!(!output.status.success(), "{}", stdout(&output));
}

#[test]
fn what_cannot_be_followed_is_said_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let (out, params) = (folder.path().join("out"), folder.path().join("follower.toml"));
    let out = out.to_str().unwrap();
    let follow =
        |rest: &[&str]| pursuit(&[&["ptz", "follow", "scene:drift?duration=1", "--out", out][..], rest].concat());
    fails(&follow(&["--head", "nonsense"]), 1, &["scheme"]);
    fails(&follow(&["--head", "hook:true", "--field-of-view", "400"]), 1, &[]);
    std::fs::write(&params, "speed = 3").unwrap();
    fails(
        &follow(&["--head", "hook:true", "--follower", params.to_str().unwrap()]),
        1,
        &["does not say how to follow"],
    );
    fails(&follow(&["--head", "hook:true", "--password-file", "/does/not/exist"]), 1, &["password file"]);
    let output =
        pursuit(&["ptz", "calibrate", "scene:drift?duration=1", "--head", "hook:while read -r line; do :; done"]);
    fails(&output, 1, &["ended before the head was measured"]);
}

#[test]
fn a_simulated_head_hangs_below_a_drone() {
    let simulate = |more: &[&str]| pursuit(&[&["ptz", "simulate", "--seeds", "2", "--json"], more].concat());
    let output = simulate(&["--drone", "--controller", "velocity,proportional", "--set", "drone.altitude_m=30"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let walks: Vec<_> = said["runs"].as_array().unwrap().iter().map(|run| run["walk"].as_str().unwrap()).collect();
    assert_eq!(walks.len(), 14);
    assert!(walks.contains(&"hiding") && walks.contains(&"crossing"));
    let standing = simulate(&["--walk", "standing", "--controller", "velocity"]);
    assert!(stdout(&standing).contains("\"overshoot\": 0"), "without a drone it is measured");
    let orbit = simulate(&["--walk", "standing", "--controller", "velocity", "--set", "drone.flight=orbit"]);
    assert!(stdout(&orbit).contains("\"overshoot\": null"), "before a camera that moves nothing stands");
    fails(&simulate(&["--set", "drone.altitude_m=1"]), 1, &["altitude_m"]);
    fails(&simulate(&["--set", "drone.flight=dive"]), 1, &["`hover`, `transit`, `orbit`", "drone.flight"]);
    fails(&simulate(&["--set", "drone.altitude_m=9", "--scene", "wide-world"]), 2, &["--scene"]);
}
