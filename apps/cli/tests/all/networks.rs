//! Networks by file, end to end: `--detect objects`, `fear-xs` and `siamese`, and what is said when something is missing. The
//! network is the small one of `crates/inference/tests/fixtures`, which finds red and blue squares.
#![allow(clippy::disallowed_methods, reason = "a test may be told by the environment where a library is")]

use crate::common::{fails, pursuit, rows, stderr};
use std::path::{Path, PathBuf};

fn squares() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/inference/tests/fixtures");
    folder.join("squares.onnx").to_str().unwrap().to_owned()
}

/// Whether this build can run a network here.
fn runs_networks() -> bool {
    let runs =
        cfg!(feature = "rten") || (cfg!(feature = "onnxruntime") && std::env::var_os("PURSUIT_ONNXRUNTIME").is_some());
    if !runs {
        println!("skipped: running networks, for want of the feature rten or of PURSUIT_ONNXRUNTIME");
    }
    runs
}

/// Ten pictures of 128 x 96: a red square and a blue one.
fn clip(folder: &Path) -> PathBuf {
    let clip = folder.join("clip");
    std::fs::create_dir(&clip).unwrap();
    for k in 0..10 {
        let pixel = |i: usize| match (i % 128 / 8, i / 128 / 8) {
            (2, 4) => [250, 0, 0],
            (12, 9) => [0, 0, 250],
            _ => [0; 3],
        };
        let file = std::fs::File::create(clip.join(format!("{k:04}.png"))).unwrap();
        let mut encoder = png::Encoder::new(file, 128, 96);
        encoder.set_color(png::ColorType::Rgb);
        let pixels: Vec<u8> = (0..128 * 96).flat_map(pixel).collect();
        encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    }
    clip
}

fn track(clip: &Path, out: &Path, more: &[&str]) -> std::process::Output {
    let args = ["track", clip.to_str().unwrap(), "--fps", "2", "--no-video", "--out", out.to_str().unwrap()];
    pursuit(&[&args[..], more].concat())
}

#[test]
fn objects_of_the_classes_asked_for_are_followed() {
    if !runs_networks() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path());
    let model = format!("model={}", squares());
    for (classes, targets) in [("red", 1), ("red,blue", 2), ("blue", 1)] {
        let out = folder.path().join(classes);
        let found = track(
            &clip,
            &out,
            &["--detect", "objects", "--many", "--set", &model, "--set", &format!("classes={classes}")],
        );
        assert!(found.status.success(), "{}", stderr(&found));
        let rows = rows(&out.join("trajectory.csv"));
        let ids: std::collections::BTreeSet<&str> = rows.iter().map(|r| r["target"].as_str()).collect();
        assert_eq!(ids.len(), targets, "{classes}: {rows:?}");
        let last: Vec<_> = rows.iter().filter(|r| r["frame"] == "9").collect();
        assert_eq!(last.len(), targets);
        for row in last {
            let number = |key: &str| row[key].parse::<f64>().unwrap();
            let (x, y) = (number("x"), number("y"));
            let red = (x - 16.0).abs() < 2.0 && (y - 32.0).abs() < 2.0 && classes.contains("red");
            let blue = (x - 96.0).abs() < 2.0 && (y - 72.0).abs() < 2.0 && classes.contains("blue");
            assert!((red || blue) && row["state"] == "tracking", "{classes}: {row:?}");
        }
        let facts = std::fs::read_to_string(out.join("run.json")).unwrap();
        assert!(facts.contains("squares.onnx") && facts.contains(&format!("\"classes\": \"{classes}\"")), "{facts}");
    }
}

