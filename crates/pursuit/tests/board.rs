//! A camera found in a clip of a board, as a person holds one before it.
#![cfg(feature = "board")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use nalgebra::{Rotation3, Vector3};
use pursuit::measure::{Board, FoundInClip, camera_of};
use pursuit::measuring::Camera;
use std::io::Write;
use std::path::Path;

const SIZE: [usize; 2] = [640, 480];
/// Squares of the board and their side, metres.
const SQUARES: [i32; 2] = [10, 7];
const SIDE: f64 = 0.025;

fn truth() -> Camera {
    Camera { picture: SIZE, focal: [560.0, 556.0], centre: [331.0, 236.0], distortion: vec![-0.23, 0.07, 0.0, 0.0] }
}

/// How the board is held in a frame; none where nobody holds it.
fn held(k: usize) -> Option<(Rotation3<f64>, Vector3<f64>)> {
    let angle = 0.61 * k as f64;
    let turn = Vector3::new(0.55 * angle.cos(), 0.55 * angle.sin(), 0.25 * (1.3 * angle).sin());
    let shift =
        Vector3::new(0.05 * (1.9 * angle).sin(), 0.035 * (2.6 * angle).cos(), 0.36 + 0.05 * (0.7 * angle).sin());
    (k % 6 != 5).then(|| (Rotation3::new(turn), shift))
}

/// What is seen at a pixel: the level of the board where the ray meets it, else of the wall.
fn level(ideal: [f64; 2], board: Option<(Rotation3<f64>, Vector3<f64>)>, print: &impl Fn(f64, f64) -> bool) -> f64 {
    let camera = truth();
    let ray = Vector3::new(
        (ideal[0] - camera.centre[0]) / camera.focal[0],
        (ideal[1] - camera.centre[1]) / camera.focal[1],
        1.0,
    );
    let wall = 120.0 + 10.0 * (9.0 * ray.x).sin() + 8.0 * (11.0 * ray.y).cos();
    let Some((turn, shift)) = board else { return wall };
    let normal = turn * Vector3::z();
    let along = normal.dot(&shift) / normal.dot(&ray);
    let at = turn.inverse() * (ray * along - shift);
    let (u, v) = (at.x / SIDE + f64::from(SQUARES[0]) / 2.0, at.y / SIDE + f64::from(SQUARES[1]) / 2.0);
    let inside = |u: f64, squares: i32, margin: f64| (-margin..f64::from(squares) + margin).contains(&u);
    if inside(u, SQUARES[0], 0.0) && inside(v, SQUARES[1], 0.0) {
        if print(u, v) { 30.0 } else { 225.0 }
    } else if inside(u, SQUARES[0], 0.7) && inside(v, SQUARES[1], 0.7) {
        225.0
    } else {
        wall
    }
}

/// Whether a chessboard is black at a place, in squares.
fn chessboard(u: f64, v: f64) -> bool {
    (u.floor() + v.floor()).rem_euclid(2.0) < 1.0
}

/// Share of a marker's side in a square's.
const MARKER: f64 = 0.75;

/// The same of a ChArUco board: markers of six by six cells stand in its white squares, in their order.
fn charuco(u: f64, v: f64) -> bool {
    if chessboard(u, v) {
        return true;
    }
    let (column, row) = (u.floor() as usize, v.floor() as usize);
    let before = row * SQUARES[0] as usize + column;
    // The board is even across, so every row has as many white squares; of each pair of squares one is white.
    let id = before / 2;
    let cell = |at: f64| ((at - at.floor() - (1.0 - MARKER) / 2.0) / MARKER * 6.0).floor();
    let (x, y) = (cell(u), cell(v));
    if !(0.0..6.0).contains(&x) || !(0.0..6.0).contains(&y) {
        return false;
    }
    if x < 1.0 || y < 1.0 || x >= 5.0 || y >= 5.0 {
        return true;
    }
    let bit = (y as usize - 1) * 4 + x as usize - 1;
    calib_targets_charuco::builtins::DICT_4X4_50.codes()[id] >> bit & 1 == 1
}

