//! Where a witness stands, and how much it has been worth lately.

use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// Where a witness looks next, relative to where the loop expects the target, and its standing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct Seat {
    offset: (f64, f64),
    size: (f64, f64),
    standing: f64,
}

#[derive(Deserialize)]
struct Raw {
    offset: (f64, f64),
    size: (f64, f64),
    standing: f64,
}

impl TryFrom<Raw> for Seat {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { offset, size, standing } = raw;
        let finite = [offset.0, offset.1, size.0, size.1, standing].iter().all(|v| v.is_finite());
        if finite && size.0 > 0.0 && size.1 > 0.0 {
            Ok(Self { offset, size, standing })
        } else {
            Err("a witness stands where none can")
        }
    }
}

impl Seat {
    /// At `bbox`, where the target is expected, with a standing (in log odds).
    pub fn new(bbox: &BBox, standing: f64) -> Self {
        Self { offset: (0.0, 0.0), size: (bbox.width(), bbox.height()), standing }
    }

    /// Smoothed log odds of what it said.
    pub const fn standing(&self) -> f64 {
        self.standing
    }

    /// Where to look when the loop expects the target at `expected`.
    pub fn at(&self, expected: &BBox) -> BBox {
        let Point { x, y } = expected.center();
        BBox::from_center_size(Point::new(x + self.offset.0, y + self.offset.1), self.size.0, self.size.1)
    }

    /// Its box is `bbox` while `reported` is what the loop goes on from.
    pub fn sit(&mut self, bbox: &BBox, reported: &BBox) {
        let (own, loops) = (bbox.center(), reported.center());
        self.offset = (own.x - loops.x, own.y - loops.y);
        self.size = (bbox.width(), bbox.height());
    }

    /// What it said was worth `log_odds`; that counts by `rate`.
    pub fn hear(&mut self, log_odds: f64, rate: f64) {
        self.standing += rate * (log_odds.clamp(-6.0, 6.0) - self.standing);
    }
}
