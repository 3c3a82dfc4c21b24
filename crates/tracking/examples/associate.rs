//! How long association of a crowd's detections takes, in microseconds a frame: `cargo run --profile suite -p pursuit-tracking --example associate`.

use pursuit_geometry::{BBox, Size};
use pursuit_tracking::many::{Associating, ManyParams};
use pursuit_tracking::{Detection, Result};
use std::time::Instant;

/// Frames that are timed, after as many that are not.
const FRAMES: u32 = 300;

/// A walker in a square of `side` by `side` of them, who sways about a place of its own.
fn walker(i: u32, side: u32, frame: u32) -> BBox {
    let (k, n) = (f64::from(frame), f64::from(i));
    let left = 100.0 + 55.0 * f64::from(i % side) + 25.0 * (0.05 * k + n).sin();
    let top = 100.0 + 95.0 * f64::from(i / side) + 20.0 * (0.04 * k + 2.0 * n).cos();
    BBox::from_ltwh(left, top, 30.0, 80.0)
}

fn main() -> Result<()> {
    for count in [4_u32, 20, 100, 500] {
        let side = f64::from(count).sqrt().ceil() as u32;
        let size = Size::new(300 + 55 * side as usize, 300 + 95 * side as usize);
        let mut targets = Associating::fed(ManyParams::default())?;
        let mut micros: Vec<f64> = Vec::new();
        for frame in 0..2 * FRAMES {
            let seen: Vec<Detection> = (0..count).map(|i| Detection::new(walker(i, side, frame), 0.9)).collect();
            let begun = Instant::now();
            let known = targets.update(f64::from(frame) / 25.0, Some(size), &seen)?.len();
            if frame >= FRAMES {
                micros.push(1e6 * begun.elapsed().as_secs_f64());
                assert_eq!(known, count as usize, "every walker is one target");
            }
        }
        micros.sort_by(f64::total_cmp);
        println!("{count} boxes: {:.1} us a frame (median)", micros[micros.len() / 2]);
    }
    Ok(())
}
