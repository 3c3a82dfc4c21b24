use super::RegionParams;
use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;
use serde::{Deserialize, Serialize};

/// Depths of a grid of `side` × `side` points spread over a box, in millimetres, 0 = no data; points outside the frame are
/// left out.
pub fn samples<'a>(depth: ImageView<'a, u16>, bbox: &BBox, side: usize) -> impl Iterator<Item = u16> + 'a {
    let size = depth.size();
    let (left, top) = (bbox.left(), bbox.top());
    let (dx, dy) = (bbox.width() / side as f64, bbox.height() / side as f64);
    let inside = |v: f64, n: usize| (v >= 0.0 && v < n as f64).then_some(v as usize);
    (0..side).filter_map(move |i| inside(top + (i as f64 + 0.5) * dy, size.height)).flat_map(move |y| {
        let row = depth.row(y);
        (0..side).filter_map(move |j| inside(left + (j as f64 + 0.5) * dx, size.width)).map(move |x| row[x])
    })
}

/// A mean of depths that leaves out what has no data (zhai2024, eq. 20: "∉ d = 0").
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeanDepth {
    sum_m: f64,
    count: u32,
}

impl MeanDepth {
    /// Takes in one depth in metres; 0 is no data.
    pub fn add(&mut self, m: f64) {
        if m > 0.0 {
            self.sum_m += m;
            self.count += 1;
        }
    }

    /// How many had data.
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// The mean in metres; `None` where nothing had data.
    pub fn mean_m(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum_m / f64::from(self.count))
    }
}

/// What the depth image says of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxDepth {
    /// Mean of the pixels with data, in metres (zhai2024, eq. 20); `None` where too few have any.
    pub mean_m: Option<f64>,
    /// The share of pixels with data, `[0, 1]`.
    pub valid: f64,
    /// The share of those that are nearer than a limit, `[0, 1]`.
    pub nearer: f64,
    /// Mean of those, in metres.
    pub nearer_m: Option<f64>,
}

impl BoxDepth {
    /// Looks at the inner part of `bbox`; nearer is what is nearer than `limit_m`.
    pub fn of(params: &RegionParams, depth: ImageView<'_, u16>, bbox: &BBox, limit_m: f64) -> Self {
        let mut points = 0_u32;
        let (mut all, mut nearer) = (MeanDepth::default(), MeanDepth::default());
        for mm in samples(depth, &bbox.scaled(params.inner), params.side) {
            let m = f64::from(mm) / 1000.0;
            points += 1;
            all.add(m);
            if m < limit_m {
                nearer.add(m);
            }
        }
        let share = |part: u32, whole: u32| if whole > 0 { f64::from(part) / f64::from(whole) } else { 0.0 };
        let valid = share(all.count(), points);
        Self {
            mean_m: all.mean_m().filter(|_| valid >= params.least_valid),
            valid,
            nearer: share(nearer.count(), all.count()),
            nearer_m: nearer.mean_m(),
        }
    }
}

/// The distance of a target's surface: of its pixels alone, without those of what is before or behind it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Mean distance in metres, > 0.
    pub mean_m: f64,
    /// The share of the box's pixels that are part of it, `[0, 1]`.
    pub share: f64,
}

impl Surface {
    /// Bins of the histogram that the first distance is found in.
    const FIRST_BINS: usize = 160;

    /// The commonest distance in the middle of `bbox`, to begin with.
    pub fn first(params: &RegionParams, depth: ImageView<'_, u16>, bbox: &BBox, half_m: f64) -> Option<Self> {
        let mut counts = [0_u32; Self::FIRST_BINS];
        for mm in samples(depth, &bbox.scaled(params.first_part), params.side).filter(|mm| *mm > 0) {
            let bin = (f64::from(mm) / 1000.0 / params.first_bin_m) as usize;
            if let Some(count) = counts.get_mut(bin) {
                *count += 1;
            }
        }
        // Of the two bins that hold most together, so that a border between them does no harm.
        let at = (1..counts.len()).max_by_key(|k| (counts[k - 1] + counts[*k], std::cmp::Reverse(*k)))?;
        (counts[at - 1] + counts[at] > 0).then_some(())?;
        let near = Self::near(params, depth, bbox, at as f64 * params.first_bin_m, half_m)?;
        // Again about what was found, which lies anywhere in those bins.
        Self::near(params, depth, bbox, near.mean_m, half_m)
    }

