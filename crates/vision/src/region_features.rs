//! The shape features of a region by which qu2010 tells people from noise: area, perimeter, aspect ratio, complexity.

use crate::contour::{perimeter, trace};
use crate::regions::Region;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::ImageView;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Shape features of a region (qu2010, section 2, which names them; definitions are ours).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RegionFeatures {
    /// Pixels of the region, holes not counted.
    pub area_px: f64,
    /// Length of the closed line through the *centres* of the region's outer border pixels, steps of 1 and √2, in pixels
    /// (OpenCV's `arcLength` of an external contour): n pixels in a row have 2(n − 1), a square of side n has 4(n − 1).
    /// Borders of holes do not count.
    pub perimeter_px: f64,
    /// Height over width of the bounding rectangle: about 2 to 4 for a standing person.
    pub aspect_ratio: f64,
    /// Perimeter² / area: near 4π for a disk, 16 for a large square, more for what is ragged or thin.
    pub complexity: f64,
    /// Centre of mass, continuous pixels.
    pub centroid: Point,
    /// Bounding rectangle, continuous pixels.
    pub bounds: BBox,
}

impl RegionFeatures {
    /// Measures `region`, found in `mask`; `outline` is scratch and afterwards holds the region's outline.
    pub fn of(region: &Region, mask: ImageView<'_, u8>, outline: &mut Vec<(usize, usize)>) -> Self {
        trace(mask, region.first, outline);
        let (area_px, perimeter_px) = (region.area as f64, perimeter(outline));
        Self {
            area_px,
            perimeter_px,
            aspect_ratio: region.bounds.height as f64 / region.bounds.width as f64,
            complexity: perimeter_px * perimeter_px / area_px,
            centroid: region.centroid,
            bounds: region.bounds.to_bbox(),
        }
    }
}

/// A matching rule: the ranges in which the features of what is looked for lie.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureRanges {
    /// Area, pixels.
    pub area_px: RangeInclusive<f64>,
    /// Perimeter, pixels.
    pub perimeter_px: RangeInclusive<f64>,
    /// Height over width.
    pub aspect_ratio: RangeInclusive<f64>,
    /// Perimeter² / area.
    pub complexity: RangeInclusive<f64>,
}

impl Default for FeatureRanges {
    /// Everything with at least a pixel.
    fn default() -> Self {
        let any = || 0.0..=f64::MAX;
        Self { area_px: any(), perimeter_px: any(), aspect_ratio: any(), complexity: any() }
    }
}

impl FeatureRanges {
    /// Whether every feature lies in its range.
    pub fn admit(&self, features: &RegionFeatures) -> bool {
        self.area_px.contains(&features.area_px)
            && self.perimeter_px.contains(&features.perimeter_px)
            && self.aspect_ratio.contains(&features.aspect_ratio)
            && self.complexity.contains(&features.complexity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regions::RegionFinder;
    use pursuit_imaging::Image;

    fn features(width: usize, height: usize, inside: impl Fn(usize, usize) -> bool) -> RegionFeatures {
        let mask = Image::from_fn(width, height, |x, y| u8::from(inside(x, y)) * 255).unwrap();
        let mut finder = RegionFinder::default();
        let regions = finder.find(mask.view(), 1);
        assert_eq!(regions.len(), 1);
        RegionFeatures::of(&regions[0], mask.view(), &mut Vec::new())
    }

    #[test]
    fn a_rectangle_is_measured_exactly() {
        let f = features(30, 40, |x, y| (5..15).contains(&x) && (6..36).contains(&y));
        assert_eq!((f.area_px, f.perimeter_px, f.aspect_ratio), (300.0, 2.0 * (9.0 + 29.0), 3.0));
        assert_eq!(f.complexity, 76.0 * 76.0 / 300.0);
        assert_eq!((f.centroid, f.bounds), (Point::new(10.0, 21.0), BBox::from_ltwh(5.0, 6.0, 10.0, 30.0)));
    }

    #[test]
    fn disks_are_simple_and_pixels_lack_perimeter() {
        let disk = features(120, 120, |x, y| (x as f64 - 59.5).hypot(y as f64 - 59.5) < 50.0);
        // The line of steps 1 and √2 round a large disk is 8·(√2 − 1)/π = 1.0548 times as long as the circle.
        assert!(
            (disk.complexity / (4.0 * std::f64::consts::PI) - 1.0548f64.powi(2)).abs() < 0.05,
            "{}",
            disk.complexity
        );
        let pixel = features(3, 3, |x, y| x == 1 && y == 1);
        assert_eq!((pixel.area_px, pixel.perimeter_px, pixel.complexity, pixel.aspect_ratio), (1.0, 0.0, 0.0, 1.0));
        let holed = features(20, 20, |x, y| (2..18).contains(&x) && (2..18).contains(&y) && !(x == 9 && y == 9));
        assert_eq!((holed.area_px, holed.perimeter_px), (255.0, 60.0));
    }

    #[test]
    fn every_range_can_refuse() {
        let f = features(30, 40, |x, y| (5..15).contains(&x) && (6..36).contains(&y));
        assert!(FeatureRanges::default().admit(&f));
        let person = FeatureRanges {
            area_px: 300.0..=300.0,
            perimeter_px: 70.0..=80.0,
            aspect_ratio: 1.5..=4.0,
            complexity: 12.0..=40.0,
        };
        assert!(person.admit(&f));
        assert!(!FeatureRanges { area_px: 301.0..=999.0, ..person.clone() }.admit(&f));
        assert!(!FeatureRanges { perimeter_px: 0.0..=75.0, ..person.clone() }.admit(&f));
        assert!(!FeatureRanges { aspect_ratio: 0.0..=2.9, ..person.clone() }.admit(&f));
        assert!(!FeatureRanges { complexity: 20.0..=30.0, ..person }.admit(&f));
    }
}
