//! Networks that draw masks, written here as ONNX files whose answers an obvious twin computes: one of a picture, and an encoder with a
//! decoder that is asked by a box.
#![cfg(any(feature = "rten", feature = "onnxruntime"))]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test may panic, and be told by the environment where a library is"
)]

use pursuit_geometry::BBox;
use pursuit_imaging::{Image, Rgb8};
use pursuit_inference::onnx::{Backend, OnnxOptions};
use pursuit_inference::segmentation::SegmentationNetwork;
use pursuit_testkit::NetworkFile;
use std::path::{Path, PathBuf};

/// Side of the encoder's picture, of a cell of its embedding, and cells of the mask.
const SIDE: usize = 64;
const CELL: usize = 8;
const MASK: usize = 32;
const MEAN: [f64; 3] = [123.675, 116.28, 103.53];
const DEVIATION: [f64; 3] = [58.395, 57.12, 57.375];
/// How much red is above its mean, less half of green and blue, is the target.
const RED: [f32; 3] = [1.0, -0.5, -0.5];
const ENOUGH: f64 = 0.9;

/// The libraries of this build; onnxruntime where `PURSUIT_ONNXRUNTIME` names it.
fn ways() -> Vec<OnnxOptions> {
    let mut ways = Vec::new();
    if cfg!(feature = "rten") {
        ways.push(OnnxOptions { backend: Backend::Rten, ..OnnxOptions::default() });
    }
    match std::env::var_os("PURSUIT_ONNXRUNTIME").filter(|_| cfg!(feature = "onnxruntime")) {
        Some(library) => ways.push(OnnxOptions { library: Some(library.into()), ..OnnxOptions::default() }),
        None => println!("skipped: onnxruntime, for want of PURSUIT_ONNXRUNTIME"),
    }
    ways
}

/// Means of cells, plane by plane.
fn means(planes: usize, side: usize) -> Vec<f32> {
    let weight = |k: usize| {
        let (out, of) = (k / (planes * side * side), k / (side * side) % planes);
        if out == of { 1.0 / (side * side) as f32 } else { 0.0 }
    };
    (0..planes * planes * side * side).map(weight).collect()
}

/// The mean colour of each cell.
fn encoder() -> NetworkFile {
    NetworkFile::default()
        .input("image", &[1, 3, SIDE, SIDE])
        .floats("weights", &[3, 3, CELL, CELL], &means(3, CELL))
        .cells("image", "weights", "image_embeddings", CELL as u64)
        .output("image_embeddings", 4)
}

