//! Several people in one region: each pixel belongs to the target whose expected place is nearest.

use super::found::Found;
use super::params::GroupingParams;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Image;
use pursuit_vision::PixelWindow;
use pursuit_vision::region_features::RegionFeatures;

/// Who has a part in a region.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    expected: BBox,
    /// Left, top, right and bottom of the pixels that are its own, and how many they are.
    extent: [usize; 4],
    count: usize,
}

impl Part {
    /// The rectangle about its pixels, where they are enough.
    pub fn bbox(&self, params: &GroupingParams) -> Option<BBox> {
        let [left, top, right, bottom] = self.extent.map(|v| v as f64);
        let enough = self.count as f64 >= params.least_part * self.expected.area();
        enough.then(|| BBox::from_ltrb(left, top, right, bottom))
    }

    /// Squared distance of a point from the expected centre, in half reaches; `None` out of reach.
    fn distance2(&self, at: Point, reach: f64) -> Option<f64> {
        let center = self.expected.center();
        let (x, y) = ((at.x - center.x) / self.expected.width(), (at.y - center.y) / self.expected.height());
        (x.abs() <= reach && y.abs() <= reach).then_some(x * x + y * y)
    }
}

/// Puts parts in the place of regions of `mask` in which several targets are expected.
pub(super) fn divide(
    found: &mut Vec<Found>,
    (mask, expected): (&Image<u8>, &[BBox]),
    params: &GroupingParams,
    parts: &mut Vec<Part>,
) {
    for i in 0..found.len() {
        let whole = found[i];
        share_out(params, &whole.features.bounds, mask, expected, parts);
        let mut seen = parts.iter().filter_map(|part| part.bbox(params)).map(|bbox| {
            let features = RegionFeatures { bounds: bbox, centroid: bbox.center(), ..whole.features };
            Found { features, part: true, ..whole }
        });
        if let Some(first) = seen.next() {
            found[i] = first;
            found.extend(seen);
        }
    }
}

/// Divides the pixels of `mask` inside `bounds` among the targets expected there; `parts` is empty when fewer than two are.
fn share_out(params: &GroupingParams, bounds: &BBox, mask: &Image<u8>, expected: &[BBox], parts: &mut Vec<Part>) {
    parts.clear();
    let involved = || expected.iter().filter(|b| b.fraction_inside(bounds) >= params.share);
    // Something much smaller than another is a part of it, not somebody beside it.
    let least = params.peer * involved().map(BBox::area).fold(0.0, f64::max);
    parts.extend(involved().filter(|b| b.area() >= least).map(|b| Part {
        expected: *b,
        extent: [usize::MAX, usize::MAX, 0, 0],
        count: 0,
    }));
    let Some(window) = PixelWindow::of(bounds, mask.size()).filter(|_| parts.len() > 1) else { return parts.clear() };
    for y in window.y..window.y + window.height {
        for x in (window.x..window.x + window.width).filter(|x| mask.row(y)[*x] != 0) {
            let at = Point::new(x as f64 + 0.5, y as f64 + 0.5);
            let near = parts.iter_mut().filter_map(|p| p.distance2(at, params.reach).map(|d| (d, p)));
            if let Some((_, part)) = near.min_by(|a, b| a.0.total_cmp(&b.0)) {
                let [left, top, right, bottom] = part.extent;
                part.extent = [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)];
                part.count += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_who_touch_are_split_by_expectation() {
        let params = GroupingParams::default();
        let mask = Image::from_fn(80, 60, |x, y| {
            u8::from((10..25).contains(&x) && (5..50).contains(&y) || (25..42).contains(&x) && (9..53).contains(&y))
                * 255
        })
        .unwrap();
        let bounds = BBox::from_ltrb(10.0, 5.0, 42.0, 53.0);
        let (left, right) = (BBox::from_ltrb(9.0, 5.0, 24.0, 50.0), BBox::from_ltrb(26.0, 9.0, 41.0, 54.0));
        let far = BBox::from_ltrb(60.0, 5.0, 75.0, 50.0);
        let mut parts = Vec::new();
        share_out(&params, &bounds, &mask, &[left, far, right], &mut parts);
        let boxes: Vec<_> = parts.iter().map(|p| p.bbox(&params).unwrap()).collect();
        // One stands lower than the other: the border between them leans by a pixel.
        assert_eq!(boxes, [BBox::from_ltrb(10.0, 5.0, 26.0, 50.0), BBox::from_ltrb(24.0, 9.0, 42.0, 53.0)]);
        // One alone has the region for itself, and who is hardly in it has no part.
        share_out(&params, &bounds, &mask, &[left, far], &mut parts);
        assert!(parts.is_empty());
        share_out(&params, &bounds, &mask, &[left, BBox::from_ltrb(36.0, 9.0, 51.0, 50.0)], &mut parts);
        assert!(parts.is_empty());
        // Someone hidden behind the other is not seen.
        let hidden = BBox::from_ltrb(14.0, 20.0, 24.0, 60.0);
        share_out(&params, &bounds, &mask, &[left, right, hidden.translated(0.0, -20.0)], &mut parts);
        assert_eq!(parts.len(), 3);
        let nobody = Image::filled(80, 60, 0u8).unwrap();
        share_out(&params, &bounds, &nobody, &[left, right], &mut parts);
        assert!(parts.iter().all(|p| p.bbox(&params).is_none()));
    }
}
