//! What a careful user expects of odd names, odd numbers and files from elsewhere.
#![allow(clippy::unwrap_used)]

mod common;

use common::{command, fails, pursuit, rows, stderr, stdout};
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