/// What is red enough and in the box, as the second of three masks; whatever the inputs without use are but what they should be spoils it.
fn decoder(qualities: [f32; 3]) -> NetworkFile {
    let centers: Vec<f32> = (0..MASK).map(|k| (k as f32 + 0.5) * (SIDE / MASK) as f32).collect();
    let corner = |file: NetworkFile, label: &str, x: &str, y: &str| {
        let [is, as_float, column, weighed, point] =
            ["is", "float", "column", "weighed", "point"].map(|n| format!("{n}{label}"));
        file.node("Equal", &["point_labels", label], &is, &[])
            .node("Cast", &[&is], &as_float, &[("to", 1)])
            .node("Unsqueeze", &[&as_float, "last"], &column, &[])
            .node("Mul", &["point_coords", &column], &weighed, &[])
            .node("ReduceSum", &[&weighed, "points"], &point, &[("keepdims", 1)])
            .node("Gather", &[&point, "first"], x, &[("axis", 2)])
            .node("Gather", &[&point, "second"], y, &[("axis", 2)])
    };
    let file = NetworkFile::default()
        .input("image_embeddings", &[1, 3, SIDE / CELL, SIDE / CELL])
        .input("point_coords", &[1, 0, 2])
        .input("point_labels", &[1, 0])
        .input("mask_input", &[1, 1, MASK, MASK])
        .input("has_mask_input", &[1])
        .input("orig_im_size", &[2])
        .floats("red", &[1, 3, 1, 1], &RED)
        .floats("enough", &[], &[ENOUGH as f32])
        .floats("label2", &[], &[2.0])
        .floats("label3", &[], &[3.0])
        .floats("xs", &[1, 1, 1, MASK], &centers)
        .floats("ys", &[1, 1, MASK, 1], &centers)
        .floats("scales", &[4], &[1.0, 1.0, 4.0, 4.0])
        .floats("side", &[], &[SIDE as f32])
        .floats("much", &[], &[1000.0])
        .floats("said", &[1, 3], &qualities)
        .wholes("last", &[2])
        .wholes("points", &[1])
        .wholes("first", &[0])
        .wholes("second", &[1]);
    corner(corner(file, "label2", "x0", "y0"), "label3", "x1", "y1")
        .cells("image_embeddings", "red", "coarse", 1)
        .node("Resize", &["coarse", "", "scales"], "fine", &[])
        .node("Sub", &["fine", "enough"], "redness", &[])
        .node("Sub", &["xs", "x0"], "after", &[])
        .node("Sub", &["x1", "xs"], "before", &[])
        .node("Sub", &["ys", "y0"], "below", &[])
        .node("Sub", &["y1", "ys"], "above", &[])
        .node("Min", &["after", "before", "below", "above"], "inside", &[])
        .node("ReduceMax", &["orig_im_size"], "width", &[("keepdims", 0)])
        .node("Sub", &["width", "side"], "other", &[])
        .node("ReduceMax", &["mask_input"], "given", &[("keepdims", 0)])
        .node("Add", &["other", "given"], "wrong", &[])
        .node("Add", &["wrong", "has_mask_input"], "wrongs", &[])
        .node("Mul", &["wrongs", "much"], "spoilt", &[])
        .node("Min", &["redness", "inside"], "both", &[])
        .node("Add", &["both", "spoilt"], "good", &[])
        .node("Neg", &["good"], "bad", &[])
        .listed("Identity", &["inside"], "box", &[])
        .node("Concat", &["box", "good", "bad"], "low_res_masks", &[("axis", 1)])
        .node("Add", &["said", "spoilt"], "iou_predictions", &[])
        .output("iou_predictions", 2)
        .output("low_res_masks", 4)
}

/// The folder with both files.
fn pair(folder: &Path, decoder: &NetworkFile) -> PathBuf {
    std::fs::write(folder.join("small_encoder.onnx"), encoder().to_bytes()).unwrap();
    std::fs::write(folder.join("small_decoder.onnx"), decoder.to_bytes()).unwrap();
    folder.to_owned()
}

/// Grey, with a red disk and a red bar far from it.
fn frame(width: usize, height: usize, (cx, cy, radius): (f64, f64, f64)) -> Image<Rgb8> {
    Image::from_fn(width, height, |x, y| {
        let (u, v) = (x as f64 + 0.5 - cx, y as f64 + 0.5 - cy);
        if u.hypot(v) < radius || x < width / 12 {
            [230, 40, 50]
        } else {
            [120, 115 + (x % 7) as u8, 100 + (y % 5) as u8]
        }
    })
    .unwrap()
}

/// A window of an image brought to a size, bilinear, in grey levels; beyond the image is the mean.
fn resized(
    image: &Image<Rgb8>,
    [left, top, width, height]: [i64; 4],
    (columns, rows): (usize, usize),
) -> Vec<[f64; 3]> {
    let pixel = |x: i64, y: i64, c: usize| {
        let (x, y) = (left + x.clamp(0, width - 1), top + y.clamp(0, height - 1));
        let inside = usize::try_from(x).ok().zip(usize::try_from(y).ok());
        inside.and_then(|(x, y)| image.view().get(x, y).copied()).map_or(MEAN[c].round(), |p| f64::from(p[c]))
    };
    let at = |i: usize, n: usize, side: i64| (i as f64 + 0.5) * side as f64 / n as f64 - 0.5;
    let mut out = Vec::new();
    for y in 0..rows {
        for x in 0..columns {
            let (px, py) = (at(x, columns, width), at(y, rows, height));
            let (i, j) = (px.floor(), py.floor());
            let (u, v, i, j) = (px - i, py - j, i as i64, j as i64);
            out.push([0, 1, 2].map(|c| {
                let above = (1.0 - u) * pixel(i, j, c) + u * pixel(i + 1, j, c);
                let below = (1.0 - u) * pixel(i, j + 1, c) + u * pixel(i + 1, j + 1, c);
                ((1.0 - v) * above + v * below).round()
            }));
        }
    }
    out
}

