//! Crowds of any size: walkers who go straight on and turn back at the border, misses and false alarms.
#![allow(dead_code, reason = "not every test uses everything")]

use pursuit_geometry::{BBox, Point, Size};
use pursuit_testkit::SplitMix;
use pursuit_tracking::Detection;

/// Walkers in a picture of which their boxes would cover a quarter.
pub struct Crowd {
    pub walkers: usize,
    pub size: Size,
    /// Share of detections that are missing.
    pub missed: f64,
    /// False detections beside each true one.
    pub false_alarms: f64,
}

/// Width and height of a walker, in pixels.
pub const WALKER: (f64, f64) = (30.0, 75.0);

impl Crowd {
    pub fn of(walkers: usize) -> Self {
        let area = walkers as f64 * WALKER.0 * WALKER.1 * 4.0;
        let (width, height) = ((area * 16.0 / 9.0).sqrt(), (area * 9.0 / 16.0).sqrt());
        let size = Size::new(width.max(320.0) as usize, height.max(180.0) as usize);
        Self { walkers, size, missed: 0.05, false_alarms: 0.05 }
    }

    pub fn time_s(frame: u64) -> f64 {
        frame as f64 / 25.0
    }

    /// Where a walker is.
    pub fn place(&self, walker: usize, frame: u64) -> BBox {
        let mut numbers = SplitMix::after(walker as u64 * 7919 + 1);
        let (w, h) = (self.size.width as f64, self.size.height as f64);
        let mut along = |length: f64| {
            let (start, speed) = (numbers.unit() * length, 80.0 * (numbers.unit() - 0.5));
            // To the border and back.
            let way = (start + speed * Self::time_s(frame)).rem_euclid(2.0 * length);
            way.min(2.0 * length - way)
        };
        let center = Point::new(along(w), along(h));
        BBox::from_center_size(center, WALKER.0, WALKER.1)
    }

    /// What is detected in a frame.
    pub fn detections(&self, frame: u64) -> Vec<Detection> {
        let mut numbers = SplitMix::after(frame * 104_729 + 3);
        let mut found = Vec::new();
        for walker in 0..self.walkers {
            let mut off = || 2.0 * (numbers.unit() - 0.5);
            let bbox = self.place(walker, frame).translated(1.5 * off(), 1.5 * off());
            if numbers.unit() >= self.missed {
                found.push(Detection::new(bbox, 0.8 + 0.15 * numbers.unit()));
            }
            if numbers.unit() < self.false_alarms {
                let center =
                    Point::new(numbers.unit() * self.size.width as f64, numbers.unit() * self.size.height as f64);
                found.push(Detection::new(BBox::from_center_size(center, WALKER.0, WALKER.1), 0.5));
            }
        }
        found
    }
}
