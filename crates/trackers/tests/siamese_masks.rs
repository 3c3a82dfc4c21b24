//! A Siamese tracker whose network draws masks says which pixels are the target's.
#![cfg(feature = "rten")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Mask, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_testkit::{NetworkFile, SiameseFile};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, Recipe, Table, TrackState, Tracker};
use std::path::Path;

const SIZE: Size = Size::new(160, 120);

/// A red triangle of 20 pixels in frame `k`, its box; gone where it is hidden.
fn bbox(k: u64) -> BBox {
    BBox::from_ltwh(60.0 + 2.0 * k as f64, 50.0 + k as f64, 20.0, 20.0)
}

fn is_target(k: u64, x: usize, y: usize) -> bool {
    let (u, v) = (x as f64 + 0.5 - bbox(k).left(), y as f64 + 0.5 - bbox(k).top());
    (0.0..20.0).contains(&u) && (0.0..20.0).contains(&v) && u + v > 16.0
}

fn frame(k: u64, hidden: bool) -> Frame {
    let pixel = |x, y| if !hidden && is_target(k, x, y) { [250, 10, 20] } else { [60, 70, (40 + x / 2) as u8] };
    Frame::new(k, k as f64 / 25.0, Image::from_fn(SIZE.width, SIZE.height, pixel).unwrap())
}

fn write(folder: &Path, mask: impl FnOnce(NetworkFile) -> NetworkFile) {
    std::fs::write(folder.join("net.onnx"), SiameseFile::bytes(mask)).unwrap();
    std::fs::write(folder.join("net.toml"), SiameseFile::description("net.onnx")).unwrap();
}

fn as_drawn(file: NetworkFile) -> NetworkFile {
    file.node("Identity", &["drawn"], "masks", &[])
}

fn recipe(folder: &Path, more: &str) -> Box<dyn Recipe> {
    let table = format!("model = {:?}\nruntime.library = 'rten'\n{more}", folder.join("net.toml"));
    registry::tracker("siamese").unwrap().recipe(&table.parse::<Table>().unwrap()).unwrap()
}

fn start(recipe: &dyn Recipe) -> Box<dyn Tracker> {
    recipe.init(&frame(0, false), bbox(0)).unwrap()
}

fn run(tracker: &mut dyn Tracker, frames: std::ops::Range<u64>, hidden: bool) -> Vec<Estimate> {
    frames.map(|k| tracker.update(&frame(k, hidden)).unwrap()).collect()
}

#[test]
fn the_mask_is_where_the_target_is_seen_and_only_there() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), as_drawn);
    let mut tracker = start(&*recipe(folder.path(), ""));
    for (k, said) in (1..).zip(run(&mut *tracker, 1..15, false)) {
        assert_eq!(said.state, TrackState::Tracking, "{k}: {said:?}");
        let (mask, truth) = (said.mask.unwrap(), Mask::from_fn(SIZE, |x, y| is_target(k, x, y)));
        // Places of the mask are 2.5 pixels apart; the box itself says less.
        let (drawn, whole) = (mask.iou(&truth), Mask::from_bbox(&bbox(k), SIZE).iou(&truth));
        println!("{k}: {drawn:.2}, the box {whole:.2}");
        assert!(drawn > 0.7 && whole < 0.69, "{k}: {drawn}, {whole}");
    }
    let hidden = run(&mut *tracker, 15..200, true);
    assert!(hidden.iter().all(|e| e.mask.is_none() || matches!(e.state, TrackState::Tracking | TrackState::Unsure)));
    assert!(hidden.iter().any(|e| e.state == TrackState::Lost) && hidden.iter().skip(3).all(|e| e.mask.is_none()));
    // And again where it is found again.
    let found = run(&mut *tracker, 1..40, false);
    assert!(found.iter().any(|e| e.state == TrackState::Tracking && e.mask.is_some()));
}

#[test]
fn a_saved_tracker_draws_on_and_another_model_of_masks_replaces_it() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), as_drawn);
    let recipe_of = |more: &str| recipe(folder.path(), more);
    let mut tracker = start(&*recipe_of(""));
    run(&mut *tracker, 1..5, false);
    let mut restored = recipe_of("").restore(&tracker.save().unwrap()).unwrap();
    let said = run(&mut *tracker, 5..9, false);
    assert_eq!(run(&mut *restored, 5..9, false), said);
    assert!(said.iter().all(|e| e.mask.is_some()));
    let by_colors = run(&mut *start(&*recipe_of("mask.model = 'colors'")), 1..9, false);
    let other = by_colors.last().unwrap().mask.as_ref().unwrap();
    assert_ne!(Some(other), said.last().unwrap().mask.as_ref());
    // What draws no masks follows the same boxes.
    let path = folder.path().join("net.toml");
    let without = std::fs::read_to_string(&path).unwrap().replace("mask_side = 16\n", "");
    std::fs::write(&path, without).unwrap();
    let mut plain = start(&*recipe_of(""));
    run(&mut *plain, 1..5, false);
    let boxes = run(&mut *plain, 5..9, false);
    let without: Vec<Estimate> = said.into_iter().map(|e| Estimate { mask: None, ..e }).collect();
    assert_eq!(boxes, without);
}

#[test]
fn a_network_that_draws_no_numbers_draws_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let nothing = |file: NetworkFile| file.floats("nan", &[], &[f32::NAN]).node("Add", &["drawn", "nan"], "masks", &[]);
    write(folder.path(), nothing);
    let said = run(&mut *start(&*recipe(folder.path(), "")), 1..5, false);
    assert!(said.iter().all(|e| e.state == TrackState::Tracking && e.mask.is_none()));
}

#[test]
fn masks_of_another_size_than_described_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), as_drawn);
    let path = folder.path().join("net.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("mask_side = 16", "mask_side = 15")).unwrap();
    let error = recipe(folder.path(), "").init(&frame(0, false), bbox(0)).err().unwrap().to_string();
    assert!(error.contains("no mask of [1, 225, 9, 9]") && error.contains("mask_side"), "{error}");
}
