//! By which convention the first box was drawn, in terms of the network.

use super::FusionParams;
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// How the box that was given differs from the one that the network sees in the very same picture: people draw a walker with
/// or without what he carries, a face with or without the hair, and go on doing so.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(remote = "BoxConvention")]
pub struct BoxConvention {
    /// Displacement of the middle, in widths and heights of the network's box.
    shift: (f64, f64),
    /// Natural logarithms of the ratios of the widths and of the heights.
    growth: (f64, f64),
}

pursuit_estimation::checked!(BoxConvention);

impl BoxConvention {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { shift, growth } = self;
        let possible = [shift.0, shift.1, growth.0, growth.1].iter().all(|v| v.is_finite());
        if possible { Ok(self) } else { Err("a convention of boxes is not finite") }
    }
}

impl BoxConvention {
    /// `given` is what the network takes for `network`; of the differences, `params` say how much is believed.
    pub fn new(params: &FusionParams, given: &BBox, network: &BBox) -> Self {
        let (a, b) = (given.center(), network.center());
        let shift = ((a.x - b.x) / network.width(), (a.y - b.y) / network.height());
        let growth = ((given.width() / network.width()).ln(), (given.height() / network.height()).ln());
        if [shift.0, shift.1, growth.0, growth.1].iter().all(|v| v.abs() <= params.convention_limit) {
            let (center, size) = (params.convention_center, params.convention_size);
            Self { shift: (center * shift.0, center * shift.1), growth: (size * growth.0, size * growth.1) }
        } else {
            Self::default()
        }
    }

    /// The box by this convention where the network sees `network`.
    pub fn of(&self, network: &BBox) -> BBox {
        let Point { x, y } = network.center();
        let middle = Point::new(x + self.shift.0 * network.width(), y + self.shift.1 * network.height());
        BBox::from_center_size(middle, network.width() * self.growth.0.exp(), network.height() * self.growth.1.exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn believing(center: f64, size: f64) -> FusionParams {
        FusionParams { convention_center: center, convention_size: size, ..FusionParams::default() }
    }

    #[test]
    fn the_convention_of_the_first_box_holds_later() {
        let (given, network) = (BBox::from_ltwh(12.0, 8.0, 24.0, 30.0), BBox::from_ltwh(10.0, 10.0, 20.0, 40.0));
        let whole = BoxConvention::new(&believing(1.0, 1.0), &given, &network);
        assert!(whole.of(&network).iou(&given) > 1.0 - 1e-9);
        // Twice as large elsewhere: everything is in proportion.
        let later = whole.of(&BBox::from_ltwh(100.0, 100.0, 40.0, 80.0));
        assert!(later.iou(&BBox::from_ltwh(104.0, 96.0, 48.0, 60.0)) > 1.0 - 1e-9, "{later}");
        let half = BoxConvention::new(&believing(0.5, 0.0), &given, &network).of(&network);
        assert!(half.iou(&BBox::from_ltwh(12.0, 6.5, 20.0, 40.0)) > 1.0 - 1e-9, "{half}");
    }

    #[test]
    fn a_mistake_of_the_network_sets_no_convention() {
        let given = BBox::from_ltwh(10.0, 10.0, 20.0, 20.0);
        for other in [BBox::from_ltwh(21.0, 10.0, 20.0, 20.0), BBox::from_ltwh(10.0, 10.0, 40.0, 20.0)] {
            assert_eq!(BoxConvention::new(&believing(1.0, 1.0), &given, &other), BoxConvention::default());
        }
        let read = |m: &BoxConvention| postcard::from_bytes::<BoxConvention>(&postcard::to_stdvec(m).unwrap());
        let possible = BoxConvention { shift: (0.1, -0.2), growth: (0.3, 0.4) };
        assert_eq!(read(&possible).unwrap(), possible);
        assert!(read(&BoxConvention { shift: (f64::INFINITY, 0.0), ..possible }).is_err());
        assert!(read(&BoxConvention { growth: (0.0, f64::NAN), ..possible }).is_err());
    }
}
