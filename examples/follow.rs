//! Follows one target, and says what becomes of it.

use pursuit::{open, recipe, track};

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A video is "clip.mp4", a camera "camera:0", and a box BBox::from_ltwh(left, top, width, height).
    let source = open("scene:occluding-bar?seed=3&duration=4")?;
    let target = source.info().truth_at(0).bbox().ok_or("the scene begins without its target")?;
    for estimate in track(source, &*recipe("pursuit-light")?, target).step_by(10) {
        let e = estimate?;
        println!("{:.2} s: {} with probability {:.2} at {}", e.time_s, e.state, e.score, e.bbox);
    }
    Ok(())
}
