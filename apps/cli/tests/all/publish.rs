//! `pursuit track --publish …`, heard by somebody else's client of somebody else's broker.
#![cfg(feature = "mqtt")]

use crate::broker::{Mosquitto, free_port};
use crate::common::{command, fails, rows, stderr, stdout};
use serde_json::Value;
use std::path::Path;
use std::process::{Output, Stdio};

/// Follows the target of a scene of 30 frames; what it writes goes to `out`.
fn track(out: &Path, more: &[&str]) -> Output {
    track_for(1, out, more)
}

fn track_for(seconds: u32, out: &Path, more: &[&str]) -> Output {
    let scene = format!("scene:drift?seed=7&duration={seconds}");
    command(&["track", &scene, "--tracker", "mosse", "--no-video", "--out"]).arg(out).args(more).output().unwrap()
}

fn run_json(out: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(out.join("run.json")).unwrap()).unwrap()
}

fn all_json(texts: Vec<String>) -> Vec<Value> {
    texts.iter().map(|text| serde_json::from_str(text).unwrap()).collect()
}

#[test]
fn every_frame_is_heard_as_it_was_written() {
    let Some(mosquitto) = Mosquitto::open() else { return };
    let listener = mosquitto.listen(&[]);
    let folder = tempfile::tempdir().unwrap();
    let output = track(folder.path(), &["--publish", &format!("mqtt://127.0.0.1:{}/yard/1", mosquitto.port)]);
    assert!(output.status.success(), "{}", stderr(&output));
    listener.wait_for("yard/1/status", "offline");
    let frames = all_json(listener.under("yard/1/targets/1/frame"));
    let rows = rows(&folder.path().join("trajectory.csv"));
    assert_eq!(frames.len(), rows.len());
    for (frame, row) in frames.iter().zip(&rows) {
        assert_eq!(frame["schema"], "pursuit.target/1");
        assert_eq!(frame["frame"].to_string(), row["frame"]);
        assert_eq!(frame["state"], row["state"].as_str());
        let x: f64 = row["x"].parse().unwrap();
        assert!((frame["box"][0].as_f64().unwrap() - x).abs() < 1e-3, "{frame}");
    }
    let mut states = listener.under("yard/1/targets/1/state");
    assert_eq!(states.pop().unwrap(), "", "the broker is made to forget");
    let states = all_json(states);
    assert_eq!((&states.last().unwrap()["state"], &states.last().unwrap()["present"]), (&"gone".into(), &false.into()));
    assert_eq!((&states[0]["state"], &states[0]["previous"]), (&"tracking".into(), &Value::Null));
    // Somebody who comes later hears what was retained.
    let late = mosquitto.listen(&[]);
    late.wait_for("yard/1/status", "offline");
    let about = all_json(late.under("yard/1/run"));
    assert_eq!((&about[0]["schema"], &about[0]["tracker"]), (&"pursuit.run/1".into(), &"mosse".into()));
    assert!(late.under("yard/1/targets/1/state").is_empty(), "nothing haunts");
    assert_eq!(all_json(late.under("yard/1/present"))[0]["targets"], serde_json::json!([]));
    let published = &run_json(folder.path())["publish"];
    assert_eq!((&published["dropped"], &published["connections"]), (&0.into(), &1.into()));
    assert!(stdout(&output).contains("0 dropped"), "{}", stdout(&output));
}

#[test]
fn what_happens_and_who_is_where_is_heard() {
    let Some(mosquitto) = Mosquitto::open() else { return };
    let listener = mosquitto.listen(&[]);
    let folder = tempfile::tempdir().unwrap();
    let broker = format!("mqtt://127.0.0.1:{}/yard/1", mosquitto.port);
    let zone = "door=0,0,2000,0,2000,2000,0,2000";
    // A target appears, and enters a zone, once it has been seen for half a second each.
    let output = track_for(2, folder.path(), &["--publish", &broker, "--zone", zone]);
    assert!(output.status.success(), "{}", stderr(&output));
    listener.wait_for("yard/1/status", "offline");
    let events = all_json(listener.under("yard/1/events"));
    let told: Vec<&str> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert!(told.contains(&"appear") && told.contains(&"enter"), "{told:?}");
    let written = std::fs::read_to_string(folder.path().join("events.jsonl")).unwrap();
    assert_eq!(events, all_json(written.lines().map(str::to_owned).collect()));
    let mut counts = listener.under("yard/1/zones/door");
    assert_eq!(counts.pop().unwrap(), "", "the broker is made to forget");
    let counts = all_json(counts);
    assert_eq!((&counts[0]["schema"], &counts[0]["count"]), (&"pursuit.counts/1".into(), &0.into()));
    assert!(counts.iter().any(|count| count["present"] == true && count["targets"] == serde_json::json!([1])));
    assert!(!listener.under("yard/1/counts").is_empty());
}

