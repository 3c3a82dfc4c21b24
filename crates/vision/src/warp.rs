//! Affine maps of the plane and warps of images by them.

use crate::Result;
use multiversion::multiversion;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::{Image, ImageView};
use serde::{Deserialize, Serialize};

/// The map (x, y) → (xx·x + xy·y + x₀, yx·x + yy·y + y₀) of continuous pixels; every number finite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 6]", into = "[f64; 6]")]
pub struct Affine {
    m: [f64; 6],
}

impl From<Affine> for [f64; 6] {
    fn from(map: Affine) -> Self {
        map.m
    }
}

impl TryFrom<[f64; 6]> for Affine {
    type Error = &'static str;

    fn try_from(m: [f64; 6]) -> Result<Self, Self::Error> {
        Self::new(m).ok_or("the numbers of an affine map must be finite")
    }
}

impl Affine {
    /// What changes nothing.
    pub const IDENTITY: Self = Self { m: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0] };

    /// The map of the rows (xx, xy, x₀), (yx, yy, y₀); `None` unless all are finite.
    pub fn new(m: [f64; 6]) -> Option<Self> {
        m.iter().all(|v| v.is_finite()).then_some(Self { m })
    }

    /// Scaling by `scale` and turning by `angle_rad` (clockwise on the screen, x towards y) about the origin, then
    /// moving by `(dx, dy)`; `None` unless all are finite.
    pub fn similarity(scale: f64, angle_rad: f64, dx: f64, dy: f64) -> Option<Self> {
        let (sin, cos) = angle_rad.sin_cos();
        Self::new([scale * cos, -scale * sin, dx, scale * sin, scale * cos, dy])
    }

    /// Moving by `(dx, dy)`; `None` unless both are finite.
    pub fn translation(dx: f64, dy: f64) -> Option<Self> {
        Self::similarity(1.0, 0.0, dx, dy)
    }

    /// This map's linear part about `center` instead of about the origin: the centre goes where its own translation
    /// takes it.
    #[must_use]
    pub fn about(&self, center: Point) -> Self {
        let [xx, xy, x, yx, yy, y] = self.m;
        let (cx, cy) = (center.x, center.y);
        Self { m: [xx, xy, x + cx - xx * cx - xy * cy, yx, yy, y + cy - yx * cx - yy * cy] }
    }

    /// Rows (xx, xy, x₀), (yx, yy, y₀).
    pub const fn coefficients(&self) -> [f64; 6] {
        self.m
    }

    /// The image of `p`.
    #[inline]
    pub fn apply(&self, p: Point) -> Point {
        let [xx, xy, x, yx, yy, y] = self.m;
        Point::new(xx * p.x + xy * p.y + x, yx * p.x + yy * p.y + y)
    }

    /// `first`, then this map.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let [xx, xy, x, yx, yy, y] = self.m;
        let [a, b, c, d, e, f] = first.m;
        let m = [
            xx * a + xy * d,
            xx * b + xy * e,
            xx * c + xy * f + x,
            yx * a + yy * d,
            yx * b + yy * e,
            yx * c + yy * f + y,
        ];
        Self { m }
    }

    /// The map back; `None` when there is none.
    pub fn inverse(&self) -> Option<Self> {
        let [xx, xy, x, yx, yy, y] = self.m;
        let inverse = 1.0 / (xx * yy - xy * yx);
        let (a, b, d, e) = (yy * inverse, -xy * inverse, -yx * inverse, xx * inverse);
        Self::new([a, b, -a * x - b * y, d, e, -d * x - e * y])
    }

    /// Factor by which lengths grow: the root of the determinant (of its absolute value).
    pub fn scale(&self) -> f64 {
        let [xx, xy, _, yx, yy, _] = self.m;
        (xx * yy - xy * yx).abs().sqrt()
    }

    /// Angle by which the map turns, radians (clockwise on the screen); exact for similarities.
    pub fn angle_rad(&self) -> f64 {
        let [xx, xy, _, yx, yy, _] = self.m;
        (yx - xy).atan2(xx + yy)
    }
}

/// Fills `out` (whose size says how much) with `image` warped: the pixel centred at p of `out` becomes the image at
/// `source_from_out`(p), interpolated bilinearly and rounded; beyond the image its border pixels are repeated.
pub fn warp(image: ImageView<'_, u8>, source_from_out: &Affine, out: &mut Image<u8>) {
    for y in 0..out.height() {
        let start = source_from_out.apply(Point::new(0.5, y as f64 + 0.5));
        let [xx, _, _, yx, _, _] = source_from_out.m;
        warp_row(image, (start.x - 0.5, start.y - 0.5), (xx, yx), out.row_mut(y));
    }
}

