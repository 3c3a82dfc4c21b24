use crate::smoothing::reflected;
use crate::{Result, error::require_range};
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::{Image, ImageView};

/// A grey image and its halvings: level 0 is the image, each further level half as wide and high (rounded up).
///
/// A level is the one below it smoothed with the binomial kernel [1 4 6 4 1]/16 both ways, reflected about the border
/// pixels, at every second pixel (Burt and Adelson 1983; rounded as OpenCV's `pyrDown` rounds). Pixel (x, y) of level
/// `l` is centred on pixel (x·2ˡ, y·2ˡ) of level 0.
#[derive(Debug, Clone)]
pub struct Pyramid {
    /// Buffers; those from `used` on are left from larger pyramids.
    levels: Vec<Image<u8>>,
    used: usize,
    sums: Vec<u16>,
}

impl Pyramid {
    /// The most levels a pyramid may have.
    pub const MAX_LEVELS: usize = 12;
    /// No level gets a side shorter than this, pixels.
    const LEAST_SIDE: usize = 4;

    /// The pyramid of `gray` with at most `levels` levels (1 to 12; level 0 counts); small images get fewer.
    ///
    /// # Errors
    /// When `levels` is out of range.
    pub fn of(gray: ImageView<'_, u8>, levels: usize) -> Result<Self> {
        let mut pyramid = Self { levels: vec![gray.to_image()], used: 1, sums: Vec::new() };
        pyramid.build(gray, levels)?;
        Ok(pyramid)
    }

    /// Makes this the pyramid of another image, in the same memory.
    ///
    /// # Errors
    /// When `levels` is out of range; the pyramid is then left as it was.
    pub fn build(&mut self, gray: ImageView<'_, u8>, levels: usize) -> Result<()> {
        require_range("the number of pyramid levels", levels as f64, (1.0, Self::MAX_LEVELS as f64), "from 1 to 12")?;
        self.used = 0;
        let base = self.level_for_overwrite(gray.size())?;
        for (y, row) in gray.rows().enumerate() {
            base.row_mut(y).copy_from_slice(row);
        }
        let mut size = gray.size();
        for _ in 1..levels {
            size = Size::new(size.width.div_ceil(2), size.height.div_ceil(2));
            if size.width.min(size.height) < Self::LEAST_SIDE {
                break;
            }
            self.level_for_overwrite(size)?;
            let (below, above) = self.levels.split_at_mut(self.used - 1);
            if let (Some(below), Some(above)) = (below.last(), above.first_mut()) {
                halve(below, above, &mut self.sums);
            }
        }
        Ok(())
    }

    /// Number of levels, ≥ 1.
    pub const fn levels(&self) -> usize {
        self.used
    }

    /// Size of level 0.
    pub fn size(&self) -> Size {
        self.levels.first().map_or(Size::new(0, 0), Image::size)
    }

    /// Level `l`, `None` where there is none.
    pub fn level(&self, l: usize) -> Option<ImageView<'_, u8>> {
        self.image(l).map(Image::view)
    }

    pub(super) fn image(&self, l: usize) -> Option<&Image<u8>> {
        self.levels[..self.used].get(l)
    }

    fn level_for_overwrite(&mut self, size: Size) -> Result<&mut Image<u8>> {
        let l = self.used;
        if l == self.levels.len() {
            self.levels.push(Image::filled(size.width, size.height, 0)?);
        }
        self.levels[l].resize_for_overwrite(size, 0)?;
        self.used += 1;
        Ok(&mut self.levels[l])
    }
}