fn write_clip(path: &Path, frames: usize, print: &impl Fn(f64, f64) -> bool) {
    let camera = truth();
    let samples = [0.25, 0.75];
    let mut rays = Vec::new();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            for (dx, dy) in samples.iter().flat_map(|dy| samples.iter().map(move |dx| (dx, dy))) {
                rays.push(camera.undistort([x as f64 + dx, y as f64 + dy]).unwrap().0);
            }
        }
    }
    let mut file = std::fs::File::create(path).unwrap();
    writeln!(file, "YUV4MPEG2 W{} H{} F25:1 Ip A1:1 Cmono", SIZE[0], SIZE[1]).unwrap();
    let mut chance = 12_345_u32;
    for k in 0..frames {
        let board = held(k);
        let pixels = rays.chunks(4).map(|four| {
            let mean = four.iter().map(|ray| level(*ray, board, print)).sum::<f64>() / 4.0;
            chance = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (mean + f64::from(chance >> 28) / 2.5 - 3.0).clamp(0.0, 255.0) as u8
        });
        let pixels: Vec<u8> = pixels.collect();
        file.write_all(b"FRAME\n").unwrap();
        file.write_all(&pixels).unwrap();
    }
}

/// The camera that a clip of 24 frames tells, 20 of which show the board.
fn found(board: &str, print: &impl Fn(f64, f64) -> bool) -> FoundInClip {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("board.y4m");
    write_clip(&path, 24, print);
    let mut source = pursuit::open(path.to_str().unwrap()).unwrap();
    let told = camera_of(&mut *source, &board.parse().unwrap()).unwrap();
    println!("{told:?}");
    told
}

/// It is the camera that took the clip, as exactly as is said.
fn check(told: &FoundInClip) {
    let (found, wanted) = (&told.found, truth());
    assert!(found.rms_px < 0.15, "{}", found.rms_px);
    for axis in 0..2 {
        let focal = (found.camera.focal[axis] - wanted.focal[axis]) / found.focal_error[axis];
        let centre = (found.camera.centre[axis] - wanted.centre[axis]) / found.centre_error[axis];
        assert!(focal.abs() < 4.0 && centre.abs() < 4.0, "{found:?}");
        assert!(found.focal_error[axis] < 1.0 && found.centre_error[axis] < 1.0, "{found:?}");
    }
    // What counts is where things are seen, over the whole picture.
    for pixel in [[20.0, 20.0], [620.0, 25.0], [15.0, 460.0], [625.0, 455.0], [320.0, 240.0]] {
        let ray = |camera: &Camera| {
            let ideal = camera.undistort(pixel).unwrap().0;
            [0, 1].map(|axis| (ideal[axis] - camera.centre[axis]) / camera.focal[axis])
        };
        let (ours, theirs) = (ray(&found.camera), ray(&wanted));
        let off = 556.0 * (ours[0] - theirs[0]).hypot(ours[1] - theirs[1]);
        assert!(off < 1.0, "{pixel:?}: {off} px");
    }
}

#[test]
fn a_chessboard_that_is_moved_about_tells_the_lens() {
    let told = found("chessboard", &chessboard);
    assert!((18..=20).contains(&told.seen) && told.frames == 24, "seen in {} of {}", told.seen, told.frames);
    check(&told);
}

#[test]
fn so_does_a_board_with_markers() {
    let told = found("charuco:10x7:DICT_4X4_50:0.75", &charuco);
    assert!(told.seen >= 12 && told.seen <= 20, "seen in {}", told.seen);
    check(&told);
}

#[test]
fn a_clip_without_a_board_is_told() {
    let mut source = pursuit::open("scene:drift?duration=1").unwrap();
    let error = camera_of(&mut *source, &Board::Chessboard).unwrap_err();
    assert!(error.to_string().contains("the board is seen in 0") && error.exit_code() == 2, "{error}");
    let odd = "charuco:7x5:DICT_9X9_50:0.7".parse().unwrap();
    let mut source = pursuit::open("scene:drift?duration=1").unwrap();
    assert!(camera_of(&mut *source, &odd).unwrap_err().to_string().contains("no dictionary `DICT_9X9_50`"));
}
