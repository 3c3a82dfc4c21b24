//! What scripts rely on: commands, names, exit status.

use crate::common::{fails, pursuit, rows, stderr, stdout};

#[test]
fn help_man_and_completions_are_printed() {
    for args in [&["--help"][..], &["man"], &["completions", "bash"], &["completions", "zsh"], &["completions", "fish"]]
    {
        let output = pursuit(args);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(output.stderr.is_empty());
        assert!(stdout(&output).contains("track"), "{args:?}");
    }
}

#[test]
fn the_version_is_one_line_and_more_when_asked() {
    let short = format!("pursuit {}\n", env!("CARGO_PKG_VERSION"));
    for args in [&["--version"][..], &["-V"]] {
        assert_eq!(stdout(&pursuit(args)), short, "{args:?}");
    }
    for args in [&["--version", "-v"][..], &["-vV"], &["-v", "--version"]] {
        let text = stdout(&pursuit(args));
        assert!(text.starts_with(&short) && text.lines().count() == 4, "{text}");
        for (line, word) in [("commit", ""), ("features", "parquet"), ("ffmpeg", "none found")] {
            assert!(text.lines().any(|l| l.starts_with(line) && l.contains(word)), "{line} {word}: {text}");
        }
        assert_eq!(text.contains("encode, h264"), cfg!(all(feature = "encode", feature = "h264")), "{text}");
    }
}

#[test]
fn the_licences_of_what_is_inside_are_printed() {
    let output = pursuit(&["licences"]);
    let text = stdout(&output);
    assert!(output.status.success() && text.len() > 10_000);
    for inside in ["nalgebra", "rustfft", "openh264", "Permission is hereby granted", "Redistribution and use"] {
        assert!(text.contains(inside), "{inside}");
    }
}

#[test]
fn wrong_usage_is_two() {
    for args in [&["fly"][..], &[], &["-v"], &["track"], &["track", "scene:table-tennis", "--bix"]] {
        assert_eq!(pursuit(args).status.code(), Some(2), "{args:?}");
    }
    fails(&pursuit(&["track", "scene:table-tennis", "--tracker", "bal"]), 2, &["bal", "there are:", "ball"]);
    fails(
        &pursuit(&["track", "scene:table-tennis", "--detect", "ball", "--set", "colour=orange"]),
        2,
        &["colour", "color"],
    );
    fails(
        &pursuit(&["track", "scene:table-tennis", "--detect", "ball", "--set", "color=mauve"]),
        2,
        &["mauve", "orange"],
    );
    fails(&pursuit(&["track", "scene:table-tennis", "--box", "1,2,3"]), 2, &["1,2,3", "LEFT,TOP,WIDTH,HEIGHT"]);
    fails(&pursuit(&["trackers", "nobody"]), 2, &["nobody", "ball"]);
}

#[test]
fn trackers_print_configuration_files_that_can_be_used() {
    let list = stdout(&pursuit(&["trackers"]));
    assert!(list.contains("ball"), "{list}");
    let names = list.lines().skip(1).take_while(|l| l.starts_with("  ")).filter_map(|l| l.split_whitespace().next());
    for name in names {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("configuration.toml");
        let output = pursuit(&["trackers", name]);
        std::fs::write(&file, stdout(&output)).unwrap();
        let out = folder.path().join("out");
        let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
        let output =
            pursuit(&["track", "scene:table-tennis", "--config", file, "--out", out, "--no-video", "--to", "2"]);
        let about: serde_json::Value = serde_json::from_slice(&pursuit(&["trackers", name, "--json"]).stdout).unwrap();
        if about["trackers"][0]["needs_file"] == true {
            fails(&output, 2, &[&format!("`model` of `{name}`"), "for example"]);
            continue;
        }
        assert!(output.status.success(), "{name}: {}", stderr(&output));
    }
}

#[test]
fn parameters_are_printed_for_machines_too() {
    let output = pursuit(&["trackers", "ball", "--json"]);
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed["trackers"][0]["name"], "ball");
    let parameters = printed["trackers"][0]["parameters"].as_array().unwrap();
    let motion = parameters.iter().find(|p| p["name"] == "motion").unwrap();
    assert_eq!((&motion["type"], &motion["parameters"][0]["name"]), (&"group".into(), &"model".into()));
    assert_eq!(printed["detectors"][0]["default_tracker"], "ball");
    let all: serde_json::Value = serde_json::from_slice(&pursuit(&["trackers", "--json"]).stdout).unwrap();
    assert!(all["trackers"].as_array().unwrap().len() > 5);
    let scene: serde_json::Value =
        serde_json::from_slice(&pursuit(&["trackers", "scene:motion", "--json"]).stdout).unwrap();
    let keys = scene["scenes"][0]["parameters"].as_array().unwrap();
    let course = keys.iter().find(|p| p["name"] == "motion").unwrap();
    assert_eq!((&course["type"], &course["choices"][3]), (&"choice".into(), &"jump".into()));
    let printed = pursuit(&["trackers", "scene:motion"]);
    assert!(String::from_utf8_lossy(&printed.stdout).contains("# px, between 64 and 4096\nwidth = 640"));
    fails(&pursuit(&["trackers", "scene:nothing"]), 2, &["nothing", "drift"]);
    fails(&pursuit(&["trackers", "nobody", "--json"]), 2, &["nobody"]);
}

