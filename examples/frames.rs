//! Follows a target in frames that the program has, and asks where it will be in 0.2 s: what a head or an arm that acts late has
//! to know.

use pursuit::imaging::Image;
use pursuit::{BBox, Frame, recipe, toml};

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let settings: toml::Table = "motion.model = 'constant-velocity'".parse()?;
    let recipe = recipe("kcf")?.with(&settings)?;
    let mut tracker = recipe.init(&frame(0)?, BBox::from_ltwh(30.0, 40.0, 24.0, 24.0))?;
    for k in 1..40 {
        let now = tracker.update(&frame(k)?)?;
        let ahead = tracker.forecast(0.2)?;
        if k % 13 == 0 {
            println!("{:.2} s: at {}, in 0.2 s expected at {}", now.time_s, now.bbox, ahead.bbox);
        }
    }
    Ok(())
}

/// A patch that moves to the right by two pixels a frame, 25 frames a second. `Image` holds what a camera gave; grey is one byte a
/// pixel.
fn frame(k: u64) -> Result<Frame, Box<dyn std::error::Error>> {
    let left = 30 + 2 * k as usize;
    let image = Image::from_fn(200, 120, |x, y| {
        let inside = (left..left + 24).contains(&x) && (40..64).contains(&y);
        if inside { 8 * (x - left) as u8 + 2 * (y - 40) as u8 } else { 60 + (x % 7) as u8 }
    })?;
    Ok(Frame::new(k, k as f64 / 25.0, image))
}