/// As [`warp`] to a patch of `size` pixels in an image's memory.
///
/// # Errors
/// When a side is 0 or too long.
pub fn warp_to(image: ImageView<'_, u8>, source_from_out: &Affine, size: Size, out: &mut Image<u8>) -> Result<()> {
    out.resize_for_overwrite(size, 0)?;
    warp(image, source_from_out, out);
    Ok(())
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn warp_row(image: ImageView<'_, u8>, (x, y): (f64, f64), (step_x, step_y): (f64, f64), out: &mut [u8]) {
    let (width, height) = (image.width() as f64, image.height() as f64);
    for (i, out) in out.iter_mut().enumerate() {
        let at_x = (x + i as f64 * step_x).clamp(-1.0, width);
        let at_y = (y + i as f64 * step_y).clamp(-1.0, height);
        let (column, row) = (at_x.floor(), at_y.floor());
        let (across, down) = ((at_x - column) as f32, (at_y - row) as f32);
        let (column, row) = (column as isize, row as isize);
        let inside =
            column >= 0 && row >= 0 && column + 1 < image.width() as isize && row + 1 < image.height() as isize;
        let [a, b, c, d] = if inside {
            let (above, below) = (image.row(row as usize), image.row(row as usize + 1));
            let i = column as usize;
            [above[i], above[i + 1], below[i], below[i + 1]]
        } else {
            let at = |dx, dy| image.clamped(column + dx, row + dy);
            [at(0, 0), at(1, 0), at(0, 1), at(1, 1)]
        }
        .map(f32::from);
        let (above, below) = (a + across * (b - a), c + across * (d - c));
        *out = (above + down * (below - above) + 0.5) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn near(a: Point, b: Point) -> bool {
        a.distance(b) < 1e-9 * (1.0 + a.x.abs() + a.y.abs())
    }

    #[test]
    fn a_similarity_scales_turns_and_moves() {
        let map = Affine::similarity(2.0, std::f64::consts::FRAC_PI_2, 10.0, 20.0).unwrap();
        assert!(near(map.apply(Point::new(1.0, 0.0)), Point::new(10.0, 22.0)));
        assert!(near(map.apply(Point::new(0.0, 1.0)), Point::new(8.0, 20.0)));
        assert!((map.scale() - 2.0).abs() < 1e-12 && (map.angle_rad() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let about = map.about(Point::new(5.0, 7.0));
        assert!(near(about.apply(Point::new(5.0, 7.0)), Point::new(15.0, 27.0)));
        assert!(near(about.apply(Point::new(6.0, 7.0)), Point::new(15.0, 29.0)));
        assert!(Affine::translation(f64::NAN, 0.0).is_none() && Affine::new([f64::INFINITY; 6]).is_none());
        assert!(Affine::new([1.0, 2.0, 0.0, 2.0, 4.0, 0.0]).unwrap().inverse().is_none());
        assert_eq!(Affine::try_from([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]), Ok(Affine::IDENTITY));
        assert!(Affine::try_from([f64::NAN; 6]).is_err());
        assert_eq!(<[f64; 6]>::from(map), map.coefficients());
    }

    proptest! {
        #[test]
        fn maps_compose_and_invert(a in prop::array::uniform6(-3.0f64..3.0), b in prop::array::uniform6(-3.0f64..3.0), x in -9.0f64..9.0, y in -9.0f64..9.0) {
            let (a, b, p) = (Affine::new(a).unwrap(), Affine::new(b).unwrap(), Point::new(x, y));
            prop_assert!(near(a.after(&b).apply(p), a.apply(b.apply(p))));
            prop_assume!(a.scale() > 0.1);
            prop_assert!(a.inverse().unwrap().apply(a.apply(p)).distance(p) < 1e-6);
        }

        #[test]
        fn warps_equal_the_twin(m in prop::array::uniform6(-1.5f64..1.5), dx in -30.0f64..50.0, dy in -30.0f64..40.0) {
            let image = Image::from_fn(37, 23, |x, y| (x * 37 + y * y * 11 + x * y * 3) as u8).unwrap();
            let map = Affine::new([m[0], m[1], dx, m[3], m[4], dy]).unwrap();
            let mut out = Image::filled(1, 1, 0).unwrap();
            warp_to(image.view(), &map, Size::new(15, 17), &mut out).unwrap();
            for y in 0..17 {
                for x in 0..15 {
                    let p = map.apply(Point::new(x as f64 + 0.5, y as f64 + 0.5));
                    let (px, py) = (p.x - 0.5, p.y - 0.5);
                    let mut want = 0.0;
                    for (j, wy) in [(0, 1.0 - (py - py.floor())), (1, py - py.floor())] {
                        for (i, wx) in [(0, 1.0 - (px - px.floor())), (1, px - px.floor())] {
                            want += wx * wy * f64::from(image.view().clamped(px.floor() as isize + i, py.floor() as isize + j));
                        }
                    }
                    prop_assert!((f64::from(out.row(y)[x]) - want).abs() < 0.51, "{} {}", out.row(y)[x], want);
                }
            }
        }
    }

    #[test]
    fn the_identity_copies_and_absurd_maps_are_harmless() {
        let image = Image::from_fn(9, 7, |x, y| (x * 20 + y) as u8).unwrap();
        let mut out = Image::filled(9, 7, 0).unwrap();
        warp(image.view(), &Affine::IDENTITY, &mut out);
        assert_eq!(out, image);
        warp(image.view(), &Affine::new([1e300, 1e300, 1e300, -1e300, 1e300, 1e308]).unwrap(), &mut out);
        assert!(warp_to(image.view(), &Affine::IDENTITY, Size::new(0, 4), &mut out).is_err());
    }
}