#[test]
fn home_assistant_is_told_what_there_is_and_changes_alone_can_be_published() {
    let Some(mosquitto) = Mosquitto::open() else { return };
    let listener = mosquitto.listen(&[]);
    let folder = tempfile::tempdir().unwrap();
    let address = format!("mqtt://127.0.0.1:{}", mosquitto.port);
    let more = ["--publish", &address, "--publish-every", "state", "--publish-discovery", "homeassistant"];
    let output = track(folder.path(), &more);
    assert!(output.status.success(), "{}", stderr(&output));
    // No prefix was given: it is made of the input's name.
    let prefix = "pursuit/scene-drift-seed-7-duration-1";
    assert_eq!(run_json(folder.path())["publish"]["prefix"], prefix);
    listener.wait_for(&format!("{prefix}/status"), "offline");
    let heard = listener.heard();
    assert!(heard.iter().all(|h| !h.topic.ends_with("/frame")), "{heard:?}");
    let topic =
        |kind: &str, what: &str| format!("homeassistant/{kind}/pursuit_scene-drift-seed-7-duration-1/{what}/config");
    let present = all_json(listener.under(&topic("binary_sensor", "present"))).pop().unwrap();
    // What the template makes of the messages under the topic is what Home Assistant shows.
    assert_eq!(present["value_template"], "{{ 'ON' if value_json.count > 0 else 'OFF' }}");
    let mut counts = listener.under(present["state_topic"].as_str().unwrap());
    assert_eq!(counts.pop().unwrap(), "", "the broker is made to forget");
    let counts: Vec<u64> = all_json(counts).iter().map(|count| count["count"].as_u64().unwrap()).collect();
    assert_eq!(counts, [0, 1], "it counts once it has been seen for a while");
    assert_eq!(present["availability_topic"], format!("{prefix}/status"));
    let image = all_json(listener.under(&topic("image", "last_event"))).pop().unwrap();
    let pictures = listener.under(image["image_topic"].as_str().unwrap());
    assert!(pictures.len() == 1 && pictures[0].contains("JFIF"), "of who appeared");
    // What there is does not change with the targets.
    let discovered = heard.iter().filter(|h| h.topic.starts_with("homeassistant/")).map(|h| &h.topic);
    assert_eq!(discovered.collect::<std::collections::BTreeSet<_>>().len(), 4);
    assert_eq!(all_json(listener.under(&format!("{prefix}/present")))[0]["targets"], serde_json::json!([1]));
    assert_eq!(run_json(folder.path())["publish"]["every"], "state");
}

#[test]
fn passwords_come_from_elsewhere_and_are_shown_nowhere() {
    let Some(mosquitto) = Mosquitto::with_password() else { return };
    let folder = tempfile::tempdir().unwrap();
    let address = format!("mqtt://me@127.0.0.1:{}", mosquitto.port);
    let with = |name: &str, address: &str, password: &str| {
        let args = ["track", "scene:drift?seed=7&duration=1", "--tracker", "mosse", "--no-video", "-vv", "--out"];
        let mut command = command(&args);
        command.arg(folder.path().join(name)).args(["--publish", address]).env("PURSUIT_PUBLISH_PASSWORD", password);
        command.output().unwrap()
    };
    let right = with("right", &address, "sesame");
    assert!(right.status.success(), "{}", stderr(&right));
    assert_eq!(run_json(&folder.path().join("right"))["publish"]["dropped"], 0);
    let inside = with("inside", &address.replace("me@", "me:sesame@"), "unused-one");
    assert!(inside.status.success(), "{}", stderr(&inside));
    let wrong = with("wrong", &address, "wrong-secret");
    assert_eq!(wrong.status.code(), Some(4), "{}", stderr(&wrong));
    let said = stderr(&wrong);
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error")).collect();
    assert!(errors.len() == 1 && errors[0].contains("does not accept the user or the password"), "{said}");
    for (name, output) in [("right", right), ("inside", inside), ("wrong", wrong)] {
        let kept = std::fs::read_to_string(folder.path().join(name).join("run.json")).unwrap();
        for text in [kept, stderr(&output), stdout(&output)] {
            assert!(!text.contains("sesame") && !text.contains("secret") && !text.contains("unused-one"), "{text}");
        }
    }
}

#[test]
fn a_broker_that_is_not_there_holds_nothing_up() {
    let folder = tempfile::tempdir().unwrap();
    let output = track(folder.path(), &["--publish", &format!("mqtt://127.0.0.1:{}", free_port())]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output).lines().filter(|line| line.contains("messages wait")).count(), 1, "{}", stderr(&output));
    let published = &run_json(folder.path())["publish"];
    assert_eq!((&published["dropped"], &published["connections"]), (&published["messages"], &0.into()));
    assert!(stdout(&output).contains("0 sent to mqtt://127.0.0.1"), "{}", stdout(&output));
    assert!(stderr(&output).contains("messages were dropped"), "{}", stderr(&output));
}

