//! What the user means by the target, in the network's terms.

use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// How the box that was given differs from the one that the network sees in the very same picture: people draw a walker with
/// or without what he carries, a face with or without the hair, and go on doing so.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct Meaning {
    /// Displacement of the middle, in widths and heights of the network's box.
    shift: (f64, f64),
    /// Natural logarithms of the ratios of the widths and of the heights.
    growth: (f64, f64),
}

#[derive(Deserialize)]
struct Raw {
    shift: (f64, f64),
    growth: (f64, f64),
}

/// A middle off by more than this share of the size, or a side off by more than its exponential, is a mistake of the network.
const MOST: f64 = 0.5;

impl TryFrom<Raw> for Meaning {
    type Error = &'static str;

    fn try_from(Raw { shift, growth }: Raw) -> Result<Self, Self::Error> {
        let possible = [shift.0, shift.1, growth.0, growth.1].iter().all(|v| v.abs() <= MOST);
        if possible { Ok(Self { shift, growth }) } else { Err("the given box and the network's cannot differ so") }
    }
}

impl Meaning {
    /// `given` is what `network` is meant to be; of the differences these shares (of the place, of the size) are believed.
    pub fn new(given: &BBox, network: &BBox, center: f64, size: f64) -> Self {
        let (a, b) = (given.center(), network.center());
        let shift = ((a.x - b.x) / network.width(), (a.y - b.y) / network.height());
        let growth = ((given.width() / network.width()).ln(), (given.height() / network.height()).ln());
        if [shift.0, shift.1, growth.0, growth.1].iter().all(|v| v.abs() <= MOST) {
            Self { shift: (center * shift.0, center * shift.1), growth: (size * growth.0, size * growth.1) }
        } else {
            Self::default()
        }
    }

    /// The box meant where the network sees `network`.
    pub fn of(&self, network: &BBox) -> BBox {
        let Point { x, y } = network.center();
        let middle = Point::new(x + self.shift.0 * network.width(), y + self.shift.1 * network.height());
        BBox::from_center_size(middle, network.width() * self.growth.0.exp(), network.height() * self.growth.1.exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_meant_at_first_is_meant_later() {
        let (given, network) = (BBox::from_ltwh(12.0, 8.0, 24.0, 30.0), BBox::from_ltwh(10.0, 10.0, 20.0, 40.0));
        let whole = Meaning::new(&given, &network, 1.0, 1.0);
        assert!(whole.of(&network).iou(&given) > 1.0 - 1e-9);
        // Twice as large elsewhere: everything is in proportion.
        let later = whole.of(&BBox::from_ltwh(100.0, 100.0, 40.0, 80.0));
        assert!(later.iou(&BBox::from_ltwh(104.0, 96.0, 48.0, 60.0)) > 1.0 - 1e-9, "{later}");
        let half = Meaning::new(&given, &network, 0.5, 0.0).of(&network);
        assert!(half.iou(&BBox::from_ltwh(12.0, 6.5, 20.0, 40.0)) > 1.0 - 1e-9, "{half}");
    }

    #[test]
    fn what_the_network_mistakes_means_nothing() {
        let given = BBox::from_ltwh(10.0, 10.0, 20.0, 20.0);
        for other in [BBox::from_ltwh(21.0, 10.0, 20.0, 20.0), BBox::from_ltwh(10.0, 10.0, 40.0, 20.0)] {
            assert_eq!(Meaning::new(&given, &other, 1.0, 1.0), Meaning::default());
        }
        let read = |m: &Meaning| postcard::from_bytes::<Meaning>(&postcard::to_stdvec(m).unwrap());
        let possible = Meaning { shift: (0.1, -0.2), growth: (0.3, 0.4) };
        assert_eq!(read(&possible).unwrap(), possible);
        assert!(read(&Meaning { shift: (0.6, 0.0), ..possible }).is_err());
        assert!(read(&Meaning { growth: (0.0, f64::NAN), ..possible }).is_err());
    }
}