    /// The mean of the pixels of `bbox` within `half_m` of `about_m`; `None` where too few are.
    pub fn near(
        params: &RegionParams,
        depth: ImageView<'_, u16>,
        bbox: &BBox,
        about_m: f64,
        half_m: f64,
    ) -> Option<Self> {
        let (mut all, mut count, mut sum) = (0_u32, 0_u32, 0.0);
        for mm in samples(depth, &bbox.scaled(params.inner), params.side) {
            let m = f64::from(mm) / 1000.0;
            all += 1;
            if mm > 0 && (m - about_m).abs() <= half_m {
                (count, sum) = (count + 1, sum + m);
            }
        }
        let share = f64::from(count) / f64::from(all.max(1));
        (share >= params.least_surface).then(|| Self { mean_m: sum / f64::from(count), share })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// A wall at 3 m, a box of 40 x 40 at 2 m, the left quarter of which something at 1 m covers; every fifth row is empty.
    fn scene() -> (Image<u16>, BBox) {
        let image = Image::from_fn(120, 100, |x, y| match (x, y) {
            (_, y) if y % 5 == 0 => 0,
            (40..50, 20..80) => 1000,
            (40..80, 30..70) => 2000,
            _ => 3000,
        });
        (image.unwrap(), BBox::from_ltwh(40.0, 30.0, 40.0, 40.0))
    }

    #[test]
    fn means_leave_out_what_has_no_data() {
        let (image, bbox) = scene();
        let got = BoxDepth::of(&RegionParams::default(), image.view(), &bbox, 1.5);
        // The inner box is 44 to 76: of 32 columns six are covered.
        assert!((got.nearer - 6.0 / 32.0).abs() < 0.03 && (got.valid - 0.8).abs() < 0.05, "{got:?}");
        assert!((got.mean_m.unwrap() - (6.0 + 26.0 * 2.0) / 32.0).abs() < 0.03, "{got:?}");
        assert!((got.nearer_m.unwrap() - 1.0).abs() < 1e-9);
        let none = BoxDepth::of(
            &RegionParams::default(),
            Image::filled(50, 50, 0).unwrap().view(),
            &bbox.translated(-35.0, -25.0),
            1.5,
        );
        assert_eq!(none, BoxDepth { mean_m: None, valid: 0.0, nearer: 0.0, nearer_m: None });
        let outside = BoxDepth::of(&RegionParams::default(), image.view(), &BBox::from_ltwh(500.0, 0.0, 9.0, 9.0), 1.5);
        assert_eq!((outside.mean_m, outside.valid), (None, 0.0));
    }

    #[test]
    fn a_surface_is_the_target_alone() {
        let (image, bbox) = scene();
        let first = Surface::first(&RegionParams::default(), image.view(), &bbox, 0.3).unwrap();
        assert!((first.mean_m - 2.0).abs() < 1e-9 && (first.share - 0.8 * 26.0 / 32.0).abs() < 0.05, "{first:?}");
        let wider = Surface::near(&RegionParams::default(), image.view(), &bbox, 1.5, 0.6).unwrap();
        assert!((wider.mean_m - (6.0 + 26.0 * 2.0) / 32.0).abs() < 0.03);
        assert_eq!(Surface::near(&RegionParams::default(), image.view(), &bbox, 5.0, 0.3), None);
        assert_eq!(
            Surface::first(&RegionParams::default(), Image::filled(120, 100, 0).unwrap().view(), &bbox, 0.3),
            None
        );
        // Two bins share it: 2.02 m is 20 mm above the border of two bins.
        let flat = Image::from_fn(120, 100, |x, _| 1990 + 20 * (x / 8 % 2) as u16).unwrap();
        assert!(
            (Surface::first(&RegionParams::default(), flat.view(), &bbox, 0.3).unwrap().mean_m - 2.0).abs() < 0.002
        );
    }

    #[test]
    fn samples_spread_over_boxes_within_the_frame() {
        let image = Image::from_fn(10, 10, |x, y| (10 * y + x) as u16).unwrap();
        let at = |bbox: BBox| samples(image.view(), &bbox, 2).collect::<Vec<_>>();
        assert_eq!(at(BBox::from_ltwh(2.0, 4.0, 4.0, 2.0)), [43, 45, 53, 55]);
        assert_eq!(at(BBox::from_ltwh(-2.0, -1.0, 4.0, 4.0)), [1, 21]);
        assert_eq!(at(BBox::from_ltwh(f64::NAN, 0.0, 4.0, 4.0)), [0_u16; 0]);
    }
}
