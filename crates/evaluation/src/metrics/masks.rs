//! Figures of masks, as DAVIS has them (Perazzi et al. 2016, "A benchmark dataset and evaluation methodology for video object
//! segmentation", section 5): region similarity J, boundary accuracy F, and their mean.

use pursuit_geometry::{Mask, Size};
use serde::{Deserialize, Serialize};

/// How far a boundary may be off, as a share of the image's diagonal.
pub const BOUNDARY_TOLERANCE: f64 = 0.008;
/// A frame counts as recalled above this.
const RECALLED: f64 = 0.5;

/// What one frame's mask is worth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MaskFigures {
    /// Region similarity, in `[0, 1]`.
    pub j: f64,
    /// Boundary accuracy, in `[0, 1]`.
    pub f: f64,
}

impl MaskFigures {
    /// Of the mask said, against the true one, in a picture of `size`.
    pub fn of(said: &Mask, truth: &Mask, size: Size) -> Self {
        Self { j: region_similarity(said, truth), f: boundary_accuracy(said, truth, size) }
    }
}

/// Figures over frames.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MaskScore {
    /// Mean of J and F: DAVIS's J&F.
    pub j_and_f: f64,
    /// Mean region similarity.
    pub j_mean: f64,
    /// Share of the frames with a region similarity above one half.
    pub j_recall: f64,
    /// Mean boundary accuracy.
    pub f_mean: f64,
    /// Share of the frames with a boundary accuracy above one half.
    pub f_recall: f64,
}

impl MaskScore {
    /// Over frames; `None` of none.
    pub fn over(frames: &[MaskFigures]) -> Option<Self> {
        let share = |of: fn(&MaskFigures) -> f64| frames.iter().map(of).sum::<f64>() / frames.len() as f64;
        let (j_mean, f_mean) = (share(|m| m.j), share(|m| m.f));
        let recall = |of: fn(&MaskFigures) -> f64| {
            frames.iter().filter(|m| of(m) > RECALLED).count() as f64 / frames.len() as f64
        };
        (!frames.is_empty()).then(|| Self {
            j_and_f: f64::midpoint(j_mean, f_mean),
            j_mean,
            j_recall: recall(|m| m.j),
            f_mean,
            f_recall: recall(|m| m.f),
        })
    }

    /// The means of several; `None` of none.
    pub fn mean(of: &[Self]) -> Option<Self> {
        let over = |figure: fn(&Self) -> f64| of.iter().map(figure).sum::<f64>() / of.len() as f64;
        (!of.is_empty()).then(|| Self {
            j_and_f: over(|m| m.j_and_f),
            j_mean: over(|m| m.j_mean),
            j_recall: over(|m| m.j_recall),
            f_mean: over(|m| m.f_mean),
            f_recall: over(|m| m.f_recall),
        })
    }
}

/// Region similarity J: intersection over union; 1 where both are empty.
pub fn region_similarity(said: &Mask, truth: &Mask) -> f64 {
    said.iou(truth)
}

/// Boundary accuracy F: the harmonic mean of the shares of either boundary that have a pixel of the other near, nearer than
/// [`BOUNDARY_TOLERANCE`] of the diagonal, in whole pixels rounded up. Where one mask has no boundary and the other has, 0; where none
/// has, 1.
pub fn boundary_accuracy(said: &Mask, truth: &Mask, size: Size) -> f64 {
    let tolerance = (BOUNDARY_TOLERANCE * (size.width as f64).hypot(size.height as f64)).ceil() as i64;
    let (said, truth) = (boundary(said, size), boundary(truth, size));
    let (precision, recall) = match (said.is_empty(), truth.is_empty()) {
        (true, true) => (1.0, 1.0),
        (false, false) => (share_near(&said, &truth, tolerance), share_near(&truth, &said, tolerance)),
        _ => return 0.0,
    };
    if precision + recall > 0.0 { 2.0 * precision * recall / (precision + recall) } else { 0.0 }
}

/// The boundary as the benchmark's own code draws it: pixels that differ from that to the right, below, or right below, where there is
/// one in the picture. Rows and columns.
fn boundary(mask: &Mask, size: Size) -> Vec<(i64, i64)> {
    let mask = mask.clipped_to(size);
    let mut pixels = Vec::new();
    let (Ok(width), Ok(height)) = (u32::try_from(size.width), u32::try_from(size.height)) else { return pixels };
    let Some(bounds) = mask.bounds() else { return pixels };
    let rows = (bounds.top() as u32).saturating_sub(1)..bounds.bottom() as u32;
    let columns = (bounds.left() as u32).saturating_sub(1)..bounds.right() as u32;
    for y in rows {
        for x in columns.clone() {
            let own = mask.contains(x, y);
            let (right, below) = (x + 1 < width, y + 1 < height);
            let differs = (right && mask.contains(x + 1, y) != own)
                || (below && mask.contains(x, y + 1) != own)
                || (right && below && mask.contains(x + 1, y + 1) != own);
            if differs {
                pixels.push((i64::from(y), i64::from(x)));
            }
        }
    }
    pixels
}

