//! What moves at a point: what differs from two earlier pictures, once the camera's own motion is taken out.

use super::AtPointParams;
use super::patch::{Grid, gray_at};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_vision::global_motion::{PictureMotion, PictureShift};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::regions::{Region, RegionFinder};

/// Cells a side of what is looked at.
const MOST_CELLS: usize = 128;
/// More than this part of the neighbourhood does not move by itself: the picture changes.
const MOST_MOVING: f64 = 0.3;
/// Fewer cells are noise.
const LEAST_CELLS: usize = 8;

/// The box of what moves at `point`, not longer than `largest` pixels.
pub(super) fn find(back: [&Frame; 2], now: &Frame, point: Point, largest: f64, params: &AtPointParams) -> Option<BBox> {
    let grid = Grid::around(point, 1.6 * largest, MOST_CELLS);
    let target = BBox::from_center_size(point, largest, largest);
    let [one, two] = back.map(|before| changes(before, now, &grid, &target, params.contrast));
    let (one, two) = (one?, two?);
    let mut at = one.iter().zip(&two).map(|(a, b)| if *a && *b { 255_u8 } else { 0 });
    let mut mask = Image::from_fn(grid.side, grid.side, |_, _| at.next().unwrap_or(0)).ok()?;
    let moving = mask.as_slice().iter().filter(|cell| **cell > 0).count();
    if moving as f64 > MOST_MOVING * mask.as_slice().len() as f64 {
        return None;
    }
    // A body has calm parts between its moving edges.
    let mut scratch = MorphologyScratch::default();
    dilate(&mut mask, 4, &mut scratch).ok()?;
    erode(&mut mask, 4, &mut scratch).ok()?;
    let mut finder = RegionFinder::default();
    let regions = finder.find(mask.view(), LEAST_CELLS);
    let (x, y) = grid.cell_of(point);
    let near = grid.cells(0.08 * largest).max(2.0);
    let best = regions.iter().filter(|region| is_whole(region, grid.side)).map(|region| (apart(region, x, y), region));
    let (apart, region) = best.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let bounds = region.bounds;
    let bbox = grid.bbox(bounds.x, bounds.y, bounds.width, bounds.height);
    (apart <= near && bbox.width().max(bbox.height()) <= largest).then_some(bbox)
}

/// Whether a region lies inside of what is looked at.
fn is_whole(region: &Region, side: usize) -> bool {
    let b = region.bounds;
    b.x > 0 && b.y > 0 && b.x + b.width < side && b.y + b.height < side
}

/// How far a point is from a region's bounds, cells.
fn apart(region: &Region, x: f64, y: f64) -> f64 {
    let b = region.bounds;
    let off = |at: f64, from: usize, length: usize| (from as f64 - at).max(at - (from + length) as f64).max(0.0);
    off(x, b.x, b.width).hypot(off(y, b.y, b.height))
}

/// Which cells differ from an earlier picture by more than what a pixel of misplacement makes.
fn changes(before: &Frame, now: &Frame, grid: &Grid, target: &BBox, contrast: u32) -> Option<Vec<bool>> {
    let mut motion = PictureMotion::by_flow(now.gray()).ok()?;
    let still = PictureShift::Everywhere { dx: 0.0, dy: 0.0 };
    let shift = motion.shift(before.gray(), std::slice::from_ref(target)).unwrap_or(still);
    let (earlier, image) = (before.gray(), now.gray());
    let size = now.size();
    let differs = |at: Point| {
        let (dx, dy) = shift.at(at)?;
        let there = Point::new(at.x + dx, at.y + dy);
        let inside =
            (1.0..size.width as f64 - 1.0).contains(&there.x) && (1.0..size.height as f64 - 1.0).contains(&there.y);
        if !inside {
            return Some(false);
        }
        let around =
            [-1.0, 0.0, 1.0].map(|y| [-1.0, 0.0, 1.0].map(|x| gray_at(earlier, Point::new(there.x + x, there.y + y))));
        let around = around.as_flattened();
        let (low, high) = (around.iter().min()?, around.iter().max()?);
        let value = gray_at(image, at);
        Some(u32::from(value.saturating_sub(*high).max(low.saturating_sub(value))) >= contrast)
    };
    grid.cells_with_centers().map(differs).collect()
}