/// Between the cells of a grid that is `cells` wide and high, at a place counted in cells from its edge.
fn between(grid: &dyn Fn(usize, usize) -> f64, (columns, rows): (usize, usize), x: f64, y: f64) -> f64 {
    let (x, y) = ((x - 0.5).clamp(0.0, columns as f64 - 1.0), (y - 0.5).clamp(0.0, rows as f64 - 1.0));
    let (i, j) = (x.floor(), y.floor());
    let (u, v, i, j) = (x - i, y - j, i as usize, j as usize);
    let (k, l) = ((i + 1).min(columns - 1), (j + 1).min(rows - 1));
    (1.0 - v) * ((1.0 - u) * grid(i, j) + u * grid(k, j)) + v * ((1.0 - u) * grid(i, l) + u * grid(k, l))
}

fn redness(color: [f64; 3]) -> f64 {
    [0, 1, 2].map(|c| (color[c] - MEAN[c]) / DEVIATION[c] * f64::from(RED[c])).iter().sum()
}

/// What the decoder's second mask says of each pixel of the frame, by definition.
fn twin(image: &Image<Rgb8>, bbox: &BBox, window: [i64; 4]) -> Vec<f64> {
    let [left, top, width, height] = window;
    let ratio = SIDE as f64 / width.max(height) as f64;
    let size = [width, height].map(|side| (side as f64 * ratio + 0.5) as usize);
    let shown = resized(image, window, (size[0], size[1]));
    let mut cells = vec![0.0; (SIDE / CELL) * (SIDE / CELL)];
    for y in 0..size[1] {
        for x in 0..size[0] {
            cells[y / CELL * (SIDE / CELL) + x / CELL] += redness(shown[y * size[0] + x]) / (CELL * CELL) as f64;
        }
    }
    let (across, down) = (size[0] as f64 / width as f64, size[1] as f64 / height as f64);
    let clipped = bbox.clipped_to(image.size()).unwrap();
    let corner = |x: f64, y: f64| ((x - left as f64) * across, (y - top as f64) * down);
    let ((x0, y0), (x1, y1)) = (corner(clipped.left(), clipped.top()), corner(clipped.right(), clipped.bottom()));
    let finer = SIDE / CELL * MASK / SIDE;
    let mask = |i: usize, j: usize| {
        let (x, y) = (2.0 * (i as f64 + 0.5), 2.0 * (j as f64 + 0.5));
        let red = cells[j / (MASK * CELL / SIDE) * (SIDE / CELL) + i / (MASK * CELL / SIDE)] - ENOUGH;
        red.min(x - x0).min(x1 - x).min(y - y0).min(y1 - y)
    };
    assert_eq!(finer, MASK * (SIDE / CELL) / SIDE);
    let mut said = Vec::new();
    for y in 0..image.height() {
        for x in 0..image.width() {
            let (i, j) = corner(x as f64 + 0.5, y as f64 + 0.5);
            let inside = (left..left + width).contains(&(x as i64)) && (top..top + height).contains(&(y as i64));
            let cells = |at: f64| at * MASK as f64 / SIDE as f64;
            said.push(if inside { between(&mask, (MASK, MASK), cells(i), cells(j)) } else { -9.0 });
        }
    }
    said
}

/// Compares all pixels but those that the twin is in doubt of.
fn compare(found: &[bool], wanted: &[f64], what: &str) {
    assert_eq!(found.len(), wanted.len());
    let clear: Vec<(usize, bool)> =
        wanted.iter().enumerate().filter(|(_, v)| v.abs() > 0.03).map(|(k, v)| (k, *v > 0.0)).collect();
    let off = clear.iter().filter(|(k, is)| found[*k] != *is).count();
    let set = clear.iter().filter(|(_, is)| *is).count();
    assert!(set > 40 && set * 10 < 9 * clear.len(), "{what}: {set} of {} pixels are the target's", clear.len());
    assert!(off == 0 && 20 * clear.len() > 19 * wanted.len(), "{what}: {off} of {} differ", clear.len());
}

