//! Networks that draw masks, written here as ONNX files whose answers an obvious twin computes: one of a picture, and an encoder with a
//! decoder that is asked by a box.
#![cfg(any(feature = "rten", feature = "onnxruntime"))]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test may panic, and be told by the environment where a library is"
)]

#[path = "../ways/mod.rs"]
mod ways;

mod plain;
mod prompted;

use pursuit_geometry::BBox;
use pursuit_imaging::{Image, Rgb8};
use pursuit_inference::segmentation::SegmentationNetwork;
use pursuit_testkit::NetworkFile;
use std::path::{Path, PathBuf};
use ways::ways;

/// Side of the encoder's picture, of a cell of its embedding, and cells of the mask.
const SIDE: usize = 64;
const CELL: usize = 8;
const MASK: usize = 32;
const MEAN: [f64; 3] = [123.675, 116.28, 103.53];
const DEVIATION: [f64; 3] = [58.395, 57.12, 57.375];
/// How much red is above its mean, less half of green and blue, is the target.
const RED: [f32; 3] = [1.0, -0.5, -0.5];
const ENOUGH: f64 = 0.9;

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
