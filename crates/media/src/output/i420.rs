use multiversion::multiversion;
use pursuit_imaging::{ImageView, Rgb8};

/// A planar 4:2:0 picture with even sides, as encoders take it: BT.709, limited range.
#[derive(Debug, Clone, Default)]
pub(super) struct I420 {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) y: Vec<u8>,
    pub(super) u: Vec<u8>,
    pub(super) v: Vec<u8>,
    /// Two rows widened to the even width.
    rows: [Vec<Rgb8>; 2],
}

impl I420 {
    /// The size an encoder sees for a picture of `width` × `height`: even, and at least 16 × 16.
    pub(super) fn padded(width: usize, height: usize) -> (usize, usize) {
        (width.next_multiple_of(2).max(16), height.next_multiple_of(2).max(16))
    }

    /// Converts `image`; missing columns and rows repeat the last.
    pub(super) fn fill_from(&mut self, image: ImageView<'_, Rgb8>) {
        (self.width, self.height) = Self::padded(image.width(), image.height());
        let (width, half) = (self.width, self.width / 2);
        self.y.resize(width * self.height, 0);
        self.u.resize(half * self.height / 2, 0);
        self.v.resize(half * self.height / 2, 0);
        let chroma = self.u.chunks_exact_mut(half).zip(self.v.chunks_exact_mut(half));
        for ((pair, luma), (u, v)) in
            self.y.chunks_exact_mut(2 * width).enumerate().map(|(k, l)| (2 * k, l)).zip(chroma)
        {
            for (offset, row) in self.rows.iter_mut().enumerate() {
                let source = image.row((pair + offset).min(image.height() - 1));
                row.clear();
                row.extend_from_slice(source);
                row.resize(width, source.last().copied().unwrap_or_default());
            }
            let (upper, lower) = luma.split_at_mut(width);
            let [top, bottom] = &self.rows;
            luma_row(top.as_slice(), upper);
            luma_row(bottom.as_slice(), lower);
            chroma_row(top.as_slice(), bottom.as_slice(), u, v);
        }
    }
}

const BITS: u32 = 15;

/// BT.709-6 table 3 in 15-bit fixed point: luma weights scaled to 219 codes, chroma rows to 224.
const LUMA: [i32; 3] = [fixed(0.2126 * 219.0 / 255.0), fixed(0.7152 * 219.0 / 255.0), fixed(0.0722 * 219.0 / 255.0)];
const BLUE: [i32; 3] = chroma([-0.2126, -0.7152, 1.0 - 0.0722], 0.0722);
const RED: [i32; 3] = chroma([1.0 - 0.2126, -0.7152, -0.0722], 0.2126);

const fn fixed(weight: f64) -> i32 {
    let scaled = weight * (1 << BITS) as f64;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}

/// A colour difference divided by its greatest value, twice (1 - own weight), in 224 codes.
const fn chroma(difference: [f64; 3], own: f64) -> [i32; 3] {
    let gain = 224.0 / 255.0 / (2.0 * (1.0 - own));
    [fixed(difference[0] * gain), fixed(difference[1] * gain), fixed(difference[2] * gain)]
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn luma_row(rgb: &[Rgb8], out: &mut [u8]) {
    for (out, &[r, g, b]) in out.iter_mut().zip(rgb) {
        let sum = LUMA[0] * i32::from(r) + LUMA[1] * i32::from(g) + LUMA[2] * i32::from(b);
        *out = (((16 << BITS) + (1 << (BITS - 1)) + sum) >> BITS) as u8;
    }
}

/// Chroma of 2 × 2 blocks: the mean of the four pixels.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn chroma_row(top: &[Rgb8], bottom: &[Rgb8], u: &mut [u8], v: &mut [u8]) {
    let blocks = top.as_flattened().chunks_exact(6).zip(bottom.as_flattened().chunks_exact(6));
    for ((u, v), (a, b)) in u.iter_mut().zip(v.iter_mut()).zip(blocks) {
        let sum = |c: usize| i32::from(a[c]) + i32::from(a[c + 3]) + i32::from(b[c]) + i32::from(b[c + 3]);
        let (red, green, blue) = (sum(0), sum(1), sum(2));
        let code = |w: [i32; 3]| {
            // Four pixels were summed: two more fractional bits.
            let value = (128 << (BITS + 2)) + (1 << (BITS + 1)) + w[0] * red + w[1] * green + w[2] * blue;
            (value >> (BITS + 2)).clamp(0, 255) as u8
        };
        (*u, *v) = (code(BLUE), code(RED));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{ColorMatrix, ColorRange, Image, Yuv420};

    #[test]
    fn colours_come_back_through_the_inverse_matrix() {
        for k in 0..2000u32 {
            let color = [97, 57, 31].map(|m| (k.wrapping_mul(m) % 256) as u8);
            let mut planes = I420::default();
            planes.fill_from(Image::filled(16, 16, color).unwrap().view());
            let plane = |data: &[u8], side| Image::from_vec(data.to_vec(), side, side).unwrap();
            let (y, u, v) = (plane(&planes.y, 16), plane(&planes.u, 8), plane(&planes.v, 8));
            let back = Yuv420::new(y, u, v, ColorMatrix::Bt709, ColorRange::Limited).unwrap().to_rgb();
            for (a, b) in back.as_slice()[0].iter().zip(color) {
                assert!(a.abs_diff(b) <= 3, "{color:?} came back as {:?}", back.as_slice()[0]);
            }
        }
    }

    #[test]
    fn odd_and_tiny_pictures_repeat_their_border() {
        let image = Image::from_fn(17, 3, |x, y| [(x * 10 + y) as u8; 3]).unwrap();
        let mut planes = I420::default();
        planes.fill_from(image.view());
        assert_eq!((planes.width, planes.height), (18, 16));
        assert_eq!(planes.y[16], planes.y[17]);
        assert_eq!(planes.y[2 * 18..3 * 18], planes.y[15 * 18..16 * 18]);
        assert_ne!(planes.y[0], planes.y[5]);
    }
}