/// Every second pixel of every second row of `below`, smoothed; `above` has the size for it.
fn halve(below: &Image<u8>, above: &mut Image<u8>, sums: &mut Vec<u16>) {
    let (width, height) = (below.width(), below.height());
    // Two more sums on either side, and one so that the last pair is whole.
    sums.resize(width + 5, 0);
    for y in 0..above.height() {
        let row = |k: isize| below.row(reflected(2 * y as isize + k, height));
        add_rows([row(-2), row(-1), row(0), row(1), row(2)], &mut sums[2..2 + width]);
        for (edge, k) in [(0, -2), (1, -1), (width + 2, width as isize), (width + 3, width as isize + 1)] {
            sums[edge] = sums[2 + reflected(k, width)];
        }
        add_columns(sums, above.row_mut(y));
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn add_rows(rows: [&[u8]; 5], out: &mut [u16]) {
    let n = out.len();
    let [a, b, c, d, e] = rows.map(|r| &r[..n]);
    for i in 0..n {
        let outer = u16::from(a[i]) + u16::from(e[i]);
        out[i] = outer + 4 * (u16::from(b[i]) + u16::from(d[i])) + 6 * u16::from(c[i]);
    }
}

/// `sums` are at most 16 · 255, so 16 of them and the rounding fit in 16 bits.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn add_columns(sums: &[u16], out: &mut [u8]) {
    let n = out.len();
    let (at, next, last) = (&sums[..2 * n], &sums[2..2 * n + 2], &sums[4..]);
    for i in 0..n {
        let (outer, near) = (at[2 * i] + last[2 * i], at[2 * i + 1] + next[2 * i + 1]);
        out[i] = ((outer + 4 * near + 6 * next[2 * i] + 128) >> 8) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VisionError;
    use proptest::prelude::*;
    use pursuit_testkit::Noise;

    fn noise(w: usize, h: usize, seed: u32) -> Image<u8> {
        let mut noise = Noise::new(seed | 1);
        Image::from_fn(w, h, |_, _| noise.byte()).unwrap()
    }

    /// The slow, obvious twin: 25 weighted pixels.
    fn slow(image: &Image<u8>, x: usize, y: usize) -> u8 {
        let weights = [1u32, 4, 6, 4, 1];
        let mut sum = 128;
        for (j, wy) in weights.iter().enumerate() {
            for (i, wx) in weights.iter().enumerate() {
                let at_x = reflected((2 * x + i) as isize - 2, image.width());
                let at_y = reflected((2 * y + j) as isize - 2, image.height());
                sum += wx * wy * u32::from(image.row(at_y)[at_x]);
            }
        }
        (sum >> 8) as u8
    }

    proptest! {
        #[test]
        fn levels_equal_the_twin((w, h) in (1usize..70, 1usize..40), seed in any::<u32>()) {
            let image = noise(w, h, seed);
            // A used pyramid gives what a fresh one gives.
            let mut pyramid = Pyramid::of(noise(50, 60, 3).view(), 4).unwrap();
            pyramid.build(image.view(), 5).unwrap();
            prop_assert_eq!(pyramid.level(0).unwrap().to_image(), image);
            for l in 1..pyramid.levels() {
                let (below, level) = (pyramid.level(l - 1).unwrap().to_image(), pyramid.level(l).unwrap().to_image());
                prop_assert_eq!((level.width(), level.height()), (below.width().div_ceil(2), below.height().div_ceil(2)));
                prop_assert!(level.width().min(level.height()) >= 4);
                prop_assert_eq!(&level, &Image::from_fn(level.width(), level.height(), |x, y| slow(&below, x, y)).unwrap());
            }
            let last = pyramid.level(pyramid.levels() - 1).unwrap().size();
            prop_assert!(pyramid.levels() == 5 || last.width.min(last.height).div_ceil(2) < 4);
        }
    }

    #[test]
    fn levels_are_checked_and_counted() {
        let image = noise(64, 48, 1);
        for levels in [0, 13] {
            assert!(matches!(Pyramid::of(image.view(), levels), Err(VisionError::Parameter { .. })));
        }
        let pyramid = Pyramid::of(image.view(), 3).unwrap();
        assert_eq!((pyramid.levels(), pyramid.size()), (3, Size::new(64, 48)));
        assert!(pyramid.level(2).is_some() && pyramid.level(3).is_none());
    }
}
