use pursuit_imaging::Image;

/// A picture with its border pixels repeated around it, so that patches may reach beyond.
#[derive(Debug, Clone, Default)]
pub(super) struct Padded {
    pixels: Vec<u8>,
    pub width: usize,
    pub height: usize,
    pub stride: usize,
    pad: usize,
}

impl Padded {
    /// Takes `image` with `pad` pixels more on every side.
    pub fn take(&mut self, image: &Image<u8>, pad: usize) {
        (self.width, self.height, self.pad) = (image.width(), image.height(), pad);
        self.stride = image.width() + 2 * pad;
        self.pixels.clear();
        for y in 0..image.height() + 2 * pad {
            let row = image.row(y.saturating_sub(pad).min(image.height() - 1));
            let (first, last) = (row[0], row[row.len() - 1]);
            self.pixels.extend(std::iter::repeat_n(first, pad));
            self.pixels.extend_from_slice(row);
            self.pixels.extend(std::iter::repeat_n(last, pad));
        }
    }

    /// The pixels from column `x` of row `y` on; both at least −pad.
    #[inline(always)]
    pub fn from(&self, x: isize, y: isize) -> &[u8] {
        let (column, row) = (x + self.pad as isize, y + self.pad as isize);
        &self.pixels[row as usize * self.stride + column as usize..]
    }
}
