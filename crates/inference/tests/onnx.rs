//! Networks by ONNX file. Those of the footage folder beside the checkout are used where it is there.
#![cfg(any(feature = "rten", feature = "onnxruntime"))]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test may panic, and be told by the environment where a library is"
)]

use pursuit_inference::InferenceError;
use pursuit_inference::nanotrack::{NanoTrackV3, Patch};
use pursuit_inference::onnx::{Backend, OnnxOptions, OnnxSiamese, open};
use pursuit_inference::siamese::{AnswerCoding, SiameseNetwork};
use std::path::{Path, PathBuf};

fn models() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/models");
    let found = folder.is_dir().then_some(folder);
    if found.is_none() {
        println!("skipped: networks by file, for want of ../shared/data/models");
    }
    found
}

/// The backends this build has; onnxruntime where `PURSUIT_ONNXRUNTIME` names it.
fn backends() -> Vec<OnnxOptions> {
    let mut backends = Vec::new();
    if cfg!(feature = "rten") {
        backends.push(OnnxOptions { backend: Backend::Rten, ..OnnxOptions::default() });
    }
    match std::env::var_os("PURSUIT_ONNXRUNTIME").filter(|_| cfg!(feature = "onnxruntime")) {
        Some(library) => backends.push(OnnxOptions {
            backend: Backend::OnnxRuntime,
            library: Some(library.into()),
            ..OnnxOptions::default()
        }),
        None => println!("skipped: onnxruntime, for want of PURSUIT_ONNXRUNTIME"),
    }
    backends
}

fn with_shape(options: &OnnxOptions, side: usize) -> OnnxOptions {
    OnnxOptions { shapes: vec![("input".into(), vec![1, 3, side, side])], ..options.clone() }
}

fn write(network: &mut dyn SiameseNetwork, patch: Patch, side: usize) {
    for y in 0..side {
        let plane =
            |value: fn(usize, usize) -> usize| (0..side).map(|x| (value(x, y) % 256) as f32).collect::<Vec<_>>();
        let planes = [plane(|x, _| x * 3), plane(|_, y| y * 2), plane(|x, y| x * y / 40)];
        network.write_row(patch, y, planes.each_ref().map(Vec::as_slice));
    }
}

fn answer(network: &mut dyn SiameseNetwork) -> (Vec<f32>, Vec<f32>) {
    write(network, Patch::Template, 127);
    write(network, Patch::Search, 255);
    let features = network.embed().unwrap();
    network.set_template(&features).unwrap();
    let answer = network.search().unwrap();
    (answer.scores.to_vec(), answer.distances.to_vec())
}

fn worst(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f32::max)
}

#[test]
fn all_ways_of_running_the_default_network_agree() {
    let Some(models) = models() else { return };
    let mut answers = Vec::new();
    for options in backends() {
        let backbone = models.join("nanotrack_v3/nanotrack_backbone.onnx");
        let template = open(&backbone, &with_shape(&options, 127)).unwrap();
        let search = open(&backbone, &options).unwrap();
        let head = open(&models.join("nanotrack_v3/nanotrack_head.onnx"), &options).unwrap();
        assert_eq!(template.outputs()[0].shape, [1, 96, 8, 8]);
        assert_eq!(search.outputs()[0].shape, [1, 96, 16, 16]);
        let mut network = OnnxSiamese::new(Some(template), search, Some(head), &AnswerCoding::Distances).unwrap();
        assert_eq!(network.sides(), NanoTrackV3::new().unwrap().sides());
        answers.push(answer(&mut network));
    }
    let (scores, distances) = answer(&mut NanoTrackV3::new().unwrap());
    for (other_scores, other_distances) in &answers {
        // Ours has its weights in half precision; `nanotrack.rs` compares like with like.
        assert!(worst(&scores, other_scores) < 0.05, "{}", worst(&scores, other_scores));
        assert!(worst(&distances, other_distances) < 0.05, "{}", worst(&distances, other_distances));
    }
    for pair in answers.windows(2) {
        assert!(worst(&pair[0].0, &pair[1].0) < 1e-3 && worst(&pair[0].1, &pair[1].1) < 1e-3);
    }
}

