//! From a run to metres: `calibrate`, `measure` and `track --measure` as a student would call them, and what they refuse.

use crate::common::{fails, footage, pursuit, rows, stderr, stdout};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A run of a ball that falls with 9.81 m/s² at 400 pixels a metre, measured to a tenth of a pixel at 120 frames a second and
/// written as 30, hidden for a while.
fn recorded(folder: &Path) -> PathBuf {
    let run = folder.join("run");
    std::fs::create_dir_all(&run).unwrap();
    let mut text =
        "frame,time_s,target,state,x,y,w,h,score,pred_x,pred_y,pred_w,pred_h,meas_x,meas_y,meas_w,meas_h,update_ms\n"
            .to_owned();
    for k in 0..90_u32 {
        let t = f64::from(k) / 120.0;
        let wobble = |n: u32| 0.17 * (f64::from((k * n) % 97) / 48.0 - 1.0);
        let (x, y) = (86.0 + 400.0 * 1.2 * t + wobble(31), 26.0 + 0.5 * 3924.0 * t * t + wobble(57));
        let hidden = (40..46).contains(&k);
        let state = if hidden { "occluded" } else { "tracking" };
        let seen = if hidden { ",,,".to_owned() } else { format!("{x:.3},{y:.3},28.000,28.000") };
        writeln!(text, "{k},{:.6},1,{state},{x:.3},{y:.3},28.000,28.000,0.9,,,,,{seen},0.1", f64::from(k) / 30.0)
            .unwrap();
    }
    std::fs::write(run.join("trajectory.csv"), text).unwrap();
    let facts = r#"{"status": "done", "recipe": {"tracker": "kcf"}, "input": {"name": "clip.mp4", "width": 1280, "height": 960}}"#;
    std::fs::write(run.join("run.json"), facts).unwrap();
    run
}

const STICK: [&str; 6] = ["--scale", "100,900,500,900=1m", "--true-fps", "120", "--origin", "100,900"];

fn measure(run: &Path, more: &[&str]) -> std::process::Output {
    pursuit(&[&["measure", run.to_str().unwrap()], more].concat())
}

fn json(run: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(run.join("measure.json")).unwrap()).unwrap()
}

/// Every file below a folder.
fn names(folder: &Path) -> Vec<String> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            all.extend(names(&entry.path()).into_iter().map(|n| format!("{name}/{n}")));
        } else {
            all.push(name);
        }
    }
    all.sort();
    all
}

#[test]
fn a_falling_ball_gives_g_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    let run = recorded(folder.path());
    let more = ["--measure-fit", "parabola", "--measure-line", "floor=-1,1,9,1", "--measure-format", "jsonl"];
    let zone = ["--measure-zone", "cellar=-1,1,9,1,9,-9,-1,-9"];
    let output = measure(&run, &[&STICK[..], &more, &zone].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("acceleration") && stdout(&output).contains("m/s^2"), "{}", stdout(&output));
    let table = rows(&run.join("measure.csv"));
    assert_eq!(table.len(), 90);
    let number = |k: usize, name: &str| table[k][name].parse::<f64>().unwrap();
    for k in [10, 43, 80] {
        let t = k as f64 / 120.0;
        for (name, truth) in [("x", 1.2 * t), ("vy", -9.81 * t), ("ay", -9.81), ("vx", 1.2)] {
            let unit = ["m", "m_per_s", "m_per_s2"][name.len() - 1 + usize::from(name.starts_with('a'))];
            let (value, error) = (number(k, &format!("{name}_{unit}")), number(k, &format!("{name}_sd_{unit}")));
            assert!((value - truth).abs() < 4.0 * error + 0.01 * truth.abs(), "{k} {name}: {value} ± {error}, {truth}");
        }
    }
    assert_eq!((table[43]["how"].as_str(), table[44]["measured_x_m"].as_str()), ("bridged", ""));
    let facts = json(&run);
    let parameters = facts["fits"][0]["parameters"].as_array().unwrap();
    let g = parameters.iter().find(|p| p["name"] == "acceleration").unwrap();
    assert!((g["value"].as_f64().unwrap() / 9.81 - 1.0).abs() < 0.01, "{g}");
    assert_eq!(facts["targets"][0]["bridged"], 6);
    let crossing = facts["events"].as_array().unwrap().iter().find(|e| e["kind"] == "crossing").unwrap();
    let truth = (2.0 * (2.15 - 1.0) / 9.81_f64).sqrt();
    assert!((crossing["time_s"].as_f64().unwrap() - truth).abs() < 0.005, "{crossing}");
    let stay = &facts["stays"][0];
    assert!((stay["inside_s"].as_f64().unwrap() - (89.0 / 120.0 - truth)).abs() < 0.005, "{stay}");
    assert_eq!((&stay["visits"], rows(&run.join("measure-zones.csv"))[0]["zone"].as_str()), (&1.into(), "cellar"));
    assert!(stdout(&output).contains("cellar    target 1: 0.25"), "{}", stdout(&output));
    let files = names(&run);
    for file in ["measure-events.csv", "measure.jsonl", "plots/measure-position.svg", "plots/measure-fit-1.svg"] {
        assert!(files.contains(&file.to_owned()), "{file}: {files:?}");
    }
    let svg = std::fs::read_to_string(run.join("plots/measure-velocity.svg")).unwrap();
    assert!(svg.contains("class=\"area\"") && svg.contains("velocity (m/s)") && svg.contains("bridged"));
    let line = std::fs::read_to_string(run.join("measure.jsonl")).unwrap();
    assert!(serde_json::from_str::<serde_json::Value>(line.lines().next().unwrap()).unwrap()["x_m"].is_f64());
}

