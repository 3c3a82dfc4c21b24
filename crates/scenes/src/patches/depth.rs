//! A depth sensor that looks along with the camera, pixel by pixel registered, with the faults of real ones.

use super::world::World;
use crate::texture::fractal_noise;
use crate::view::possible;
use crate::{View, hash};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Image;

/// A sensor of the kind that projects a pattern from beside its camera.
pub(super) struct DepthSensor {
    /// Distance of the targets, in millimetres.
    pub(super) target_mm: Box<dyn Fn(f64) -> f64 + Send + Sync>,
    /// By how much things before the targets are nearer than these, in millimetres; nearer than 400 mm nothing is.
    pub(super) nearer_mm: f64,
    /// Fraction of pixels without a value.
    pub(super) holes: f64,
    /// How far the surfaces of targets and of what is before them stand out, in millimetres.
    pub(super) relief_mm: f64,
    /// Distance of the wall at the picture's top, in millimetres; `None`: it keeps its distance from the targets.
    pub(super) wall_mm: Option<f64>,
    /// Boxes of the backdrop that stand out from the wall, and their distances in millimetres.
    pub(super) clutter: Vec<(BBox, f64)>,
    /// Whether disparities come in eighths of a pixel.
    pub(super) quantised: bool,
}

/// Something that the sensor sees.
struct Seen {
    bbox: BBox,
    mm: f64,
    relief_mm: f64,
}

impl Seen {
    /// Its distance at a point of the picture.
    fn at(&self, key: u64, x: f64, y: f64) -> f64 {
        if self.relief_mm == 0.0 {
            return self.mm;
        }
        // The relief is its own: it moves and grows with it.
        let (u, v) = ((x - self.bbox.left()) / self.bbox.width(), (y - self.bbox.top()) / self.bbox.height());
        self.mm - self.relief_mm * fractal_noise(key, 2.6 * u, 2.6 * v, 2)
    }
}

/// Standard deviation of a reading over the squared distance: σ = 1.425e-6/mm · z² (Khoshelham & Elberink 2012, eq. 8).
const NOISE_PER_MM: f64 = 1.425e-6;
/// Distance between projector and camera of that sensor, in millimetres.
const BASELINE_MM: f64 = 75.0;
/// Its focal length over the picture's width.
const FOCAL: f64 = 580.0 / 640.0;
/// The wall behind everything, at the picture's top and bottom, in millimetres beyond the targets.
const WALL_MM: (f64, f64) = (1600.0, 700.0);
/// Pixels that share their fate when a reading fails.
const BLOTCH_PX: usize = 3;

impl DepthSensor {
    /// What the sensor says at `time_s`: millimetres, 0 where it does not know.
    pub(super) fn image(&self, world: &World, time_s: f64) -> Image<u16> {
        let (width, height) = (world.size.width, world.size.height);
        let target = (self.target_mm)(time_s);
        let frame = (time_s * world.fps).round() as i64 as u64;
        let key = hash::mix(world.seed ^ 0xde97, frame);
        let boxes = |things: &[super::world::Thing], mm: f64| -> Vec<Seen> {
            let seen = |bbox: BBox| Seen { bbox, mm, relief_mm: self.relief_mm };
            things.iter().filter_map(|t| Some(seen((t.path)(time_s)?))).collect()
        };
        let origin = (world.camera)(time_s);
        let mut surfaces: Vec<Seen> = self
            .clutter
            .iter()
            .map(|(bbox, mm)| Seen { bbox: bbox.translated(-origin.x, -origin.y), mm: *mm, relief_mm: 0.0 })
            .collect();
        surfaces.extend(boxes(&world.targets, target));
        surfaces.extend(boxes(&world.before, (target - self.nearer_mm).max(400.0)));
        let relief = hash::mix(world.seed, 0x7e11);
        let wall = self.wall_mm.map_or((target + WALL_MM.0, WALL_MM.1 - WALL_MM.0), |mm| (mm, -0.2 * mm));
        let mut row = vec![0.0f64; width];
        let mut data = Vec::with_capacity(width * height);
        for y in 0..height {
            let share = y as f64 / height as f64;
            row.fill(wall.0 + wall.1 * share);
            for seen in &surfaces {
                let bbox = &seen.bbox;
                // A pixel belongs to what covers its middle.
                if (bbox.top()..bbox.bottom()).contains(&(y as f64 + 0.5)) {
                    let column = |edge: f64| (edge - 0.5).ceil().clamp(0.0, width as f64) as usize;
                    let columns = column(bbox.left())..column(bbox.right()).max(column(bbox.left()));
                    for (x, mm) in columns.clone().zip(&mut row[columns]) {
                        *mm = seen.at(relief, x as f64 + 0.5, y as f64 + 0.5);
                    }
                }
            }
            let shadowed = shadows(&row);
            data.extend(row.iter().zip(shadowed).enumerate().map(|(x, (mm, shadowed))| {
                let at = (y * width + x) as u64;
                let blotch = ((y / BLOTCH_PX) * width + x / BLOTCH_PX) as u64;
                if shadowed || hash::unit(hash::mix(key, 1), blotch) < self.holes {
                    return 0;
                }
                let noise = f64::from(hash::nearly_normal(hash::mix(key, at) as u32));
                let mm = mm + NOISE_PER_MM * mm * mm * noise;
                let mm = if self.quantised { in_eighths(mm, width) } else { mm };
                mm.round().clamp(1.0, 65_535.0) as u16
            }));
        }
        Image::from_vec(data, width, height).unwrap_or_else(|_| unreachable!("scene sizes are checked when built"))
    }
}

