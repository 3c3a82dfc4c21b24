use crate::geometry::{AngleFormula, Direction, Lens, direction_of, pixel_of};
use crate::{PtzError, Result};
use pursuit_geometry::Point;
use pursuit_imaging::{Image, Rgb8};
use std::sync::Arc;

/// What a simulated camera looks at.
pub trait World {
    /// The picture at `time_s` of a camera with this lens that looks there.
    ///
    /// # Errors
    /// Where the world has no picture of that moment.
    fn render(&mut self, time_s: f64, lens: &Lens, pose: Direction) -> Result<Image<Rgb8>>;
}

/// A world made by a function.
#[derive(Debug, Clone)]
pub struct Rendered<F>(pub F);

impl<F: FnMut(f64, &Lens, Direction) -> Result<Image<Rgb8>>> World for Rendered<F> {
    fn render(&mut self, time_s: f64, lens: &Lens, pose: Direction) -> Result<Image<Rgb8>> {
        (self.0)(time_s, lens, pose)
    }
}

/// A still panorama in equirectangular projection: its columns are pans, its rows tilts, equally spaced.
///
/// A full one spans 360° by 180°; a part is placed by the angles of its edges. What lies beyond is black.
#[derive(Debug, Clone)]
pub struct Panorama {
    image: Arc<Image<Rgb8>>,
    left_deg: f64,
    top_deg: f64,
    deg_per_px: f64,
}

impl Panorama {
    /// A panorama whose left edge lies at the pan `left_deg` and that spans `width_deg`; its middle row is the horizon.
    ///
    /// # Errors
    /// Unless the width is in (0, 360].
    pub fn new(image: Arc<Image<Rgb8>>, left_deg: f64, width_deg: f64) -> Result<Self> {
        crate::error::require(
            "width_deg",
            width_deg,
            width_deg > 0.0 && width_deg <= 360.0,
            "above 0 and at most 360",
        )?;
        crate::error::require("left_deg", left_deg, left_deg.abs() <= 360.0, "between -360 and 360")?;
        let deg_per_px = width_deg / image.width() as f64;
        let top_deg = 0.5 * deg_per_px * image.height() as f64;
        Ok(Self { image, left_deg, top_deg, deg_per_px })
    }

    /// The point of the panorama that shows a direction.
    fn point(&self, direction: Direction) -> Point {
        let pan = (direction.pan_deg - self.left_deg).rem_euclid(360.0);
        Point::new(pan / self.deg_per_px, (self.top_deg - direction.tilt_deg) / self.deg_per_px)
    }
}

impl World for Panorama {
    fn render(&mut self, _time_s: f64, lens: &Lens, pose: Direction) -> Result<Image<Rgb8>> {
        resample(lens, |pixel| {
            sample(&self.image, self.point(direction_of(lens, pose, pixel, AngleFormula::PanThenTilt)))
        })
    }
}

/// A clip of a wide camera that stands still: the simulated camera sees a part of it. What lies beyond is black.
pub struct WideClip<F> {
    lens: Lens,
    frame_at: F,
    last: Option<(f64, Arc<Image<Rgb8>>)>,
}

impl<F: FnMut(f64) -> Result<Arc<Image<Rgb8>>>> WideClip<F> {
    /// A clip taken with `lens`; `frame_at` gives its picture at a time.
    pub const fn new(lens: Lens, frame_at: F) -> Self {
        Self { lens, frame_at, last: None }
    }
}

impl<F: FnMut(f64) -> Result<Arc<Image<Rgb8>>>> World for WideClip<F> {
    fn render(&mut self, time_s: f64, lens: &Lens, pose: Direction) -> Result<Image<Rgb8>> {
        let frame = match &self.last {
            Some((at, frame)) if *at == time_s => frame.clone(),
            _ => (self.frame_at)(time_s)?,
        };
        self.last = Some((time_s, frame.clone()));
        if frame.size() != self.lens.size() {
            let (found, wanted) = (frame.size(), self.lens.size());
            return Err(PtzError::Parameter {
                name: "width of the clip's frame",
                value: found.width as f64,
                wanted: if found.width == wanted.width {
                    "as high as the lens says"
                } else {
                    "as wide as the lens says"
                },
            });
        }
        resample(lens, |pixel| {
            let direction = direction_of(lens, pose, pixel, AngleFormula::PanThenTilt);
            pixel_of(&self.lens, Direction::AHEAD, direction).map_or([0; 3], |point| sample(&frame, point))
        })
    }
}

/// A picture whose pixels are `color` at their centres.
fn resample(lens: &Lens, mut color: impl FnMut(Point) -> Rgb8) -> Result<Image<Rgb8>> {
    let size = lens.size();
    Ok(Image::from_fn(size.width, size.height, |x, y| color(Point::new(x as f64 + 0.5, y as f64 + 0.5)))?)
}

