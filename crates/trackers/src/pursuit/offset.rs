//! Where a witness looks.

use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// Where a witness looks next, relative to where the loop expects the target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "SearchOffset")]
pub struct SearchOffset {
    offset: (f64, f64),
    size: (f64, f64),
}

pursuit_estimation::checked!(SearchOffset);

impl SearchOffset {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { offset, size } = self;
        let finite = [offset.0, offset.1, size.0, size.1].iter().all(|v| v.is_finite());
        let sound = finite && size.0 > 0.0 && size.1 > 0.0;
        if sound { Ok(self) } else { Err("the offset of a search is not finite, or its size not positive") }
    }
}

impl SearchOffset {
    /// At `bbox`, where the target is expected.
    pub fn new(bbox: &BBox) -> Self {
        Self { offset: (0.0, 0.0), size: (bbox.width(), bbox.height()) }
    }

    /// Where to look when the loop expects the target at `expected`.
    pub fn at(&self, expected: &BBox) -> BBox {
        let Point { x, y } = expected.center();
        BBox::from_center_size(Point::new(x + self.offset.0, y + self.offset.1), self.size.0, self.size.1)
    }

    /// Its box is `bbox` while `reported` is what the loop goes on from.
    pub fn set(&mut self, bbox: &BBox, reported: &BBox) {
        let (own, loops) = (bbox.center(), reported.center());
        self.offset = (own.x - loops.x, own.y - loops.y);
        self.size = (bbox.width(), bbox.height());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_keeps_its_offset_from_the_report() {
        let reported = BBox::from_ltwh(100.0, 50.0, 20.0, 10.0);
        let mut offset = SearchOffset::new(&reported);
        assert_eq!(offset.at(&reported), reported);
        let own = BBox::from_ltwh(130.0, 40.0, 30.0, 12.0);
        offset.set(&own, &reported);
        assert_eq!(offset.at(&reported), own);
        // Where the loop expects the target elsewhere, and larger, the witness keeps its offset and its own size.
        assert_eq!(
            offset.at(&BBox::from_center_size(Point::new(10.0, 5.0), 40.0, 40.0)),
            own.translated(-100.0, -50.0)
        );
    }

    #[test]
    fn impossible_offsets_are_refused() {
        let offset = SearchOffset { offset: (1.0, -2.0), size: (3.0, 4.0) };
        let read = |s: &SearchOffset| postcard::from_bytes::<SearchOffset>(&postcard::to_stdvec(s).unwrap());
        assert_eq!(read(&offset).unwrap(), offset);
        for bad in [
            SearchOffset { offset: (f64::NAN, 0.0), ..offset },
            SearchOffset { offset: (0.0, f64::INFINITY), ..offset },
            SearchOffset { size: (0.0, 4.0), ..offset },
            SearchOffset { size: (3.0, -4.0), ..offset },
        ] {
            assert!(read(&bad).is_err(), "{bad:?}");
        }
    }
}