fn segmented(network: &mut SegmentationNetwork, image: &Image<Rgb8>, bbox: &BBox) -> Vec<bool> {
    let mut cells = Vec::new();
    network.segment(image.view(), bbox, (0..image.width(), 0..image.height()), &mut cells).unwrap();
    cells
}

#[test]
fn a_box_asks_for_the_best_mask_in_the_frames_own_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let model = pair(folder.path(), &decoder([0.3, 0.9, 0.5]));
    for way in ways() {
        let mut network = SegmentationNetwork::open(&model, &way).unwrap();
        assert!(network.taken_for().contains("image encoder of 64 x 64"), "{}", network.taken_for());
        // As large as the picture, smaller and larger, wide and high; and the target at every border.
        for (width, height) in [(64, 48), (128, 96), (100, 75), (75, 100), (40, 30), (301, 97)] {
            let (w, h, radius) = (width as f64, height as f64, 0.3 * width.min(height) as f64);
            for (cx, cy) in
                [(0.55 * w, 0.5 * h), (w - 2.0, 0.4 * h), (0.5 * w, h), (w, h), (0.6 * w, 0.0), (0.2 * w, 0.5 * h)]
            {
                let image = frame(width, height, (cx, cy, radius));
                let bbox = BBox::from_center_size(pursuit_geometry::Point::new(cx, cy), 2.1 * radius, 1.9 * radius);
                let found = segmented(&mut network, &image, &bbox);
                let wanted = twin(&image, &bbox, [0, 0, width as i64, height as i64]);
                compare(&found, &wanted, &format!("{width} x {height}, {cx}, {cy}"));
            }
        }
        // A window of the frame is the same, cut.
        let image = frame(128, 96, (80.0, 40.0, 20.0));
        let bbox = BBox::from_ltwh(60.0, 20.0, 40.0, 40.0);
        let (all, mut cells) = (segmented(&mut network, &image, &bbox), Vec::new());
        network.segment(image.view(), &bbox, (50..90, 30..96), &mut cells).unwrap();
        let cut: Vec<bool> = (30..96).flat_map(|y| all[y * 128 + 50..y * 128 + 90].to_vec()).collect();
        assert_eq!(cells, cut);
        // What lies elsewhere is nobody's.
        for nowhere in [BBox::from_ltwh(-90.0, 3.0, 9.0, 9.0), BBox::from_ltwh(f64::NAN, 3.0, 9.0, 9.0)] {
            network.segment(image.view(), &nowhere, (0..10, 0..10), &mut cells).unwrap();
            assert!(cells.len() == 100 && cells.iter().all(|c| !c));
        }
        for vast in [BBox::from_ltwh(-1e9, -1e9, 2e9, 2e9), BBox::from_ltwh(63.9, 30.0, 1e-6, 1e-6)] {
            network.segment(image.view(), &vast, (0..128, 0..96), &mut cells).unwrap();
            assert_eq!(cells.len(), 128 * 96);
        }
    }
}