/// The colour at a point, bilinear between the centres of pixels; black outside of the picture.
fn sample(image: &Image<Rgb8>, at: Point) -> Rgb8 {
    let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < image.width() as f64 && at.y < image.height() as f64;
    if !inside {
        return [0; 3];
    }
    let (x, y) = (at.x - 0.5, at.y - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (part_x, part_y) = (x - left, y - top);
    let (left, top) = (left as isize, top as isize);
    let view = image.view();
    std::array::from_fn(|channel| {
        let at = |dx: isize, dy: isize| f64::from(view.clamped(left + dx, top + dy)[channel]);
        let upper = at(0, 0) + part_x * (at(1, 0) - at(0, 0));
        let lower = at(0, 1) + part_x * (at(1, 1) - at(0, 1));
        (upper + part_y * (lower - upper)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::Size;

    fn lens() -> Lens {
        Lens::new(Size::new(65, 37), 30.0).unwrap()
    }

    /// A panorama of 1 pixel a degree with one white pixel.
    fn with_white(pan: usize, row: usize) -> Panorama {
        let image = Image::from_fn(360, 180, |x, y| if (x, y) == (pan, row) { [255; 3] } else { [10; 3] }).unwrap();
        Panorama::new(Arc::new(image), 0.0, 360.0).unwrap()
    }

    #[test]
    fn a_panorama_is_seen_where_the_camera_looks() {
        // The pixel (100, 80) is centred at pan 100.5°, tilt 90 − 80.5 = 9.5°.
        let mut world = with_white(100, 80);
        let picture = world.render(0.0, &lens(), Direction::new(100.5, 9.5)).unwrap();
        assert_eq!(picture.row(18)[32], [255; 3], "in the middle");
        assert_eq!(picture.row(18)[10], [10; 3]);
        let seam = with_white(0, 89).render(0.0, &lens(), Direction::new(360.5, 0.5)).unwrap();
        assert_eq!(seam.row(18)[32], [255; 3], "pans wrap");
    }

    #[test]
    fn a_part_of_a_panorama_is_black_beyond_its_edges() {
        let image = Arc::new(Image::filled(90, 40, [200; 3]).unwrap());
        let mut world = Panorama::new(image, -45.0, 90.0).unwrap();
        assert_eq!(world.render(0.0, &lens(), Direction::AHEAD).unwrap().row(18)[32], [200; 3]);
        assert_eq!(world.render(0.0, &lens(), Direction::new(60.0, 0.0)).unwrap().row(18)[40], [0; 3]);
        assert_eq!(world.render(0.0, &lens(), Direction::new(0.0, 25.0)).unwrap().row(18)[32], [0; 3]);
        let image = Arc::new(Image::filled(9, 4, [0; 3]).unwrap());
        assert!(Panorama::new(image.clone(), 0.0, 0.0).is_err() && Panorama::new(image, 999.0, 90.0).is_err());
    }

    #[test]
    fn a_clip_seen_by_its_own_lens_is_itself() {
        let size = Size::new(64, 36);
        let own = Lens::new(size, 40.0).unwrap();
        let picture = Image::from_fn(64, 36, |x, y| [x as u8 * 3, y as u8 * 5, (x * y) as u8]).unwrap();
        let frame = Arc::new(picture.clone());
        let mut world = WideClip::new(own, move |_| Ok(frame.clone()));
        assert_eq!(world.render(0.0, &own, Direction::AHEAD).unwrap(), picture);
        // Looking at the right edge, the middle of the view is the edge of the clip.
        let right = world.render(0.0, &own, Direction::new(40.0, 0.0)).unwrap();
        assert_eq!(right.row(18)[40], [0; 3]);
        assert!(right.row(18)[28][0] > 150);
        let wrong = Arc::new(Image::filled(63, 36, [0; 3]).unwrap());
        assert!(WideClip::new(own, move |_| Ok(wrong.clone())).render(0.0, &own, Direction::AHEAD).is_err());
    }

    #[test]
    fn samples_are_bilinear() {
        let image = Image::from_fn(2, 2, |x, y| [(100 * x + 50 * y) as u8; 3]).unwrap();
        assert_eq!(sample(&image, Point::new(1.0, 1.0)), [75; 3]);
        assert_eq!(sample(&image, Point::new(0.75, 0.5)), [25; 3]);
        assert_eq!(sample(&image, Point::new(0.5, 1.0)), [25; 3]);
        assert_eq!(sample(&image, Point::new(-0.1, 1.0)), [0; 3]);
        assert_eq!(sample(&image, Point::new(1.0, 2.0)), [0; 3]);
    }
}
