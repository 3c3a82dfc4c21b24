//! The regions that stand out, and which of them are one thing.

use super::params::MotionDetectorParams;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_vision::region_features::{FeatureRanges, RegionFeatures};

/// A region that the matching rule admits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    /// Its features.
    pub features: RegionFeatures,
    /// Share of its pixels that have changed since the frame before.
    pub stirred: f64,
    /// Whether its outline is rather one of the background than of the frame: something has uncovered it.
    pub uncovered: bool,
    /// Whether it is the part that one target has in a region; the features but the place are those of the region.
    pub part: bool,
}

/// Whether the left or the right border of the picture cuts a box, and whether the upper or the lower one does.
fn cut(bbox: &BBox, frame: Size) -> (bool, bool) {
    let beside = bbox.left() <= 0.0 || bbox.right() >= frame.width as f64;
    let above = bbox.top() <= 0.0 || bbox.bottom() >= frame.height as f64;
    (beside, above)
}

/// Whether the matching rule admits a region. What the picture's border cuts is wider, or higher, than is seen of it.
pub(super) fn admits(ranges: &FeatureRanges, features: &RegionFeatures, frame: Size) -> bool {
    let (wider, higher) = cut(&features.bounds, frame);
    let least = if higher { 0.0 } else { *ranges.aspect_ratio.start() };
    let most = if wider { f64::MAX } else { *ranges.aspect_ratio.end() };
    FeatureRanges { aspect_ratio: least..=most, ..ranges.clone() }.admit(features)
}

/// Joins regions above one another that are near: a belt, or a wall of the colour of a coat, cuts a person in two; so does the
/// picture's border one who comes in by a foot and a hand.
pub(super) fn join(parts: &mut Vec<Found>, frame: Size, params: &MotionDetectorParams) {
    let mut i = 0;
    while i < parts.len() {
        match (i + 1..parts.len()).find(|&j| belong([i, j].map(|k| &parts[k].features.bounds), frame, params)) {
            Some(j) => {
                let other = parts.swap_remove(j);
                parts[i] = parts[i].with(&other);
                // What is joined may reach others that were passed over.
                i = 0;
            }
            None => i += 1,
        }
    }
}

fn belong([a, b]: [&BBox; 2], frame: Size, params: &MotionDetectorParams) -> bool {
    let cut = cut(a, frame).0 && cut(b, frame).0;
    let join = if cut { params.join.max(params.join_cut) } else { params.join };
    let shared = a.right().min(b.right()) - a.left().max(b.left());
    let apart = a.top().max(b.top()) - a.bottom().min(b.bottom());
    apart <= join * a.union(b).height() && shared >= params.above * a.width().min(b.width())
}

impl Found {
    /// Two parts together.
    fn with(&self, other: &Self) -> Self {
        let (a, b) = (&self.features, &other.features);
        let bounds = a.bounds.union(&b.bounds);
        let (area_px, perimeter_px) = (a.area_px + b.area_px, a.perimeter_px + b.perimeter_px);
        let mean = |of_a: f64, of_b: f64| (of_a * a.area_px + of_b * b.area_px) / area_px;
        let features = RegionFeatures {
            area_px,
            perimeter_px,
            aspect_ratio: bounds.height() / bounds.width(),
            complexity: perimeter_px * perimeter_px / area_px,
            centroid: Point::new(mean(a.centroid.x, b.centroid.x), mean(a.centroid.y, b.centroid.y)),
            bounds,
        };
        let uncovered = if self.features.area_px < other.features.area_px { other.uncovered } else { self.uncovered };
        Self { features, stirred: mean(self.stirred, other.stirred), uncovered, part: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Size = Size { width: 160, height: 160 };

    fn part(left: f64, top: f64, width: f64, height: f64) -> Found {
        let (bounds, area_px, perimeter_px) =
            (BBox::from_ltwh(left, top, width, height), width * height, 2.0 * (width + height) - 4.0);
        let features = RegionFeatures {
            area_px,
            perimeter_px,
            aspect_ratio: height / width,
            complexity: perimeter_px * perimeter_px / area_px,
            centroid: bounds.center(),
            bounds,
        };
        Found { features, stirred: left / 100.0, uncovered: false, part: false }
    }

    #[test]
    fn stacked_parts_join_and_neighbours_do_not() {
        // Legs, someone beside them, a head far above, a trunk between.
        let mut parts = vec![
            part(10.0, 60.0, 20.0, 40.0),
            part(40.0, 60.0, 20.0, 40.0),
            part(15.0, 20.0, 10.0, 10.0),
            part(12.0, 34.0, 20.0, 22.0),
        ];
        join(&mut parts, PICTURE, &MotionDetectorParams { join: 0.1, ..MotionDetectorParams::default() });
        assert_eq!(parts.len(), 2);
        let whole = parts[0].features;
        assert!((parts[0].stirred - (0.1 * 800.0 + 0.15 * 100.0 + 0.12 * 440.0) / 1340.0).abs() < 1e-12);
        assert_eq!(whole.bounds, BBox::from_ltrb(10.0, 20.0, 32.0, 100.0));
        assert_eq!((whole.area_px, whole.perimeter_px), (1340.0, 116.0 + 36.0 + 80.0));
        assert_eq!(whole.aspect_ratio, 80.0 / 22.0);
        assert!((whole.complexity - 232.0f64.powi(2) / 1340.0).abs() < 1e-12);
        assert!((whole.centroid.y - (80.0 * 800.0 + 25.0 * 100.0 + 45.0 * 440.0) / 1340.0).abs() < 1e-12);
        assert_eq!(parts[1].features.bounds.left(), 40.0);
        // Too far, and hardly above one another.
        for (other, together) in [
            (part(10.0, 104.0, 20.0, 36.0), 1),
            (part(10.0, 104.1, 20.0, 36.0), 2),
            (part(20.0, 102.0, 20.0, 36.0), 1),
            (part(20.5, 102.0, 20.0, 36.0), 2),
        ] {
            let mut parts = vec![part(10.0, 60.0, 20.0, 40.0), other];
            join(&mut parts, PICTURE, &MotionDetectorParams { join: 0.05, ..MotionDetectorParams::default() });
            assert_eq!(parts.len(), together, "{other:?}");
        }
    }

    #[test]
    fn what_the_border_cuts_is_one_thing() {
        let joined = |left: f64| {
            let mut parts = vec![part(left, 120.0, 20.0, 35.0), part(left, 64.0, 10.0, 12.0)];
            join(&mut parts, PICTURE, &MotionDetectorParams::default());
            parts.len()
        };
        assert_eq!((joined(0.0), joined(5.0)), (1, 2), "a hand and a foot come in");
        let mut far = vec![part(0.0, 120.0, 20.0, 35.0), part(0.0, 20.0, 10.0, 12.0)];
        join(&mut far, PICTURE, &MotionDetectorParams::default());
        assert_eq!(far.len(), 2, "too far");
    }

    #[test]
    fn what_the_border_cuts_is_wider_or_higher_than_seen() {
        let ranges = MotionDetectorParams::default().rule.ranges(PICTURE);
        let admitted = |found: Found| admits(&ranges, &found.features, PICTURE);
        let sliver = |left: f64| admitted(part(left, 40.0, 10.0, 100.0));
        assert_eq!((sliver(0.0), sliver(40.0), sliver(150.0)), (true, false, true));
        let head = |top: f64| admitted(part(60.0, top, 60.0, 12.0));
        assert_eq!((head(0.0), head(40.0), head(148.0)), (true, false, true));
        assert!(!admitted(part(0.0, 40.0, 60.0, 12.0)), "too wide already");
    }
}