#[test]
fn nothing_of_former_versions_and_zones_haunts_home_assistant() {
    let Some(mosquitto) = Mosquitto::open() else { return };
    let config = |kind: &str, what: &str| format!("homeassistant/{kind}/yard_1/{what}/config");
    let listens = |to: &str| format!("{{\"name\":\"x\",\"state_topic\":\"{to}\"}}");
    // Version 0.1 told of every target by four entities, and of who is present by another.
    for n in 1..=9 {
        let state = listens(&format!("yard/1/targets/{n}/state"));
        mosquitto.leave(&config("binary_sensor", &format!("target_{n}")), &state);
        for what in ["x", "y", "score"] {
            let frame = listens(&format!("yard/1/targets/{n}/frame"));
            mosquitto.leave(&config("sensor", &format!("target_{n}_{what}")), &frame);
        }
        mosquitto.leave(&format!("yard/1/targets/{n}/state"), "{\"present\":true}");
    }
    mosquitto.leave(&config("sensor", "present"), &listens("yard/1/present"));
    // A zone that is no more, one that still is, a class; and a neighbour whose prefix has the same name there.
    mosquitto.leave("yard/1/zones/gate", "{\"present\":true}");
    mosquitto.leave(&config("binary_sensor", "gate_present"), &listens("yard/1/zones/gate"));
    mosquitto.leave(&config("binary_sensor", "door_person_present"), &listens("yard/1/zones/door"));
    mosquitto.leave(&config("sensor", "person_count"), &listens("yard/1/counts"));
    mosquitto.leave(&config("binary_sensor", "target_77"), &listens("yard_1/targets/77/state"));
    let folder = tempfile::tempdir().unwrap();
    let broker = format!("mqtt://127.0.0.1:{}/yard/1", mosquitto.port);
    let zone = "door=0,0,2000,0,2000,2000,0,2000";
    let more = ["--publish", &broker, "--publish-discovery", "homeassistant", "--zone", zone];
    let output = track_for(2, folder.path(), &more);
    assert!(output.status.success(), "{}", stderr(&output));
    let fresh = mosquitto.listen(&[]);
    fresh.wait_for("yard/1/status", "offline");
    let heard = fresh.heard();
    let mut left: Vec<&str> = heard.iter().map(|heard| &*heard.topic).collect();
    left.sort_unstable();
    let mut stays: Vec<String> = ["present", "picture", "run", "status"].map(|what| format!("yard/1/{what}")).into();
    for what in ["present", "door_present", "door_person_present", "target_77"] {
        stays.push(config("binary_sensor", what));
    }
    for what in ["count", "door_count", "person_count"] {
        stays.push(config("sensor", what));
    }
    stays.push(config("image", "last_event"));
    stays.sort_unstable();
    assert_eq!(left, stays);
    assert_eq!(all_json(fresh.under("yard/1/present"))[0]["targets"], serde_json::json!([]));
}

#[test]
#[cfg(unix)]
fn the_broker_says_when_a_watcher_died() {
    let Some(mosquitto) = Mosquitto::open() else { return };
    let listener = mosquitto.listen(&[]);
    let folder = tempfile::tempdir().unwrap();
    let args = ["track", "scene:drift?seed=7&duration=200", "--tracker", "mosse", "--no-video", "--publish"];
    let mut command = command(&args);
    command.arg(format!("mqtt://127.0.0.1:{}/p", mosquitto.port)).arg("--out").arg(folder.path());
    let mut watcher = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    crate::broker::wait_until("frames", || listener.under("p/targets/1/frame").len() > 3);
    assert_eq!(listener.under("p/status"), ["online"]);
    watcher.kill().unwrap();
    watcher.wait().unwrap();
    listener.wait_for("p/status", "offline");
    // What it left is cleared by the next run, whose one target takes another's place.
    let next = track(&folder.path().join("next"), &["--publish", &format!("mqtt://127.0.0.1:{}/p", mosquitto.port)]);
    assert!(next.status.success(), "{}", stderr(&next));
    let fresh = mosquitto.listen(&[]);
    fresh.wait_for("p/status", "offline");
    assert!(fresh.heard().iter().all(|h| !h.topic.starts_with("p/targets/")), "{:?}", fresh.heard());
}

#[test]
fn what_cannot_be_published_to_is_said_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (more, words) in [
        (vec!["--publish", "http://house"], vec!["kind `http`", "mqtt://"]),
        (vec!["--publish", "mqtt://"], vec!["no host"]),
        (vec!["--publish", "mqtt://house/a/#"], vec!["`#`"]),
        (vec!["--publish", "mqtt://house", "--publish-buffer", "0"], vec!["1 to"]),
        (vec!["--publish", "mqtt://me:sesame@house/+"], vec!["`+`"]),
    ] {
        let output = track(&out, &more);
        fails(&output, 2, &words);
        assert!(!out.exists() && !stderr(&output).contains("sesame"), "{}", stderr(&output));
    }
    for more in [["--publish-every", "often"], ["--publish-qos", "3"], ["--publish-discovery", "domoticz"]] {
        assert_eq!(track(&out, &more).status.code(), Some(2));
    }
}
