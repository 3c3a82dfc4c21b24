//! What a careful user expects of odd names, odd numbers and files from elsewhere.

use crate::common::{command, fails, pursuit, rows, stderr, stdout};
use std::path::{Path, PathBuf};

const START: [&str; 4] = ["--box", "20,20,24,24", "--tracker", "mosse"];

/// Grey images with a bright square that stands still, under these names.
fn film(folder: &Path, names: &[&str]) {
    for name in names {
        let file = std::fs::File::create(folder.join(name)).unwrap();
        let mut encoder = png::Encoder::new(file, 96, 64);
        encoder.set_color(png::ColorType::Grayscale);
        let pixel = |i: usize| {
            let (x, y) = (i % 96, i / 96);
            if (22..42).contains(&x) && (22..42).contains(&y) { 200 + ((x * 7 + y * 13) % 50) as u8 } else { 40 }
        };
        encoder.write_header().unwrap().write_image_data(&(0..96 * 64).map(pixel).collect::<Vec<u8>>()).unwrap();
    }
}

fn track(input: &Path, out: &Path, more: &[&str]) -> std::process::Output {
    let args = ["track", input.to_str().unwrap(), "--out", out.to_str().unwrap()];
    pursuit(&[&args[..], &START, more].concat())
}

fn folders() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (images, out) = (folder.path().join("images"), folder.path().join("out"));
    std::fs::create_dir(&images).unwrap();
    (folder, images, out)
}

#[test]
fn gaps_between_numbered_images_are_gaps_in_time() {
    let (_folder, images, out) = folders();
    film(&images, &["07.png", "08.png", "10.png"]);
    for (more, wanted) in [(&[][..], [0.0, 1.0 / 30.0, 0.1]), (&["--fps", "10"], [0.0, 0.1, 0.3])] {
        let output = track(&images, &out, &[&["--no-video"], more].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let times: Vec<f64> = rows(&out.join("trajectory.csv")).iter().map(|r| r["time_s"].parse().unwrap()).collect();
        assert!(times.iter().zip(wanted).all(|(t, w)| (t - w).abs() < 1e-5), "{times:?}");
    }
}

#[test]
fn numbers_without_sense_are_refused() {
    let (_folder, images, out) = folders();
    film(&images, &["1.png"]);
    for fps in ["1e-300", "1e300", "0", "-1", "nan"] {
        fails(&track(&images, &out, &["--fps", fps]), 2, &["frames a second"]);
    }
    for wrong in
        [["--stall", "0"], ["--stall", "soon"], ["--reconnect", "-1"], ["--reconnect", "nan"], ["--stride", "0"]]
    {
        assert_eq!(track(&images, &out, &wrong).status.code(), Some(2), "{wrong:?}");
    }
    assert!(!out.exists());
}

#[test]
fn files_from_elsewhere_name_no_other_files() {
    let (folder, images, out) = folders();
    film(&images, &["1.png"]);
    std::fs::write(images.join("frames.csv"), "index,image\n0,1.png\n1,../images/1.png\n").unwrap();
    fails(&track(&images, &out, &[]), 3, &["frames.csv", "leads out of the folder"]);
    let list = folder.path().join("list.m3u8");
    std::fs::write(&list, "#EXTM3U\nimages/1.png\n").unwrap();
    fails(&track(&list, &out, &[]), 3, &["list.m3u8", "playlist"]);
}

#[test]
fn names_do_nothing_to_a_terminal() {
    let output = pursuit(&["track", "absent\u{1b}]0;owned\u{7}.mp4", "--detect", "ball"]);
    fails(&output, 3, &["absent\\u{1b}]0;owned\\u{7}.mp4"]);
}

#[test]
#[cfg(unix)]
fn names_need_not_be_text() {
    use std::os::unix::ffi::OsStrExt;
    let (folder, images, out) = folders();
    let odd = folder.path().join(std::ffi::OsStr::from_bytes(b"caf\xe9"));
    film(&images, &["1.png", "2.png"]);
    std::fs::rename(&images, &odd).unwrap();
    let output = command(&["track", "--no-video", "--out"]).arg(&out).arg(&odd).args(START).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(rows(&out.join("trajectory.csv")).len(), 2);
}

#[test]
fn credentials_are_read_from_where_they_are_kept_and_shown_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let (good, bad) = (folder.path().join("good"), folder.path().join("bad"));
    std::fs::write(&good, "watch:sesame77\n").unwrap();
    std::fs::write(&bad, "sesame77\n").unwrap();
    let run = |words: &[&str]| {
        let args = [&["track", "rtsp://127.0.0.1:9/1", "--detect", "ball"], words].concat();
        let output = command(&args).env("CAMERA", "watch:sesame77").output().unwrap();
        assert!(!stderr(&output).contains("sesame"), "{}", stderr(&output));
        output
    };
    fails(&run(&["--credentials-env", "CAMERA"]), 3, &["rtsp://watch:***@127.0.0.1:9/1"]);
    fails(&run(&["--credentials-file", good.to_str().unwrap()]), 3, &["rtsp://watch:***@127.0.0.1:9/1"]);
    fails(&run(&["--credentials-file", bad.to_str().unwrap()]), 2, &["USER:PASSWORD"]);
    fails(&run(&["--credentials-env", "NO_SUCH"]), 2, &["NO_SUCH"]);
}

