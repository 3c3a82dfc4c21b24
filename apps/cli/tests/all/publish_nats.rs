//! `pursuit track --publish nats://…`, heard by a client written here on a real server.

use crate::broker::nats::NatsServer;
use crate::common::{command, fails, rows, stderr, stdout};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

/// Follows the target of a scene of 30 frames; what it writes goes to `out`.
fn track(out: &Path, more: &[&str]) -> Output {
    let args = ["track", "scene:drift?seed=7&duration=1", "--tracker", "mosse", "--no-video", "--out"];
    command(&args).arg(out).args(more).env("PURSUIT_PUBLISH_PASSWORD", "wrong-secret").output().unwrap()
}

/// Whether this build speaks to NATS; where it does not, it says what would mend that.
fn speaks_nats() -> bool {
    let has = |feature: &str| pursuit::FEATURES.contains(&(feature, true));
    let folder = tempfile::tempdir().unwrap();
    for (address, feature, is_there) in
        [("nats://house", "nats", has("nats")), ("tls://house", "nats,tls", has("nats") && has("tls"))]
    {
        if !is_there {
            fails(&track(folder.path(), &["--publish", address]), 2, &[&format!("--features {feature}")]);
            println!("skipped: this build has no {feature}");
        }
    }
    has("nats")
}

#[test]
fn every_frame_is_heard_as_it_was_written() {
    if !speaks_nats() {
        return;
    }
    let Some(nats) = NatsServer::open() else { return };
    let listener = nats.listen();
    let folder = tempfile::tempdir().unwrap();
    let output = track(folder.path(), &["--publish", &format!("nats://127.0.0.1:{}/yard/1", nats.port)]);
    assert!(output.status.success(), "{}", stderr(&output));
    listener.wait_for("yard.1.status", "offline");
    let frames: Vec<Value> =
        listener.under("yard.1.targets.1.frame").iter().map(|text| serde_json::from_str(text).unwrap()).collect();
    let rows = rows(&folder.path().join("trajectory.csv"));
    assert_eq!(frames.len(), rows.len());
    for (frame, row) in frames.iter().zip(&rows) {
        assert_eq!(frame["schema"], "pursuit.target/1");
        assert_eq!(frame["frame"].to_string(), row["frame"]);
        let x: f64 = row["x"].parse().unwrap();
        assert!((frame["box"][0].as_f64().unwrap() - x).abs() < 1e-3, "{frame}");
    }
    let about: Value = serde_json::from_str(&listener.under("yard.1.run")[0]).unwrap();
    assert_eq!((&about["schema"], &about["tracker"]), (&"pursuit.run/1".into(), &"mosse".into()));
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(folder.path().join("run.json")).unwrap()).unwrap();
    assert_eq!((&kept["publish"]["dropped"], &kept["publish"]["connections"]), (&0.into(), &1.into()));
    assert!(stdout(&output).contains("0 dropped"), "{}", stdout(&output));
}

#[test]
fn a_wrong_password_ends_the_run_with_one_line() {
    if !speaks_nats() {
        return;
    }
    let Some(nats) = NatsServer::start(|_| "authorization { user: me, password: sesame }".to_owned()) else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = track(folder.path(), &["--publish", &format!("nats://me@127.0.0.1:{}/yard", nats.port)]);
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    let said = stderr(&output);
    let errors: Vec<&str> = said.lines().filter(|line| line.to_ascii_lowercase().contains("error")).collect();
    assert!(errors.len() == 1 && errors[0].contains("does not accept the user or the password"), "{said}");
    assert!(!said.contains("secret"), "{said}");
}

#[test]
fn what_nats_has_not_is_said_before_anything_is_written() {
    if !speaks_nats() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (more, word) in [
        (vec!["--publish", "nats://house", "--publish-qos", "2"], "at least once (1)"),
        (vec!["--publish", "nats://house", "--publish-discovery", "homeassistant"], "mqtt://"),
        (vec!["--publish", "nats://house/a/*"], "`*`"),
        (vec!["--publish", "nats://me:sesame@house/>"], "`>`"),
    ] {
        let output = track(&out, &more);
        fails(&output, 2, &[word]);
        assert!(!out.exists() && !stderr(&output).contains("sesame"), "{}", stderr(&output));
    }
}
