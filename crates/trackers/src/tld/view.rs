use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// Between the target's box and the window it is looked at through: the box itself, unless that is tiny.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "View")]
pub(super) struct View {
    /// Sides at the start.
    size: (f64, f64),
    /// Windows have at least this side, pixels: what is smaller is looked at with its surroundings.
    least_px: f64,
    /// How many times wider and higher the window is.
    #[serde(skip)]
    factors: (f64, f64),
}

pursuit_estimation::checked!(View);

impl View {
    fn restored(self) -> Result<Self, &'static str> {
        let bbox = BBox::from_ltwh(0.0, 0.0, self.size.0, self.size.1);
        let whole = bbox.is_finite() && !bbox.is_empty() && self.least_px.is_finite();
        if whole { Ok(Self::new(&bbox, self.least_px)) } else { Err("its target has no size") }
    }
}

impl View {
    /// Of a target that is at `bbox` at the start; windows have at least the side `least_px`.
    pub fn new(bbox: &BBox, least_px: f64) -> Self {
        let factor = |side: f64| (least_px / side).max(1.0);
        let factors = (factor(bbox.width()), factor(bbox.height()));
        Self { size: (bbox.width(), bbox.height()), least_px, factors }
    }

    /// Sides of the window at the start.
    pub fn window_size(&self) -> (f64, f64) {
        (self.size.0 * self.factors.0, self.size.1 * self.factors.1)
    }

    /// The window of a box.
    pub fn window(&self, bbox: &BBox) -> BBox {
        let (w, h) = (bbox.width() * self.factors.0, bbox.height() * self.factors.1);
        BBox::from_center_size(bbox.center(), w, h)
    }

    /// The box of a window.
    pub fn bbox(&self, window: &BBox) -> BBox {
        let (w, h) = (window.width() / self.factors.0, window.height() / self.factors.1);
        BBox::from_center_size(window.center(), w, h)
    }

    /// A region of the frame, no smaller than a window's surroundings.
    pub fn region(&self, region: &BBox) -> BBox {
        let (w, h) = self.window_size();
        BBox::from_center_size(region.center(), region.width().max(w), region.height().max(h))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tiny_boxes_are_seen_with_their_surroundings() {
        let large = BBox::from_ltwh(3.0, 4.0, 30.0, 12.0);
        let view = View::new(&large, 10.0);
        assert_eq!((view.window(&large), view.bbox(&large), view.window_size()), (large, large, (30.0, 12.0)));
        let thin = BBox::from_ltwh(10.0, 20.0, 2.0, 40.0);
        let view = View::new(&thin, 10.0);
        assert_eq!(view.window(&thin), BBox::from_center_size(thin.center(), 10.0, 40.0));
        assert_eq!(view.bbox(&view.window(&thin)), thin);
        assert_eq!(view.region(&thin), BBox::from_center_size(thin.center(), 10.0, 40.0));
        assert_eq!(view.window_size(), (10.0, 40.0));
        let saved = serde_json::to_string(&view).unwrap();
        assert_eq!(serde_json::from_str::<View>(&saved).unwrap(), view);
        assert!(serde_json::from_str::<View>("[0.0,3.0,10.0]").is_err());
    }
}