#[test]
fn a_description_names_the_files_and_shows_less_of_the_frame() {
    let folder = tempfile::tempdir().unwrap();
    pair(folder.path(), &decoder([0.3, 0.9, 0.5]));
    let toml = folder.path().join("mine.toml");
    std::fs::write(&toml, "encoder = 'small_encoder.onnx'\ndecoder = 'small_decoder.onnx'\ncontext = 0.5").unwrap();
    for way in ways() {
        let mut network = SegmentationNetwork::open(&toml, &way).unwrap();
        // A small target in a large frame: shown large, it has finer borders.
        let (width, height) = (400, 300);
        for (cx, cy) in [(200.0, 150.0), (396.0, 150.0), (150.0, 2.0)] {
            let image = frame(width, height, (cx, cy, 14.0));
            let bbox = BBox::from_ltwh(cx - 15.0, cy - 14.0, 30.0, 28.0);
            let found = segmented(&mut network, &image, &bbox);
            let (left, right) = ((cx - 30.0_f64).max(0.0), (cx + 30.0_f64).min(400.0));
            let (top, bottom) = ((cy - 28.0_f64).max(0.0), (cy + 28.0_f64).min(300.0));
            let window = [left, top, right - left, bottom - top].map(|v| v as i64);
            let wanted = twin(&image, &bbox, window);
            let within: Vec<usize> = (0..width * height)
                .filter(|k| {
                    (left..right).contains(&((k % width) as f64)) && (top..bottom).contains(&((k / width) as f64))
                })
                .collect();
            assert!(found.iter().enumerate().all(|(k, is)| !is || within.contains(&k)));
            let of = |k: &usize| (found[*k], wanted[*k]);
            let (found, wanted): (Vec<bool>, Vec<f64>) = within.iter().map(of).unzip();
            compare(&found, &wanted, &format!("{cx}, {cy}"));
        }
    }
}

#[test]
fn the_mask_that_is_said_to_be_best_is_taken() {
    let image = frame(64, 48, (36.0, 24.0, 14.0));
    let bbox = BBox::from_ltwh(21.0, 11.0, 30.0, 26.0);
    for way in ways() {
        let area = |qualities: [f32; 3]| {
            let folder = tempfile::tempdir().unwrap();
            let model = pair(folder.path(), &decoder(qualities));
            let mut network = SegmentationNetwork::open(&model, &way).unwrap();
            segmented(&mut network, &image, &bbox).iter().filter(|c| **c).count()
        };
        // The first mask is the box, the third what is not the target; not-a-number is no quality.
        let (whole, good, rest) = (area([0.9, 0.3, 0.5]), area([0.3, 0.9, 0.5]), area([0.3, 0.5, 0.9]));
        assert_eq!(whole, 30 * 26);
        assert!(good < whole && good > 300 && good + rest > 64 * 48 - 60, "{whole}, {good}, {rest}");
        assert_eq!(area([0.3, f32::NAN, 0.1]), whole);
        assert_eq!(area([f32::NAN, -0.5, -0.6]), good);
        assert_eq!(area([f32::NAN; 3]), 0);
    }
}

/// What is red enough in the cells of a picture of 48 x 32: 12 x 8 logits, and what is made of them.
fn plain(make: impl Fn(NetworkFile) -> NetworkFile) -> NetworkFile {
    let weights: Vec<f32> = (0..3 * 16).map(|k| RED[k / 16] / 16.0).collect();
    let file = NetworkFile::default()
        .floats("weights", &[1, 3, 4, 4], &weights)
        .floats("enough", &[], &[ENOUGH as f32])
        .floats("nothing", &[], &[f32::NAN])
        .floats("zero", &[], &[0.0]);
    make(file)
}

fn logits(file: NetworkFile) -> NetworkFile {
    file.input("input", &[0, 3, 0, 0]).cells("input", "weights", "red", 4).node(
        "Sub",
        &["red", "enough"],
        "logits",
        &[],
    )
}

