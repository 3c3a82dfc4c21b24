//! The README's first command.

use crate::common::{pursuit, rows, stderr, stdout};

#[test]
#[ignore = "release: renders, tracks and encodes a whole scene"]
fn the_demo_follows_its_ball_and_the_filter_earns_its_keep() {
    let out = tempfile::tempdir().unwrap();
    let output = pursuit(&["demo", "--out", out.path().to_str().unwrap()]);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = stdout(&output);
    println!("{text}");
    assert!(text.contains("overlay.mp4") && text.contains("accuracy"));
    let run: serde_json::Value = serde_json::from_slice(&std::fs::read(out.path().join("run.json")).unwrap()).unwrap();
    let accuracy = |name: &str| run["accuracy"][name].as_f64().unwrap();
    assert!(
        accuracy("rmse_estimate_px") < accuracy("rmse_measured_px"),
        "the filtered centre is better than the measured one"
    );
    assert!(accuracy("followed") > 0.9 && accuracy("false_alive") == 0.0);
    let rows = rows(&out.path().join("trajectory.csv"));
    assert!(rows.iter().any(|r| r["state"] == "occluded"), "the hand hides the ball");
    assert!(std::fs::metadata(out.path().join("overlay.mp4")).unwrap().len() > 100_000);
}