#[test]
fn strides_keep_numbers_and_times_and_overlays_have_styles() {
    let (_folder, images, out) = folders();
    let names: Vec<String> = (1..=7).map(|n| format!("{n}.png")).collect();
    film(&images, &names.iter().map(String::as_str).collect::<Vec<_>>());
    let output = track(&images, &out, &["--stride", "3", "--overlay", "none", "--from", "1"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let seen: Vec<String> =
        rows(&out.join("trajectory.csv")).iter().map(|r| format!("{} {}", r["frame"], r["time_s"])).collect();
    assert_eq!(seen, ["1 0.033333", "4 0.133333"]);
    assert!(!out.join("overlay.mp4").exists());
}

#[test]
fn a_part_looked_at_at_another_size_is_told_in_the_input_s_pixels() {
    let (_folder, images, out) = folders();
    film(&images, &["1.png", "2.png", "3.png"]);
    let place = |more: &[&str]| {
        let output = track(&images, &out, more);
        assert!(output.status.success(), "{more:?} {}", stderr(&output));
        let last = rows(&out.join("trajectory.csv")).pop().unwrap();
        ["x", "y", "w", "h"].map(|c| last[c].parse::<f64>().unwrap())
    };
    let whole = place(&["--no-video"]);
    for more in [&["--region", "9,7,60,50"][..], &["--resize", "192x128"], &["--region", "10,8,60,50", "--resize", "2"]]
    {
        let there = place(more);
        assert!(there.iter().zip(whole).all(|(a, b)| (a - b).abs() < 1.0), "{more:?} {there:?} {whole:?}");
    }
    let facts: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!(facts["input"]["width"], 96);
    assert_eq!(facts["input"]["view"], serde_json::json!({"region": [10, 8, 60, 50], "size": [120, 100]}));
    for (more, words) in [
        (["--region", "90,0,20,20"], "region 90,0,20,20 is no part of 96x64"),
        (["--region", "1,2,3"], "is not 4 finite numbers"),
        (["--resize", "-2"], "neither WIDTHxHEIGHT"),
        (["--resize", "1e9"], "cannot be resized"),
    ] {
        fails(&track(&images, &out, &more), 2, &[words]);
    }
}

#[test]
#[cfg(unix)]
fn a_run_that_was_interrupted_goes_on_as_if_it_had_not_been() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, broken) = (folder.path().join("whole"), folder.path().join("broken"));
    let scene = "scene:drift?seed=7&duration=40";
    let run = |out: &Path, more: &[&str]| {
        let args =
            ["track", scene, "--tracker", "mosse", "--no-video", "--format", "jsonl", "--out", out.to_str().unwrap()];
        pursuit(&[&args[..], more].concat())
    };
    assert!(run(&whole, &[]).status.success());
    assert!(!whole.join("state.bin").exists(), "nothing is left of a run that is done");
    fails(&run(&whole, &["--resume"]), 2, &["cannot be resumed: it is done"]);
    let mut cut = command(&["track", scene, "--tracker", "mosse", "--no-video", "--format", "jsonl", "--out"])
        .arg(&broken)
        .spawn()
        .unwrap();
    let text = || std::fs::read_to_string(broken.join("trajectory.csv")).unwrap_or_default();
    while text().lines().count() < 50 {
        assert!(cut.try_wait().unwrap().is_none(), "it is over already");
    }
    let process = rustix::process::Pid::from_child(&cut);
    rustix::process::kill_process(process, rustix::process::Signal::INT).unwrap();
    assert_eq!(cut.wait().unwrap().code(), Some(130));
    assert!(broken.join("state.bin").exists());
    fails(&run(&broken, &["--resume", "--set", "motion.model=imm"]), 2, &["its recipe had the parameters"]);
    let resumed = run(&broken, &["--resume"]);
    assert!(resumed.status.success(), "{}", stderr(&resumed));
    let without_timing = |out: &Path| -> Vec<Vec<String>> {
        let columns = ["frame", "time_s", "target", "state", "x", "y", "w", "h", "score", "pred_x", "meas_x"];
        rows(&out.join("trajectory.csv")).iter().map(|row| columns.map(|c| row[c].clone()).to_vec()).collect()
    };
    assert_eq!(without_timing(&broken), without_timing(&whole));
    let lines = |out: &Path| std::fs::read_to_string(out.join("trajectory.jsonl")).unwrap().lines().count();
    assert_eq!((lines(&broken), lines(&whole)), (1200, 1200));
    let facts = |out: &Path| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap()
    };
    let (a, b) = (facts(&broken), facts(&whole));
    assert!(a["resumed_at"].as_u64().is_some_and(|at| (49..1200).contains(&at)), "{a}");
    for key in ["status", "frame_count", "states"] {
        assert_eq!(a[key], b[key], "{key}");
    }
    assert!((a["accuracy"]["mean_iou"].as_f64().unwrap() - b["accuracy"]["mean_iou"].as_f64().unwrap()).abs() < 1e-4);
}