#[test]
fn a_network_of_one_picture_draws_the_region_that_it_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("net.onnx");
    let small = "image_px = [48, 32]\n";
    let variants: [(&str, NetworkFile, String); 6] = [
        ("logits", plain(|f| logits(f).output("logits", 4)), small.into()),
        (
            "probabilities",
            plain(|f| logits(f).node("Sigmoid", &["logits"], "mask", &[]).output("mask", 4)),
            small.into(),
        ),
        (
            "two planes",
            plain(|f| {
                logits(f)
                    .node("Neg", &["logits"], "ground", &[])
                    .node("Concat", &["ground", "logits"], "both", &[("axis", 1)])
                    .output("both", 4)
            }),
            small.into(),
        ),
        (
            "three planes, the target's first, pixel by pixel",
            plain(|f| {
                logits(f)
                    .node("Neg", &["logits"], "ground", &[])
                    .node("Sub", &["ground", "enough"], "else", &[])
                    .node("Concat", &["logits", "ground", "else"], "planes", &[("axis", 1)])
                    .listed("Transpose", &["planes"], "pixels", &[("perm", &[0, 2, 3, 1])])
                    .output("pixels", 4)
            }),
            format!("{small}plane = 0"),
        ),
        (
            "pixels in, no batch, nothing of its own but a mask of two axes",
            plain(|f| {
                let normal = f
                    .input("input", &[32, 48, 3])
                    .floats("mean", &[3], &MEAN.map(|v| v as f32))
                    .floats("deviation", &[3], &DEVIATION.map(|v| v as f32))
                    .wholes("batch", &[0])
                    .wholes("ones", &[0, 1])
                    .node("Sub", &["input", "mean"], "less", &[])
                    .node("Div", &["less", "deviation"], "normal", &[])
                    .node("Unsqueeze", &["normal", "batch"], "one", &[])
                    .listed("Transpose", &["one"], "planes", &[("perm", &[0, 3, 1, 2])])
                    .cells("planes", "weights", "red", 4);
                let logits = normal.node("Sub", &["red", "enough"], "logits", &[]);
                logits.node("Squeeze", &["logits", "ones"], "mask", &[]).output("mask", 2)
            }),
            String::new(),
        ),
        (
            "blue before red, said so",
            NetworkFile::default()
                .input("input", &[1, 3, 32, 48])
                .floats("weights", &[1, 3, 4, 4], &(0..48).map(|k| RED[2 - k / 16] / 16.0).collect::<Vec<_>>())
                .floats("enough", &[], &[ENOUGH as f32])
                .cells("input", "weights", "red", 4)
                .node("Sub", &["red", "enough"], "logits", &[])
                .output("logits", 4),
            "channels = 'bgr'\nmean = [103.53, 116.28, 123.675]\ndeviation = [57.375, 57.12, 58.395]".into(),
        ),
    ];
    let image = frame(90, 70, (50.0, 33.0, 15.0));
    for (what, network, toml) in &variants {
        std::fs::write(&file, network.to_bytes()).unwrap();
        std::fs::write(folder.path().join("net.toml"), toml).unwrap();
        for way in ways() {
            let mut network = SegmentationNetwork::open(&file, &way).unwrap();
            let words = network.taken_for();
            assert!(words.contains("48 x 32") && words.contains("12 x 8"), "{what}: {words}");
            for (x, y) in [(36.0, 19.0), (80.0, 60.0), (-8.0, 50.0)] {
                let bbox = BBox::from_ltwh(x, y, 28.0, 28.0);
                // A quarter of the box at each side, beyond the frame too, stretched over the picture.
                let window = [x as i64 - 7, y as i64 - 7, 42, 42];
                let shown = resized(&image, window, (48, 32));
                let cell = |i: usize, j: usize| {
                    let of = |k: usize| redness(shown[(4 * j + k / 4) * 48 + 4 * i + k % 4]);
                    (0..16).map(of).sum::<f64>() / 16.0 - ENOUGH
                };
                let found = segmented(&mut network, &image, &bbox);
                let (mut off, mut set) = (0, 0);
                for (k, is) in found.iter().enumerate() {
                    let (px, py) = ((k % 90) as f64 + 0.5, (k / 90) as f64 + 0.5);
                    let (u, v) = ((px - window[0] as f64) / 42.0 * 12.0, (py - window[1] as f64) / 42.0 * 8.0);
                    if !((0.0..12.0).contains(&u) && (0.0..8.0).contains(&v)) {
                        assert!(!is, "{what}: beyond what was shown");
                        continue;
                    }
                    // A probability between cells crosses one half elsewhere than its logit crosses 0.
                    let squashed = |i: usize, j: usize| 1.0 / (1.0 + (-cell(i, j)).exp()) - 0.5;
                    let said = match *what {
                        "probabilities" => between(&squashed, (12, 8), u, v),
                        _ => between(&cell, (12, 8), u, v),
                    };
                    off += usize::from(said.abs() > 0.03 && *is != (said > 0.0));
                    set += usize::from(*is);
                }
                assert_eq!(off, 0, "{what} at {x}, {y}");
                assert!(x != 36.0 || (500..900).contains(&set), "{what}: {set}");
            }
        }
    }
}