#[test]
fn a_network_that_cannot_be_used_is_said_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path());
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let out = folder.path().join("out");
    let refused = |more: &[&str], words: &[&str]| {
        fails(&track(&clip, &out, more), 2, words);
        assert!(!out.exists(), "{more:?}");
    };
    let objects = |set: &str, words: &[&str]| refused(&["--detect", "objects", "--set", set], words);
    refused(&["--detect", "objects"], &["`model` of `objects`", "--set model=yolox_nano.onnx"]);
    objects("model=/nowhere/net.onnx", &["/nowhere/net.onnx", "cannot be read"]);
    objects(&format!("model={}", folder.path().display()), &["`model` of `objects`"]);
    refused(
        &["--box", "10,10,20,20", "--tracker", "fear-xs"],
        &["`model` of `fear-xs`", "--set model=networks/fear_xs"],
    );
    refused(&["--box", "10,10,20,20", "--tracker", "siamese"], &["`model` of `siamese`", "TOML"]);
    let siamese = |toml: &str, words: &[&str]| {
        let model = format!("model={}", file("net.toml", toml.as_bytes()));
        refused(&["--box", "10,10,20,20", "--tracker", "siamese", "--set", &model], words);
    };
    siamese("serch = 'a.onnx'", &["net.toml", "serch"]);
    let config = "[config]\ntemplate_side_px = 16\nsearch_side_px = 32\nanswer_side = 9\nstride_px = 2.0\nchannels = 'rgb'\n\
                  scores = 'sigmoid'\ncontext = 0.5\nwindow = 0.4\npenalty = 0.1\nrate = 0.3\n";
    siamese(&format!("search = 'a.onnx'\n{config}window_size = 3"), &["net.toml", "window_size"]);
    siamese(&format!("search = 'a.onnx'\n{}", config.replace("0.5", "9.5")), &["context", "between 0 and 4"]);
    siamese(&format!("search = 'a.onnx'\n{config}"), &["a.onnx", "cannot be read"]);
    if !cfg!(any(feature = "onnxruntime", feature = "rten")) {
        let model = format!("model={}", squares());
        objects(&model, &["squares.onnx", "--features onnxruntime", "--features rten"]);
        return;
    }
    objects(&format!("model={}", file("text.onnx", b"no network at all")), &["text.onnx", "get the file again"]);
    let whole = std::fs::read(squares()).unwrap();
    objects(&format!("model={}", file("cut.onnx", &whole[..whole.len() / 2])), &["cut.onnx", "get the file again"]);
    if !runs_networks() {
        return;
    }
    // Without its description it is taken for nothing known.
    let bare = file("bare.onnx", &whole);
    objects(&format!("model={bare}"), &["bare.onnx", "the shape of its input"]);
    file("bare.toml", b"image_px = [128, 96]");
    objects(&format!("model={bare}"), &["its output is 1 x 192 x 7", "family", "bare.toml"]);
    let model = format!("model={}", squares());
    refused(
        &["--detect", "objects", "--set", &model, "--set", "classes=red,green"],
        &["`classes` of `objects`", "no `green`", "red, blue"],
    );
    refused(
        &["--detect", "objects", "--set", &model, "--set", "runtime.library=tflite"],
        &["runtime.library", "auto, onnxruntime, rten"],
    );
    if cfg!(feature = "rten") {
        let description = format!("template = {:?}\nsearch = {:?}\n{config}", squares(), squares());
        siamese(&description, &["squares.onnx is no usable network", "layout", "in the description"]);
    }
}

#[test]
fn an_export_is_followed_without_a_description() {
    if !runs_networks() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path());
    // YOLOv8 on 64 x 64: the frame of 128 x 96 lies in its rows 8 to 55. One box, where the blue square is.
    let mut answer = vec![0.0; 6 * 84];
    for (number, value) in [50.0, 46.0, 4.0, 4.0, 0.1, 0.9].into_iter().enumerate() {
        answer[number * 84] = value;
    }
    let model = folder.path().join("mine.onnx");
    let names = [("names", "{0: 'red', 1: 'blue'}")];
    std::fs::write(&model, pursuit_testkit::network_that_answers((64, 64), &[1, 6, 84], &answer, &names)).unwrap();
    let set = format!("model={}", model.display());
    let detect = ["--detect", "objects", "--many", "--set", &set];
    let out = folder.path().join("out");
    let found = track(&clip, &out, &[&detect[..], &["--device", "cpu"]].concat());
    assert!(found.status.success(), "{}", stderr(&found));
    let said = stderr(&found);
    let taken = "mine.onnx is taken for YOLOv8";
    assert!(said.contains(taken) && said.contains("2 classes (red, blue)") && said.lines().count() == 1, "{said}");
    let rows = rows(&out.join("trajectory.csv"));
    let last = rows.last().unwrap();
    let number = |key: &str| last[key].parse::<f64>().unwrap();
    assert!((number("x") - 96.0).abs() < 1.0 && (number("y") - 72.0).abs() < 1.0, "{last:?}");
    assert_eq!((last["class"].as_str(), last["frame"].as_str()), ("blue", "9"));

    // A device that nothing here has is said, and the run goes on.
    let elsewhere = if cfg!(target_os = "macos") { "cuda" } else { "coreml" };
    let other = track(&clip, &folder.path().join("other"), &[&detect[..], &["--device", elsewhere]].concat());
    assert!(other.status.success(), "{}", stderr(&other));
    assert!(stderr(&other).contains("it runs on the processor"), "{}", stderr(&other));
    let config = folder.path().join("run.toml");
    std::fs::write(&config, format!("device = {elsewhere:?}\n")).unwrap();
    let by_file = ["--config", config.to_str().unwrap(), "--box", "92,68,8,8"];
    let built_in = track(&clip, &folder.path().join("built-in"), &by_file);
    assert!(
        built_in.status.success() && stderr(&built_in).contains("nobody here runs a network by file"),
        "{}",
        stderr(&built_in)
    );
    let nothing = track(&clip, &out, &["--device", "tpu"]);
    assert!(nothing.status.code() == Some(2) && stderr(&nothing).contains("openvino"), "{}", stderr(&nothing));
}