#[test]
fn a_calibration_is_kept_beside_the_clip_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let run = recorded(folder.path());
    let file = run.join("calibration.toml");
    let path = file.to_str().unwrap();
    let calibrate = |more: &[&str]| {
        pursuit(&[&["calibrate", "scene:static?width=1280&height=960", "--out", path], &STICK[..], more].concat())
    };
    let made = calibrate(&[]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    assert!(stdout(&made).contains("0.002500 m a pixel"), "{}", stdout(&made));
    let before = std::fs::read(&file).unwrap();
    fails(&calibrate(&[]), 2, &["already", "--overwrite"]);
    assert_eq!(std::fs::read(&file).unwrap(), before);
    assert_eq!(calibrate(&["--overwrite"]).status.code(), Some(0));
    assert_eq!(measure(&run, &[]).status.code(), Some(0));
    assert_eq!(json(&run)["ruler"]["kind"], "stick");
    assert!(json(&run)["calibration_file"].as_str().unwrap().ends_with("calibration.toml"));
    // The unit of the results may be another.
    assert_eq!(measure(&run, &["--measure-unit", "cm"]).status.code(), Some(0));
    assert!(rows(&run.join("measure.csv"))[0].contains_key("vx_sd_cm_per_s"));
    // Made at another size of picture, it is refused and nothing is touched.
    let other = ["calibrate", "scene:static?width=640&height=480", "--out", path, "--overwrite"];
    assert_eq!(pursuit(&[&other[..], &STICK].concat()).status.code(), Some(0));
    let (files, csv) = (names(&run), std::fs::read(run.join("measure.csv")).unwrap());
    fails(&measure(&run, &[]), 2, &["640x480", "1280x960", "calibrate on a picture of this size"]);
    assert_eq!((names(&run), std::fs::read(run.join("measure.csv")).unwrap()), (files, csv));
}