#[test]
fn what_is_no_number_is_nobodys() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("net.onnx");
    let broken = plain(|f| logits(f).node("Mul", &["logits", "nothing"], "mask", &[]).output("mask", 4));
    std::fs::write(&file, broken.to_bytes()).unwrap();
    std::fs::write(folder.path().join("net.toml"), "image_px = [48, 32]\nvalues = 'logits'").unwrap();
    let image = frame(90, 70, (50.0, 33.0, 15.0));
    for way in ways() {
        let mut network = SegmentationNetwork::open(&file, &way).unwrap();
        let found = segmented(&mut network, &image, &BBox::from_ltwh(36.0, 19.0, 28.0, 28.0));
        assert!(found.len() == 90 * 70 && found.iter().all(|is| !is));
    }
}

#[test]
fn answers_that_are_no_probabilities_after_all_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("net.onnx");
    // From 0 to 1 on whatever a picture of mean and noise makes, and beyond on plain red.
    let steep = plain(|f| {
        f.input("input", &[1, 3, 32, 48])
            .cells("input", "weights", "red", 4)
            .floats("shift", &[], &[-1.7])
            .node("Add", &["red", "shift"], "less", &[])
            .node("Relu", &["less"], "some", &[])
            .floats("ten", &[], &[10.0])
            .node("Mul", &["some", "ten"], "mask", &[])
            .output("mask", 4)
    });
    std::fs::write(&file, steep.to_bytes()).unwrap();
    let image = frame(90, 70, (50.0, 33.0, 15.0));
    let bbox = BBox::from_ltwh(36.0, 19.0, 28.0, 28.0);
    for way in ways() {
        let mut network = SegmentationNetwork::open(&file, &way).unwrap();
        assert!(network.taken_for().contains("probabilities"));
        let error = network.segment(image.view(), &bbox, (0..90, 0..70), &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("values = \"logits\"") && error.contains("net.toml"), "{error}");
    }
    std::fs::write(folder.path().join("net.toml"), "values = 'logits'").unwrap();
    for way in ways() {
        let mut network = SegmentationNetwork::open(&file, &way).unwrap();
        assert!(segmented(&mut network, &image, &bbox).iter().any(|is| *is));
    }
}

