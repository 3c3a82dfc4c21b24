//! What stands out at a point: the part around it whose colours are not those of the surroundings, at the size at which the two
//! differ most.

use super::patch::{Grid, color_at};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::regions::RegionFinder;

/// Cells a side of what is looked at.
const CELLS: usize = 64;
/// What is looked at, in sizes of the thing.
const AROUND: f64 = 2.2;
/// From one size to the next.
const STEP: f64 = 1.3;
/// The smallest thing, pixels.
const SMALLEST: f64 = 10.0;
/// How much of a box has to be of the thing's colours, above how much of its surroundings.
const LEAST: f64 = 0.45;
/// Levels of each channel of a histogram.
const LEVELS: usize = 8;

/// The box of what stands out at `point`, not longer than `largest` pixels.
pub(super) fn find(now: &Frame, point: Point, largest: f64) -> Option<BBox> {
    let sizes = std::iter::successors(Some(SMALLEST), |size| Some(size * STEP)).take_while(|size| *size <= largest);
    let found = sizes.filter_map(|size| at_size(now, point, size));
    found.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, score)| *score >= LEAST).map(|(bbox, _)| bbox)
}

/// The thing at one size, with how much it stands out.
fn at_size(now: &Frame, point: Point, size: f64) -> Option<(BBox, f64)> {
    let grid = Grid::around(point, AROUND * size, CELLS);
    let image = now.color();
    let colors: Vec<Rgb8> = grid.cells_with_centers().map(|at| color_at(image, at)).collect();
    let (cx, cy) = grid.cell_of(point);
    // Distances from the point by the longer of the two sides, in halves of the thing.
    let half = grid.cells(0.5 * size);
    let away = |k: usize| {
        let (x, y) = ((k % grid.side) as f64 + 0.5 - cx, (k / grid.side) as f64 + 0.5 - cy);
        x.abs().max(y.abs()) / half
    };
    let (mut inner, mut outer) = (Histogram::default(), Histogram::default());
    for (k, color) in colors.iter().enumerate() {
        match away(k) {
            near if near <= 0.6 => inner.add(*color),
            far if far > 1.4 => outer.add(*color),
            _ => {}
        }
    }
    let is_of = |k: usize| colors.get(k).is_some_and(|color| inner.share(*color) > outer.share(*color));
    let mut mask =
        Image::from_fn(grid.side, grid.side, |x, y| if is_of(y * grid.side + x) { 255_u8 } else { 0 }).ok()?;
    let mut scratch = MorphologyScratch::default();
    dilate(&mut mask, 1, &mut scratch).ok()?;
    erode(&mut mask, 2, &mut scratch).ok()?;
    dilate(&mut mask, 1, &mut scratch).ok()?;
    let mut finder = RegionFinder::default();
    let regions = finder.find(mask.view(), 9);
    let holds = |b: pursuit_vision::PixelWindow| {
        (b.x as f64..=(b.x + b.width) as f64).contains(&cx) && (b.y as f64..=(b.y + b.height) as f64).contains(&cy)
    };
    let region = regions.iter().filter(|region| holds(region.bounds)).max_by_key(|region| region.area)?;
    let b = region.bounds;
    let whole = b.x > 0 && b.y > 0 && b.x + b.width < grid.side && b.y + b.height < grid.side;
    let longest = b.width.max(b.height) as f64 / (2.0 * half);
    // A thing much smaller than what was looked for is found at its own size.
    if !(whole && (0.6..=1.4).contains(&longest)) {
        return None;
    }
    let filled = region.area as f64 / (b.width * b.height) as f64;
    let beyond = (0..colors.len()).filter(|k| away(*k) > 1.4);
    let (mut all, mut alike) = (0_usize, 0_usize);
    for k in beyond {
        all += 1;
        alike += usize::from(is_of(k));
    }
    let score = filled - alike as f64 / all.max(1) as f64;
    Some((grid.bbox(b.x, b.y, b.width, b.height), score))
}

/// How often which colours are seen.
struct Histogram {
    counts: Vec<f32>,
    total: f32,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: vec![0.0; LEVELS * LEVELS * LEVELS], total: 0.0 }
    }
}

impl Histogram {
    fn index([r, g, b]: Rgb8) -> usize {
        let level = |value: u8| usize::from(value) * LEVELS / 256;
        (level(r) * LEVELS + level(g)) * LEVELS + level(b)
    }

    fn add(&mut self, color: Rgb8) {
        if let Some(count) = self.counts.get_mut(Self::index(color)) {
            *count += 1.0;
            self.total += 1.0;
        }
    }

    fn share(&self, color: Rgb8) -> f32 {
        self.counts.get(Self::index(color)).map_or(0.0, |count| count / self.total.max(1.0))
    }
}