/// The distance whose disparity in a picture `width` pixels wide is a whole number of eighths of a pixel.
fn in_eighths(mm: f64, width: usize) -> f64 {
    let eighths = 8.0 * BASELINE_MM * FOCAL * width as f64;
    eighths / (eighths / mm.max(1.0)).round().max(1.0)
}

/// Which pixels of a row the projector, to the right of the camera, does not reach: left of something nearer, as wide as
/// the difference of the two disparities (baseline · focal length / distance).
fn shadows(row: &[f64]) -> Vec<bool> {
    let disparity = |mm: f64| BASELINE_MM * FOCAL * row.len() as f64 / mm;
    let mut dark = vec![false; row.len()];
    // The projector sees column x at x - disparity. Going left, what is nearer takes its columns; what lies behind gets none
    // until the camera has passed the difference.
    let mut lit_down_to = f64::INFINITY;
    for (x, mm) in row.iter().enumerate().rev() {
        let seen_at = x as f64 - disparity(*mm);
        dark[x] = seen_at > lit_down_to;
        lit_down_to = lit_down_to.min(seen_at);
    }
    dark
}

/// The depth of a flat scene as a turned view sees it: the nearest reading, no mixing over edges; 0 beyond the picture.
pub(super) fn turned_depth(depth: &Image<u16>, home: &View, view: &View) -> Image<u16> {
    let read = |x: usize, y: usize| {
        let p = home.point_of(view.direction_of(Point::new(x as f64 + 0.5, y as f64 + 0.5)))?;
        let inside = p.x >= 0.0 && p.y >= 0.0;
        inside.then(|| depth.view().get(p.x as usize, p.y as usize).copied()).flatten()
    };
    let size = possible(view.size);
    let turned = Image::from_fn(size.width, size.height, |x, y| read(x, y).unwrap_or(0));
    turned.unwrap_or_else(|_| unreachable!("a possible size"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantised_disparities_are_eighths() {
        // 75 mm * 580 px = 43 500: at 2 m 21.75 px, at 2.01 m 21.64 px, nearer to 21.625 than to 21.75.
        assert!((in_eighths(2000.0, 640) - 2000.0).abs() < 1e-9);
        assert!((in_eighths(2010.0, 640) - 43_500.0 / 21.625).abs() < 1e-9);
        assert_eq!(in_eighths(1e12, 640), 348_000.0);
    }

    #[test]
    fn a_shadow_lies_left_of_what_is_nearer_and_is_as_wide_as_the_disparities_differ() {
        let mut row = vec![3000.0; 640];
        row[300..340].fill(1000.0);
        let dark = shadows(&row);
        let columns: Vec<usize> = (0..640).filter(|x| dark[*x]).collect();
        // 75 mm · 580 px · (1 / 1 m - 1 / 3 m) = 29 px; the 29th column is the first that light reaches again.
        assert_eq!((columns.first(), columns.last(), columns.len()), (Some(&272), Some(&299), 28));
        assert!(!shadows(&[2000.0; 640]).contains(&true));
    }
}