#[test]
fn other_networks_open_and_networks_that_do_not_fit_are_refused() {
    let Some(models) = models() else { return };
    for options in backends() {
        let shape = |n: &str, s: &[usize]| OnnxOptions { shapes: vec![(n.into(), s.to_vec())], ..options.clone() };
        let template = open(&models.join("fear_xs/fear_xs_template.onnx"), &options).unwrap();
        let search = open(&models.join("fear_xs/fear_xs_track.onnx"), &options).unwrap();
        let network = OnnxSiamese::new(Some(template), search, None, &AnswerCoding::Distances).unwrap();
        assert_eq!((network.sides().template, network.sides().search, network.sides().answer), (128, 256, 16));

        let mut yolo = open(&models.join("yolox_nano/yolox_nano.onnx"), &options).unwrap();
        assert_eq!((yolo.outputs().len(), yolo.outputs()[0].shape.as_slice()), (1, &[1, 3549, 85][..]));
        let error = yolo.set_input(0, &[0.0; 3]).unwrap_err().to_string();
        assert!(error.contains("`images`") || error.contains("images of 519168"), "{error}");

        let osnet = models.join("osnet_x025/osnet_x0_25_msmt17.onnx");
        assert_eq!(open(&osnet, &options).unwrap().inputs()[0].shape, [1, 3, 256, 128]);
        assert_eq!(open(&osnet, &shape("input", &[1, 3, 256, 128])).map(drop).map_err(|e| e.to_string()), Ok(()));
        let error = open(&osnet, &shape("image", &[1, 3, 256, 128])).err().unwrap().to_string();
        assert!(error.contains("no input `image`") && error.contains("name one of input"), "{error}");

        let backbone = open(&models.join("nanotrack_v3/nanotrack_backbone.onnx"), &options).unwrap();
        let again = open(&models.join("nanotrack_v3/nanotrack_backbone.onnx"), &options).unwrap();
        let error = OnnxSiamese::new(Some(backbone), again, None, &AnswerCoding::Distances).err().unwrap();
        assert!(matches!(error, InferenceError::Model { .. }), "{error}");
    }
}

#[test]
fn damaged_files_are_refused_and_never_crash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("network.onnx");
    let options = OnnxOptions::default();
    assert!(matches!(open(&path, &options).err(), Some(InferenceError::Read { .. })));
    for bytes in [&b""[..], b"no network at all", &[0xff; 64], &[0x3a, 0x7f, 1, 2]] {
        std::fs::write(&path, bytes).unwrap();
        let error = open(&path, &options).err().unwrap();
        assert!(matches!(error, InferenceError::Model { .. }) && error.to_string().contains("get the file"), "{error}");
    }
    let small = OnnxOptions { max_bytes: 8, ..OnnxOptions::default() };
    std::fs::write(&path, [0; 9]).unwrap();
    assert!(open(&path, &small).err().unwrap().to_string().contains("more than 8 bytes"));

    let Some(models) = models() else { return };
    let whole = std::fs::read(models.join("nanotrack_v3/nanotrack_head.onnx")).unwrap();
    for options in backends() {
        for cut in [10, 1000, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            assert!(open(&path, &options).is_err(), "cut at {cut}");
        }
    }
}

#[test]
fn a_library_that_is_not_there_is_said() {
    let Some(models) = models() else { return };
    if cfg!(feature = "onnxruntime") && std::env::var_os("PURSUIT_ONNXRUNTIME").is_none() {
        let options = OnnxOptions { library: Some("/nowhere/libonnxruntime.so".into()), ..OnnxOptions::default() };
        let error = open(&models.join("nanotrack_v3/nanotrack_head.onnx"), &options).err().unwrap().to_string();
        assert!(error.contains("/nowhere/libonnxruntime.so") && error.contains("PURSUIT_ONNXRUNTIME"), "{error}");
    }
}
