//! How a camera stands, and how far the picture moves from one stand to another.

use pursuit_geometry::{Point, Size};
use pursuit_imaging::CameraPose;

/// Where a camera stands, as its pose and the edges of the background say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stand {
    pub pose: CameraPose,
    /// How far the picture lies from where the pose says, pixels.
    pub off: (f64, f64),
}

impl Stand {
    /// How far the picture has moved since another stand, pixels: its corners or its middle, whichever moved most.
    pub fn moved_px(&self, since: &Self, picture: Size) -> f64 {
        let (width, height) = (picture.width as f64, picture.height as f64);
        let places = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let moved = places.map(|(x, y)| {
            let at = Point::new(x * width, y * height);
            let there = self.pose.point_of(since.pose.direction_of(at, picture), picture);
            there.map_or(f64::INFINITY, |p| {
                (p.x + self.off.0 - since.off.0 - at.x).hypot(p.y + self.off.1 - since.off.1 - at.y)
            })
        });
        moved.into_iter().fold(0.0, f64::max)
    }
}