#[test]
fn wrong_input_names_its_mend_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let run = recorded(folder.path());
    let before = names(&run);
    let line = ["--plane", "0,0=0,0m", "--plane", "10,0=1,0m", "--plane", "20,0=2,0m", "--plane", "30,0=3,0m"];
    for (more, words) in [
        (&["--scale", "5,5,5,5=1m"][..], &["no length in the picture", "click its two ends"][..]),
        (&["--scale", "5,5,99,5=0m"], &["not a length", "0.50m"]),
        (&["--scale", "5,5,99,5=2ells"], &["no unit `ells`", "km, m, cm"]),
        (&line, &["lie on a line", "click 4 corners"]),
        (&line[..4], &["2 points", "at least 4"]),
        (&["--camera", "nowhere.yml", "--scale", "5,5,99,5=1m"], &["nowhere.yml"]),
        (&["--measure-unit", "m"], &["give a ruler"]),
        (&["--true-fps", "0"], &["true_fps is 0"]),
        (&["--measure-window", "4"], &["odd number"]),
        (&["--measure-fit", "cubic"], &["no fit", "parabola@"]),
        (&["--measure-fit", "line@77-78"], &["0 frames", "longer span"]),
        (&["--measure-zone", "1,1,2,2"], &["no zone"]),
        (&["--measure-between", "1,2"], &["no target 2", "there are 1"]),
        (&["--measure-format", "ods"], &["no format `ods`", "xlsx"]),
        (&["--calibration", "nowhere.toml"], &["nowhere.toml"]),
    ] {
        fails(&measure(&run, more), 2, words);
        assert_eq!(names(&run), before, "{more:?}");
    }
    fails(&measure(&folder.path().join("nowhere"), &[]), 2, &["nowhere", "name the folder of a run"]);
    fails(&pursuit(&["calibrate", "scene:static"]), 2, &["--scale"]);
    // What no measurement wrote stays.
    std::fs::write(run.join("measure.csv"), "years of work").unwrap();
    fails(&measure(&run, &STICK), 2, &["measure.csv", "no `pursuit measure` wrote it", "--out"]);
    assert_eq!(std::fs::read_to_string(run.join("measure.csv")).unwrap(), "years of work");
    let out = folder.path().join("elsewhere");
    assert_eq!(measure(&run, &[&STICK[..], &["--out", out.to_str().unwrap()]].concat()).status.code(), Some(0));
    assert!(out.join("measure.csv").exists());
}

/// The guide, on a clip made of a scene: taken at 240 frames a second, played at 30; g is 9.81 m/s² at 200 pixels a metre.
#[test]
fn a_slow_motion_clip_gives_g_within_a_percent() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = folder.path().join("calibration.toml");
    let scene = "scene:motion?motion=throw&fps=240&gravity=1962&duration=1&width=960&height=540&speed=400&seed=3";
    let ruler = ["--scale", "40,500,440,500=2m", "--true-fps", "240", "--origin", "40,500"];
    let made = pursuit(&[&["calibrate", scene, "--out", calibration.to_str().unwrap()], &ruler[..]].concat());
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let out = folder.path().join("run");
    let output = pursuit(&[
        "track",
        scene,
        "--fps",
        "30",
        "--tracker",
        "mosse",
        "--no-video",
        "--out",
        out.to_str().unwrap(),
        "--measure",
        "--calibration",
        calibration.to_str().unwrap(),
        "--measure-fit",
        "parabola",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let facts = json(&out);
    let parameters = facts["fits"][0]["parameters"].as_array().unwrap();
    let g = parameters.iter().find(|p| p["name"] == "acceleration").unwrap();
    println!("{g}; residuals {}, {}", facts["fits"][0]["residual_rms"], facts["warnings"]);
    assert!((g["value"].as_f64().unwrap() / 9.81 - 1.0).abs() < 0.01, "{g}");
    // A run that replaces this one takes what was measured away.
    let again = ["track", scene, "--to", "20", "--no-video", "--tracker", "mosse", "--out", out.to_str().unwrap()];
    assert_eq!(pursuit(&again).status.code(), Some(0));
    assert!(!names(&out).iter().any(|n| n.contains("measure")), "{:?}", names(&out));
}

/// A real ball in flight: what a parabola leaves over, and that the smoother's noise is a pixel or so.
#[test]
fn a_real_flight_is_fitted() {
    let Some(clip) = footage("ball/orange_bounce/clip.mp4") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let output = pursuit(&[
        "track",
        clip.to_str().unwrap(),
        "--detect",
        "ball",
        "--set",
        "color=orange",
        "--no-video",
        "--out",
        out.to_str().unwrap(),
        "--measure",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let measured = measure(&out, &["--target-size", "6.5cm"]);
    println!("{}", stdout(&measured));
    let facts = json(&out);
    assert_eq!((measured.status.code(), facts["ruler"]["kind"].as_str()), (Some(0), Some("target")));
    let noise = facts["targets"][0]["noise_px"].as_f64().unwrap();
    assert!(noise > 0.05 && noise < 6.0, "{noise}");
    println!("{}", serde_json::to_string_pretty(&facts["events"]).unwrap());
}