#[test]
fn what_does_not_fit_is_refused_with_what_would() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let refused = |model: &Path, words: &[&str]| {
        for way in ways() {
            let error = SegmentationNetwork::open(model, &way).err().unwrap().to_string();
            words.iter().for_each(|w| assert!(error.contains(w), "{w}: {error}"));
        }
    };
    let of = |network: NetworkFile, toml: &str, words: &[&str]| {
        std::fs::write(at("net.onnx"), network.to_bytes()).unwrap();
        std::fs::write(at("net.toml"), toml).unwrap();
        refused(&at("net.onnx"), words);
    };
    refused(&at("nowhere.onnx"), &["nowhere.onnx", "cannot be read"]);
    refused(&at("nowhere.toml"), &["nowhere.toml", "cannot be read"]);
    of(encoder(), "", &["3 planes", "`plane = …`"]);
    let two = NetworkFile::default().input("a", &[1, 3, 8, 8]).input("b", &[1, 3, 8, 8]);
    of(two.node("Add", &["a", "b"], "c", &[]).output("c", 4), "", &["2 inputs"]);
    let grey = NetworkFile::default().input("a", &[1, 1, 8, 8]).node("Relu", &["a"], "b", &[]).output("b", 4);
    of(grey, "", &["`a` is no picture of three channels"]);
    let number =
        |f: NetworkFile| logits(f).node("ReduceMax", &["logits"], "most", &[("keepdims", 0)]).output("most", 0);
    of(plain(number), "image_px = [48, 32]", &["no mask of the picture"]);
    let three =
        |f: NetworkFile| logits(f).node("Concat", &["logits", "logits", "logits"], "c", &[("axis", 1)]).output("c", 4);
    of(plain(three), "image_px = [48, 32]", &["3 planes", "`plane = …`"]);
    of(plain(three), "image_px = [48, 32]\nplane = 3", &["none is 3"]);
    of(plain(three), "image_pix = [48, 32]", &["net.toml", "image_pix"]);
    of(plain(three), "deviation = [0.0, 1.0, 1.0]", &["net.toml", "deviation"]);
    of(plain(three), "encoder = 'a.onnx'\ndecoder = 'b.onnx'", &["net.toml", "name this description"]);
    of(plain(three), "encoder = 'a.onnx'", &["net.toml", "two names"]);
    of(plain(three), "image_px = [48", &["net.toml", "line 1"]);
    std::fs::write(at("pair.toml"), "context = 1.0").unwrap();
    refused(&at("pair.toml"), &["pair.toml", "names no `encoder`"]);

    let both = folder.path().join("both");
    std::fs::create_dir(&both).unwrap();
    refused(&both, &["0 ONNX files with `encoder`", "0 with `decoder`", "TOML"]);
    let pair = |encoder: &NetworkFile, decoder: &NetworkFile, words: &[&str]| {
        std::fs::write(both.join("encoder.onnx"), encoder.to_bytes()).unwrap();
        std::fs::write(both.join("decoder.onnx"), decoder.to_bytes()).unwrap();
        refused(&both, words);
    };
    let good = decoder([0.1, 0.2, 0.3]);
    let wide = NetworkFile::default().input("image", &[1, 3, 32, 64]).floats("weights", &[3, 3, 8, 8], &means(3, 8));
    let wide = wide.cells("image", "weights", "image_embeddings", 8).output("image_embeddings", 4);
    pair(&wide, &good, &["`image_embeddings` is 1 x 3 x 8 x 8, where [1, 3, 4, 8]", "decoder.onnx"]);
    let coarse =
        NetworkFile::default().input("image", &[1, 3, 64, 64]).floats("weights", &[3, 3, 16, 16], &means(3, 16));
    let coarse = coarse.cells("image", "weights", "image_embeddings", 16).output("image_embeddings", 4);
    pair(&coarse, &good, &["where [1, 3, 4, 4] is given"]);
    pair(&encoder(), &encoder(), &["no input `image_embeddings`, but `image`", "point_coords"]);
    let small = || {
        NetworkFile::default()
            .input("image_embeddings", &[1, 3, 8, 8])
            .input("point_coords", &[1, 0, 2])
            .input("point_labels", &[1, 0])
            .node("ReduceMax", &["point_coords"], "far", &[("keepdims", 0)])
            .node("ReduceMax", &["point_labels"], "most", &[("keepdims", 0)])
            .node("Add", &["far", "most"], "sum", &[])
            .node("Add", &["image_embeddings", "sum"], "masks", &[])
    };
    pair(&encoder(), &small().output("masks", 4), &["3 masks", "how good"]);
    pair(&encoder(), &small().node("Relu", &["masks"], "what", &[]).output("what", 4), &["`what`", "low_res_masks"]);
    let any = small().node("Shape", &["masks"], "shape", &[]).node("ConstantOfShape", &["shape"], "zeros", &[]);
    pair(&encoder(), &any.output("zeros", 4), &["operator `ConstantOfShape`", "onnxsim", "point_coords:1,2,2"]);
    pair(&encoder(), &small().input("prompt", &[1]).output("masks", 4), &["`prompt` that is not known"]);
    std::fs::write(both.join("a_decoder.onnx"), good.to_bytes()).unwrap();
    refused(&both, &["1 ONNX files with `encoder`", "2 with `decoder`"]);
    let toml = "encoder = 'encoder.onnx'\ndecoder = 'a_decoder.onnx'\n";
    std::fs::write(both.join("mine.toml"), format!("{toml}plane = 1")).unwrap();
    refused(&both.join("mine.toml"), &["`plane` is of networks of one picture"]);
    std::fs::write(both.join("mine.toml"), toml).unwrap();
    for way in ways() {
        assert!(SegmentationNetwork::open(&both.join("mine.toml"), &way).is_ok());
    }
}
