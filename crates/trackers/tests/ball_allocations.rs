//! The ball tracker allocates nothing from frame to frame once it is warm.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_trackers::registry;

fn center(k: u64) -> Point {
    Point::new(80.0 + 3.0 * k as f64, 90.0 + k as f64)
}

fn frame(k: u64) -> Frame {
    let image = Image::from_fn(320, 240, |x, y| {
        let shade = ((x * 31 + y * 17) % 23) as u8;
        let away = center(k).distance(Point::new(x as f64 + 0.5, y as f64 + 0.5));
        if away < 18.0 { [235 - shade, 205 - shade, 30] } else { [80 + shade, 90 + shade, 100 + shade / 2] }
    });
    Frame::new(k, k as f64 / 30.0, image.unwrap())
}

#[test]
fn a_warm_tracker_allocates_nothing() {
    for motion in ["bounce", "ball"] {
        let set = toml::Table::from_iter([("motion.model".to_owned(), toml::Value::String(motion.to_owned()))]);
        let recipe = registry::tracker("ball").unwrap().recipe(&set).unwrap();
        let mut tracker = recipe.init(&frame(0), BBox::from_center_size(center(0), 36.0, 36.0)).unwrap();
        (1..20).for_each(|k| assert!(tracker.update(&frame(k)).is_ok()));
        let frames: Vec<Frame> = (20..40).map(frame).collect();
        let used = allocation_counter::measure(|| {
            frames.iter().for_each(|f| assert!(tracker.update(f).is_ok()));
        });
        assert_eq!(used.count_total, 0, "{motion}: {used:?}");
    }
}
