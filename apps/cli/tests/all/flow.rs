//! `pursuit flow` as a user would call it.

use crate::common::{fails, pursuit, rows, stderr, stdout};
use serde_json::Value;

const SCENE: &str = "scene:drift?seed=7&duration=1";

fn flow(args: &[&str]) -> Value {
    let output = pursuit(&[&["flow", SCENE, "--to", "5", "--json"], args].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(output.stderr.is_empty(), "{}", stderr(&output));
    serde_json::from_str(&stdout(&output)).unwrap()
}

#[test]
fn points_leave_a_table_and_a_summary() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let facts = flow(&["--points", "30", "--out", out.to_str().unwrap()]);
    assert_eq!(
        (&facts["flow"], &facts["frames"], &facts["points"]["started"]),
        (&"points".into(), &6.into(), &30.into())
    );
    let rows = rows(&out.join("points.csv"));
    assert!(rows.iter().filter(|r| r["frame"] == "0").count() == 30 && rows.len() > 100);
    assert!(rows.iter().all(|r| ["tracked", "lost", "outside"].contains(&r["state"].as_str())));
    // In words, into a folder of its own each time.
    let output = crate::common::command(&["flow", SCENE, "--to", "2", "--point", "100,80", "--point=200.5,60"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let text = stdout(&output);
    assert!(output.status.success() && text.contains("2 points") && text.contains("-flow"), "{text}");
}

#[test]
fn fields_leave_flo_files_and_a_grid() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let facts = flow(&["--dense", "--flo", "--grid", "100", "--out", out.to_str().unwrap()]);
    assert_eq!((&facts["flow"], &facts["field"]["fields"]), (&"field".into(), &5.into()));
    assert!(out.join("flo/000004.flo").is_file() && !rows(&out.join("field.csv")).is_empty());
    for quality in ["fast", "fine", "full"] {
        flow(&["--dense", "--quality", quality, "--out", out.to_str().unwrap()]);
    }
    let mean = |rounds: &str| {
        let facts = flow(&["--dense", "--refine", rounds, "--out", out.to_str().unwrap()]);
        facts["field"]["mean_px"].as_f64().unwrap()
    };
    assert!((mean("0") - mean("2")).abs() > 1e-6, "it changes the field");
    fails(&pursuit(&["flow", SCENE, "--dense", "--refine", "99"]), 2, &["refinement.rounds", "from 0 to 20"]);
}

#[test]
fn a_part_is_looked_at_in_the_whole_pictures_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let view = ["--region", "120,120,200,120", "--resize", "0.5", "--out", out.to_str().unwrap()];
    let facts = flow(&[&view[..], &["--points", "20"]].concat());
    assert_eq!(facts["input"]["view"]["region"], serde_json::json!([120, 120, 200, 120]));
    assert_eq!(facts["input"]["view"]["size"], serde_json::json!([100, 60]));
    let number = |text: &str| text.parse::<f64>().unwrap();
    let rows = rows(&out.join("points.csv"));
    let seen = rows.iter().filter(|r| r["state"] == "tracked");
    assert!(rows.len() > 20);
    for row in seen {
        let (x, y) = (number(&row["x_px"]), number(&row["y_px"]));
        assert!((120.0..=320.0).contains(&x) && (120.0..=240.0).contains(&y), "{row:?}");
    }
    flow(&[&view[..], &["--dense", "--grid", "40", "--overlay"]].concat());
    assert!(std::fs::metadata(out.join("overlay.mp4")).unwrap().len() > 500);
    fails(&pursuit(&["flow", SCENE, "--region", "1,2,3"]), 2, &["--region", "4 finite numbers"]);
    fails(&pursuit(&["flow", SCENE, "--resize", "huge"]), 2, &["huge"]);
    fails(&pursuit(&["flow", SCENE, "--region", "120,120,200,120", "--point", "20,20"]), 2, &["20,20", "120,120"]);
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    fails(&pursuit(&["flow", SCENE, "--point", "9000,3"]), 2, &["9000,3", "outside"]);
    fails(&pursuit(&["flow", SCENE, "--window", "2"]), 2, &["window", "from 3 to 255"]);
    fails(&pursuit(&["flow", "nothing.mp4"]), 3, &["nothing.mp4"]);
    for args in [&["--point", "3"][..], &["--dense", "--points", "9"], &["--flo"], &["--point", "1,2", "--renew"]] {
        assert_eq!(pursuit(&[&["flow", SCENE], args].concat()).status.code(), Some(2), "{args:?}");
    }
}