#[test]
fn a_network_for_looks_runs_on_the_device_that_is_named() {
    if !runs_networks() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path());
    let model = folder.path().join("looks.onnx");
    std::fs::write(&model, pursuit_testkit::network_that_answers((16, 32), &[1, 4], &[1.0, 0.0, 0.0, 2.0], &[]))
        .unwrap();
    let file = format!("many.embedding.network.file={}", model.display());
    let sets = ["--detect", "motion", "--many", "--set", "many.embedding.model=network", "--set", &file];
    let run = |device: &str| {
        let found = track(&clip, &folder.path().join(device), &[&sets[..], &["--device", device]].concat());
        assert!(found.status.success(), "{}", stderr(&found));
        stderr(&found)
    };
    let said = run("cpu");
    assert!(!said.contains("on the processor"), "{said}");
    // Nothing here has that one: so it was asked for.
    let elsewhere = if cfg!(target_os = "macos") { "cuda" } else { "coreml" };
    let said = run(elsewhere);
    assert!(said.contains("it runs on the processor") && !said.contains("nobody here"), "{said}");
}

#[test]
fn a_network_draws_the_masks_of_any_tracker() {
    if !runs_networks() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path());
    // The mean of red in cells of two pixels, from −1 on.
    let weights: Vec<f32> = (0..12).map(|k| if k < 4 { 0.25 } else { 0.0 }).collect();
    let network = pursuit_testkit::NetworkFile::default()
        .input("input", &[1, 3, 24, 24])
        .floats("weights", &[1, 3, 2, 2], &weights)
        .cells("input", "weights", "logits", 2)
        .output("logits", 4);
    let file = folder.path().join("red.onnx");
    std::fs::write(&file, network.to_bytes()).unwrap();
    std::fs::write(file.with_extension("toml"), "values = 'logits'").unwrap();
    let out = folder.path().join("out");
    let model = format!("mask.network.model={}", file.display());
    let sets = ["--set", "mask.model=network", "--set", &model];
    let boxed = ["--box", "16,32,8,8", "--tracker", "mosse", "--set", "policy.model=always", "--format", "jsonl"];
    let found = track(&clip, &out, &[&boxed[..], &sets].concat());
    assert!(found.status.success(), "{}", stderr(&found));
    let text = std::fs::read_to_string(out.join("trajectory.jsonl")).unwrap();
    let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    let mask = &last["mask"];
    assert_eq!(mask["size"], serde_json::json!([96, 128]), "{last}");
    let coco: pursuit::geometry::CocoMask = serde_json::from_value(mask.clone()).unwrap();
    let mask = coco.mask().unwrap();
    let square =
        pursuit::geometry::Mask::from_fn(pursuit::geometry::Size::new(128, 96), |x, y| x / 8 == 2 && y / 8 == 4);
    assert!(mask.iou(&square) > 0.7, "{}", mask.iou(&square));
    // What is no network is said before anything is written.
    let other = folder.path().join("other");
    std::fs::write(&file, b"no network at all").unwrap();
    fails(&track(&clip, &other, &[&boxed[..], &sets].concat()), 2, &["`network.model` of `mask`", "red.onnx"]);
    assert!(!other.exists());
}

#[test]
fn a_siamese_network_that_draws_has_masks_without_a_model_of_masks() {
    if !runs_networks() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let clip = clip(folder.path());
    let network = pursuit_testkit::SiameseFile::bytes(|file| file.node("Identity", &["drawn"], "masks", &[]));
    std::fs::write(folder.path().join("net.onnx"), network).unwrap();
    let description = folder.path().join("net.toml");
    std::fs::write(&description, pursuit_testkit::SiameseFile::description("net.onnx")).unwrap();
    let out = folder.path().join("out");
    let model = format!("model={}", description.display());
    let more = ["--box", "16,32,8,8", "--tracker", "siamese", "--set", &model, "--format", "jsonl,coco,vot"];
    let found = track(&clip, &out, &more);
    assert!(found.status.success(), "{}", stderr(&found));
    let text = std::fs::read_to_string(out.join("trajectory.jsonl")).unwrap();
    let frames: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let size = pursuit::geometry::Size::new(128, 96);
    let square = pursuit::geometry::Mask::from_fn(size, |x, y| x / 8 == 2 && y / 8 == 4);
    assert_eq!((frames.len(), frames[0].get("mask")), (10, None), "the frame that starts has none");
    for frame in &frames[1..] {
        let coco: pursuit::geometry::CocoMask = serde_json::from_value(frame["mask"].clone()).unwrap();
        let overlap = coco.mask().unwrap().iou(&square);
        assert!(frame["state"] == "tracking" && overlap > 0.7, "{overlap}: {frame}");
    }
    let regions = std::fs::read_to_string(out.join("regions.txt")).unwrap();
    assert!(regions.lines().skip(1).all(|line| line.starts_with('m')), "{regions}");
    let coco = std::fs::read_to_string(out.join("annotations.json")).unwrap();
    assert_eq!(coco.matches("\"counts\"").count(), 9, "{coco}");
    // Its masks and no others, of a network that says so.
    let other = folder.path().join("other");
    let text = std::fs::read_to_string(&description).unwrap().replace("mask_side = 16", "mask_side = 63");
    std::fs::write(&description, text).unwrap();
    fails(&track(&clip, &other, &more), 2, &["net.onnx", "no mask of [1, 3969, 9, 9]", "mask_side"]);
    assert!(!other.exists());
}