#[test]
fn every_command_has_a_page_of_the_manual() {
    let folder = tempfile::tempdir().unwrap();
    let output = pursuit(&["man", "--out", folder.path().to_str().unwrap()]);
    assert!(output.status.success(), "{}", stderr(&output));
    for page in ["pursuit", "pursuit-track", "pursuit-eval", "pursuit-man", "pursuit-ptz", "pursuit-ptz-follow"] {
        let text = std::fs::read_to_string(folder.path().join(format!("{page}.1"))).unwrap();
        assert!(text.contains(&format!(".TH {page} 1")), "{page}");
    }
    let one = stdout(&pursuit(&["man", "ptz", "follow"]));
    assert!(one.contains(".TH pursuit-ptz-follow 1") && one.contains("pursuit ptz follow"), "{one}");
    assert!(stdout(&pursuit(&["man"])).contains("pursuit\\-ptz\\-follow"));
    fails(&pursuit(&["man", "ptz", "dance"]), 2, &["pursuit ptz has no command `dance`", "follow"]);
}

#[test]
fn several_inputs_are_several_runs() {
    let (folder, images, out) = folders();
    film(&images, &["1.png", "2.png"]);
    let other = folder.path().join("elsewhere").join("images");
    std::fs::create_dir_all(&other).unwrap();
    film(&other, &["1.png"]);
    let absent = folder.path().join("absent.mp4");
    let args = ["track", "--no-video", "--out"];
    let output = command(&args).arg(&out).args([&images, &absent, &other]).args(START).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("absent.mp4") && stdout(&output).contains("2 frames of 96x64"));
    for (name, count) in [("images", 2), ("images-2", 1)] {
        assert_eq!(rows(&out.join(name).join("trajectory.csv")).len(), count, "{name}");
    }
}

#[test]
fn v_tells_what_happens() {
    let (_folder, images, out) = folders();
    film(&images, &["1.png", "2.png"]);
    let output = track(&images, &out, &["-v", "--no-video"]);
    let text = stderr(&output);
    assert!(text.contains("read by image folder (built in)") && text.contains("target 1 found at"), "{text}");
    assert_eq!(stderr(&track(&images, &out, &["--no-video"])), "");
}

#[test]
#[cfg(target_os = "linux")]
fn too_low_a_limit_on_memory_is_an_error() {
    let (_folder, images, out) = folders();
    film(&images, &["1.png"]);
    let track = format!("track '{}' --box 20,20,24,24 --tracker mosse --out '{}'", images.display(), out.display());
    // Below what the program itself takes, with a build's checks, nothing can be told.
    for limit in [100_000, 250_000, 440_000] {
        let limited = format!("ulimit -v {limit}; exec '{}' {track}", env!("CARGO_BIN_EXE_pursuit"));
        let output = std::process::Command::new("sh").args(["-c", &limited]).output().unwrap();
        fails(&output, 2, &["limit on memory (ulimit -v)", "raise it"]);
        assert!(!out.exists());
    }
}

#[test]
fn pixels_that_are_not_square_stay_so() {
    let folder = tempfile::tempdir().unwrap();
    let (clip, out, again) = (folder.path().join("wide.y4m"), folder.path().join("a"), folder.path().join("b"));
    let mut film = b"YUV4MPEG2 W96 H64 F25:1 A16:11 C420\n".to_vec();
    for _ in 0..3 {
        film.extend(b"FRAME\n");
        let square = |i: usize| if (22..42).contains(&(i % 96)) && (22..42).contains(&(i / 96)) { 200 } else { 40 };
        film.extend((0..96 * 64).map(|i| square(i) + (i % 7) as u8));
        film.extend([128; 48 * 32 * 2]);
    }
    std::fs::write(&clip, film).unwrap();
    let aspect = |input: &Path, out: &Path, more: &[&str]| {
        let output = track(input, out, more);
        assert!(output.status.success(), "{}", stderr(&output));
        let facts: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
        facts["input"]["pixel_aspect"].clone()
    };
    assert_eq!(aspect(&clip, &out, &[]), serde_json::json!([16, 11]));
    let last = rows(&out.join("trajectory.csv")).pop().unwrap();
    assert!((last["x"].parse::<f64>().unwrap() - 20.0).abs() < 1.0, "boxes are in pixels");
    // What the overlay says of itself is read back.
    assert_eq!(aspect(&out.join("overlay.mp4"), &again, &["--no-video"]), serde_json::json!([16, 11]));
    assert_eq!(aspect(&clip, &out, &["--resize", "192x64"]), serde_json::json!([16, 11]));
    assert_eq!(aspect(&out.join("overlay.mp4"), &again, &["--no-video"]), serde_json::json!([8, 11]));
}