/// The share of `pixels` that have one of `others` at a distance of at most `radius`. Both are in order.
fn share_near(pixels: &[(i64, i64)], others: &[(i64, i64)], radius: i64) -> f64 {
    let is_near = |(y, x): (i64, i64)| {
        (y - radius..=y + radius).any(|row| {
            // Along this row the disk reaches so far.
            let reach = radius * radius - (row - y) * (row - y);
            let reach = (reach as f64).sqrt() as i64;
            let first = others.partition_point(|other| *other < (row, x - reach));
            others.get(first).is_some_and(|other| *other <= (row, x + reach))
        })
    };
    pixels.iter().filter(|pixel| is_near(**pixel)).count() as f64 / pixels.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: Size = Size::new(200, 150);

    fn square(left: usize, top: usize, side: usize) -> Mask {
        Mask::from_fn(SIZE, |x, y| (left..left + side).contains(&x) && (top..top + side).contains(&y))
    }

    /// The benchmark's definition, pixel by pixel: a picture of the boundary, dilated by a disk.
    fn slow(said: &Mask, truth: &Mask, size: Size) -> f64 {
        let Size { width, height } = size;
        let edges = |mask: &Mask| {
            let set = |x: usize, y: usize| mask.contains(x as u32, y as u32);
            let at = |x: usize, y: usize| {
                let (e, s) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
                set(x, y) != set(e, y)
                    || set(x, y) != set(x, s)
                    || (x < width - 1 && y < height - 1 && set(x, y) != set(e, s))
            };
            (0..height).map(|y| (0..width).map(|x| at(x, y)).collect()).collect::<Vec<Vec<bool>>>()
        };
        let radius = (BOUNDARY_TOLERANCE * (width as f64).hypot(height as f64)).ceil() as isize;
        let dilated = |of: &[Vec<bool>], x: usize, y: usize| {
            (-radius..=radius).any(|dy| {
                (-radius..=radius).any(|dx| {
                    let (Some(x), Some(y)) = (x.checked_add_signed(dx), y.checked_add_signed(dy)) else { return false };
                    dx * dx + dy * dy <= radius * radius && x < width && y < height && of[y][x]
                })
            })
        };
        let (a, b) = (edges(said), edges(truth));
        let share = |of: &[Vec<bool>], other: &[Vec<bool>]| {
            let (mut all, mut near) = (0.0, 0.0);
            for y in 0..height {
                for x in (0..width).filter(|x| of[y][*x]) {
                    all += 1.0;
                    near += f64::from(u8::from(dilated(other, x, y)));
                }
            }
            (all, near / f64::max(all, 1.0))
        };
        let ((na, p), (nb, r)) = (share(&a, &b), share(&b, &a));
        match (na > 0.0, nb > 0.0) {
            (false, false) => 1.0,
            (true, true) if p + r > 0.0 => 2.0 * p * r / (p + r),
            _ => 0.0,
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn boundaries_are_compared_as_defined(
            width in 1_usize..24, height in 1_usize..18, seed in any::<u64>(), blob in 1_u64..5,
        ) {
            let size = Size::new(width, height);
            let bit = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ seed).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 63 == 1;
            let of = |k: u64| Mask::from_fn(size, |x, y| bit(k + (x as u64 / blob) * 31 + (y as u64 / blob) * 1009));
            let (a, b) = (of(1), of(77));
            let (fast, slow) = (boundary_accuracy(&a, &b, size), slow(&a, &b, size));
            prop_assert!((fast - slow).abs() < 1e-12, "{fast} {slow}");
        }
    }

    #[test]
    fn a_boundary_may_be_off_by_the_tolerance() {
        // .008 · 250 px = 2 px.
        let truth = square(50, 40, 60);
        assert_eq!(MaskFigures::of(&truth, &truth, SIZE), MaskFigures { j: 1.0, f: 1.0 });
        assert_eq!(boundary_accuracy(&square(52, 40, 60), &truth, SIZE), 1.0);
        let off = boundary_accuracy(&square(55, 40, 60), &truth, SIZE);
        assert!(off > 0.4 && off < 0.75, "two sides of four are there: {off}");
        assert_eq!(MaskFigures::of(&Mask::default(), &truth, SIZE), MaskFigures { j: 0.0, f: 0.0 });
        assert_eq!(MaskFigures::of(&Mask::default(), &Mask::default(), SIZE), MaskFigures { j: 1.0, f: 1.0 });
    }

    #[test]
    fn means_and_recalls_are_over_frames() {
        let frames = [(1.0, 0.9), (0.6, 0.3), (0.2, 0.0)].map(|(j, f)| MaskFigures { j, f });
        let score = MaskScore::over(&frames).unwrap_or_default();
        assert!((score.j_mean - 0.6).abs() < 1e-12 && (score.f_mean - 0.4).abs() < 1e-12);
        assert!((score.j_and_f - 0.5).abs() < 1e-12);
        assert_eq!((score.j_recall, score.f_recall), (2.0 / 3.0, 1.0 / 3.0));
        assert_eq!(MaskScore::over(&[]), None);
        assert_eq!(MaskScore::mean(&[score, score]).map(|s| s.j_mean), Some(score.j_mean));
    }
}