#[test]
fn settings_mean_the_same_in_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let parameters = |args: &[&str]| {
        let output = pursuit(&[args, &["--out", out, "--json"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let run: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        run["recipe"]["parameters"].clone()
    };
    let track = ["track", "scene:table-tennis", "--detect", "ball", "--no-video", "--to", "1"];
    let with = |settings: &[&str]| parameters(&[&track[..], settings].concat());
    let set = ["--set", "color=yellow", "--set", "motion.model=imm", "--set", "ball.policy.lost_after_s=2"];
    let of_track = with(&[&set[..], &["--set", "detect.min_area=0.001"]].concat());
    assert_eq!((&of_track["motion"]["model"], &of_track["policy"]["lost_after_s"]), (&"imm".into(), &2.0.into()));
    fails(&pursuit(&[&track[..], &["--set", "kcf.motion.model=imm"]].concat()), 2, &["takes no part"]);
    fails(&pursuit(&["demo", "--out", out, "--set", "motion.modle=imm"]), 2, &["motion.modle", "model"]);
    fails(&pursuit(&["track", "scene:table-tennis", "--many"]), 2, &["detector"]);
    let gone = pursuit(&["track", "scene:table-tennis", "--detect", "ball", "--seed", "1"]);
    assert_eq!(gone.status.code(), Some(2));
    assert!(stderr(&gone).contains("--seed"));
}

#[test]
fn a_run_leaves_what_the_contract_says() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let args = [
        "track",
        "scene:table-tennis?seed=3",
        "--detect",
        "ball",
        "--set",
        "color=yellow",
        "--out",
        out.to_str().unwrap(),
    ];
    let more = ["--plots", "--json", "--to", "40", "--format", "jsonl,mot"];
    let output = pursuit(&[&args[..], &more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(output.stderr.is_empty(), "no progress bar when piped: {}", stderr(&output));

    let header = "frame,time_s,target,state,x,y,w,h,score,pred_x,pred_y,pred_w,pred_h,meas_x,meas_y,meas_w,meas_h,update_ms,\
         class,doubt";
    assert!(std::fs::read_to_string(out.join("trajectory.csv")).unwrap().starts_with(header));
    let rows = rows(&out.join("trajectory.csv"));
    assert_eq!(rows.len(), 41);
    for (i, row) in rows.iter().enumerate() {
        assert_eq!(row["frame"], i.to_string());
        assert!(["tracking", "unsure", "occluded", "lost"].contains(&row["state"].as_str()));
        if row["state"] == "tracking" {
            assert!(["x", "y", "w", "h", "score", "meas_x"].iter().all(|c| row[*c].parse::<f64>().is_ok()), "{row:?}");
            assert!(row["x"].split_once('.').is_some_and(|(_, decimals)| decimals.len() >= 3));
        }
    }
    let run: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!((&run["status"], &run["frame_count"]), (&"done".into(), &41.into()));
    assert_eq!(run["recipe"]["parameters"]["color"], "yellow");
    assert!(run["timing"]["update_ms"]["p99"].as_f64().unwrap() > 0.0);
    // The detector has its own time, and a frame the time of all.
    let timing = |what: &str| run["timing"][what]["count"].as_u64().unwrap();
    assert!(timing("detect_ms") > 0 && timing("frame_ms") == 41);
    let other = folder.path().join("other");
    let brief = [&args[..7], &[other.to_str().unwrap(), "--no-video", "--to", "9"]].concat();
    assert!(stdout(&pursuit(&brief)).contains("\ndetect "));
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed["frame_count"], 41);
    for plot in ["x", "y", "width", "height", "score"] {
        assert!(std::fs::read_to_string(out.join(format!("plots/{plot}.svg"))).unwrap().starts_with("<svg"));
    }
    assert_eq!(std::fs::read_to_string(out.join("trajectory.jsonl")).unwrap().lines().count(), 41);
    assert!(out.join("trajectory.txt").exists());
    assert_eq!(&std::fs::read(out.join("overlay.mp4")).unwrap()[4..8], b"ftyp");
}

#[test]
fn runs_repeat_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, threads: &str| {
        let out = folder.path().join(name);
        let boxes = ["--box", "100,100,40,40", "--box", "300,200,60,40"];
        let args = [
            "track",
            "scene:table-tennis",
            "--tracker",
            "ball",
            "--no-video",
            "--to",
            "20",
            "--threads",
            threads,
            "--out",
        ];
        let output = pursuit(&[&args[..], &[out.to_str().unwrap()], &boxes].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let mut rows = rows(&out.join("trajectory.csv"));
        rows.iter_mut().for_each(|r| drop(r.remove("update_ms")));
        rows
    };
    let first = run("a", "1");
    assert_eq!(first.len(), 42);
    assert_eq!(first, run("b", "2"));
}
