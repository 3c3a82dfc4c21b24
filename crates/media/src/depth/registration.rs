use crate::input::fault::Fault;
use crate::{MediaError, Result};
use pursuit_geometry::Size;
use pursuit_imaging::{Image, ImageView, Lens};

/// Moves depth from the camera that measured it into the picture of another one beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Registration {
    from: Lens,
    to: Lens,
    offset_mm: [f64; 3],
}

impl Registration {
    /// From the camera with the lens `from` into that with the lens `to`, which has the first one's origin at `offset_mm`
    /// (x right, y down, z ahead); both look the same way.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] where the offset is not finite.
    pub fn new(from: Lens, to: Lens, offset_mm: [f64; 3]) -> Result<Self> {
        if offset_mm.iter().all(|v| v.is_finite()) {
            Ok(Self { from, to, offset_mm })
        } else {
            Err(MediaError::unreadable("the depth camera's offset", "it must be three finite numbers in millimetres"))
        }
    }

    /// The depth as the other camera sees it in its picture of `size`: the nearest of what falls on a pixel. Each reading
    /// covers the pixels that its own pixel becomes.
    pub(crate) fn apply(&self, depth: ImageView<'_, u16>, size: Size) -> std::result::Result<Image<u16>, Fault> {
        let mut out = Image::filled(size.width, size.height, 0_u16)?;
        let ([fx, fy, cx, cy], [gx, gy, dx, dy]) = (self.from.pinhole_px(depth.size()), self.to.pinhole_px(size));
        let [tx, ty, tz] = self.offset_mm;
        let data = out.as_mut_slice();
        let rows = depth.size().height;
        for v in 0..rows {
            for (u, &mm) in depth.row(v).iter().enumerate().filter(|(_, mm)| **mm > 0) {
                let z = f64::from(mm);
                let there = z + tz;
                if there < 1.0 {
                    continue;
                }
                let column = |u: f64| dx + gx * ((u - cx) * z / fx + tx) / there;
                let row = |v: f64| dy + gy * ((v - cy) * z / fy + ty) / there;
                let span = |low: f64, high: f64, n: usize| {
                    let edge = |e: f64| (e - 0.5).ceil().clamp(0.0, n as f64) as usize;
                    edge(low)..edge(high)
                };
                let columns = span(column(u as f64), column(u as f64 + 1.0), size.width);
                let value = there.round().min(65_535.0) as u16;
                for y in span(row(v as f64), row(v as f64 + 1.0), size.height) {
                    for out in &mut data[y * size.width..][columns.clone()] {
                        if *out == 0 || value < *out {
                            *out = value;
                        }
                    }
                }
            }
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(f: f64, c: f64) -> Lens {
        Lens::intrinsics(f, f, c, c).unwrap()
    }

    #[test]
    fn the_same_camera_changes_nothing() {
        let depth =
            Image::from_fn(20, 16, |x, y| if (x + y) % 5 == 0 { 0 } else { (1000 + 10 * x + y) as u16 }).unwrap();
        let same = Registration::new(lens(30.0, 9.0), lens(30.0, 9.0), [0.0; 3]).unwrap();
        assert_eq!(same.apply(depth.view(), depth.size()).unwrap(), depth);
    }

    #[test]
    fn depth_moves_by_the_disparity_and_what_is_nearer_wins() {
        // 1000 mm away in columns 4 to 7, else 2000 mm; 50 mm to the right with f = 40 px: 2 px near, 1 px far.
        let depth = Image::from_fn(16, 4, |x, _| if (4..8).contains(&x) { 1000 } else { 2000 }).unwrap();
        let moved = Registration::new(lens(40.0, 2.0), lens(40.0, 2.0), [50.0, 0.0, 0.0]).unwrap();
        let out = moved.apply(depth.view(), depth.size()).unwrap();
        let want: Vec<u16> =
            vec![0, 2000, 2000, 2000, 2000, 0, 1000, 1000, 1000, 1000, 2000, 2000, 2000, 2000, 2000, 2000];
        assert_eq!(&out.as_slice()[..16], &want[..]);
        // Twice the focal length: each pixel covers four, and 100 mm ahead is added.
        let zoomed = Registration::new(lens(40.0, 8.0), lens(80.0, 16.0), [0.0, 0.0, 100.0]).unwrap();
        let flat = Image::filled(16, 16, 1900_u16).unwrap();
        let out = zoomed.apply(flat.view(), Size::new(32, 32)).unwrap();
        assert_eq!((out.as_slice()[16 * 32 + 16], out.as_slice()[0]), (2000, 0));
        assert!(Registration::new(lens(40.0, 8.0), lens(40.0, 8.0), [f64::NAN, 0.0, 0.0]).is_err());
    }
}
