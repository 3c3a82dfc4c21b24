//! Feature maps as the kernels want them: row by row, channel by channel, columns last ("HCW").
//!
//! Sixteen neighbouring columns of one channel are the unit of every kernel: they fill one AVX-512 register, two of
//! AVX2, four of NEON, and every map of the networks here is a multiple of sixteen wide or is padded to it. A row of
//! all channels is a contiguous matrix, so a pointwise convolution is a small matrix product per row, and a depthwise
//! one reads the same channel of neighbouring rows.

/// Columns handled at a time.
pub const LANES: usize = 16;

/// `n` rounded up to whole lanes.
pub const fn whole_lanes(n: usize) -> usize {
    n.div_ceil(LANES) * LANES
}

/// How the columns of a row are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// In order.
    Straight,
    /// Even columns (counted with the padding) first, then the odd ones, each `half` floats: what a convolution of
    /// stride 2 reads becomes contiguous.
    Split {
        /// Floats from the even to the odd columns.
        half: usize,
    },
}

/// Channels of `height` × `width` with `padding` zeros around them; what lies beyond the right padding is zero too.
#[derive(Debug, Clone)]
pub struct Map {
    pub channels: usize,
    pub height: usize,
    pub width: usize,
    pub padding: usize,
    /// Floats from one channel of a row to the next.
    pub pitch: usize,
    pub columns: Columns,
    data: Vec<f32>,
}

impl Map {
    /// A map that only pointwise convolutions read: no padding, whole lanes.
    pub fn dense(channels: usize, height: usize, width: usize) -> Self {
        Self::new(channels, height, width, 0, whole_lanes(width), Columns::Straight)
    }

    /// The input of a convolution of `kernel` × `kernel`, stride 1, with `padding` zeros on every side.
    pub fn padded(channels: usize, height: usize, width: usize, padding: usize, kernel: usize) -> Self {
        let out = width + 2 * padding - kernel + 1;
        let pitch = (whole_lanes(out) + kernel - 1).max(whole_lanes(width) + 2 * padding);
        Self::new(channels, height, width, padding, pitch, Columns::Straight)
    }

    /// The input of a convolution of `kernel` × `kernel`, stride 2, with `padding` zeros on every side.
    pub fn split(channels: usize, height: usize, width: usize, padding: usize, kernel: usize) -> Self {
        let out = (width + 2 * padding - kernel) / 2 + 1;
        let half = (whole_lanes(out) + kernel / 2).max((whole_lanes(width) + 2 * padding).div_ceil(2));
        Self::new(channels, height, width, padding, 2 * half, Columns::Split { half })
    }

    fn new(channels: usize, height: usize, width: usize, padding: usize, pitch: usize, columns: Columns) -> Self {
        let data = vec![0.0; channels * pitch * (height + 2 * padding)];
        Self { channels, height, width, padding, pitch, columns, data }
    }

    /// Floats of one row of all channels.
    pub const fn row_len(&self) -> usize {
        self.channels * self.pitch
    }

    /// Sixteens in a row.
    pub const fn segments(&self) -> usize {
        self.width.div_ceil(LANES)
    }

    /// Everything from padded row `row` (0 is the first row of the upper padding) to the end.
    pub fn padded_rows_from(&self, row: usize) -> &[f32] {
        &self.data[row * self.row_len()..]
    }

    /// Row `y` of all channels, without the rows of the padding.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.padded_rows_from(y + self.padding)[..self.row_len()]
    }

    /// As [`row`](Self::row), to be written.
    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        self.rows_mut(y, 1)
    }

    /// `count` rows of all channels from row `y` on.
    pub fn rows_mut(&mut self, y: usize, count: usize) -> &mut [f32] {
        let (start, len) = ((y + self.padding) * self.row_len(), count * self.row_len());
        &mut self.data[start..start + len]
    }

    /// Writes row `y` of a map with even and odd columns apart and one column of padding, a plane a channel; what lies beyond the
    /// map is ignored.
    pub fn write_row(&mut self, y: usize, planes: [&[f32]; 3]) {
        let Columns::Split { half } = self.columns else { return };
        if y >= self.height {
            return;
        }
        let (width, pitch) = (self.width, self.pitch);
        let row = self.row_mut(y).chunks_exact_mut(pitch);
        for (to, plane) in row.zip(planes) {
            let (pairs, last) = plane[..plane.len().min(width)].as_chunks::<2>();
            // One column of padding stands before the image, so that its first column is an odd one.
            let (evens, odds) = to.split_at_mut(half);
            for (([odd, even], to_odd), to_even) in pairs.iter().zip(&mut *odds).zip(&mut evens[1..]) {
                (*to_odd, *to_even) = (*odd, *even);
            }
            if let ([last], Some(to)) = (last, odds.get_mut(pairs.len())) {
                *to = *last;
            }
        }
    }

    /// Where column `x` of channel `c` lies in a row.
    pub const fn offset(&self, c: usize, x: usize) -> usize {
        let p = x + self.padding;
        c * self.pitch
            + match self.columns {
                Columns::Straight => p,
                Columns::Split { half } => (p % 2) * half + p / 2,
            }
    }

    /// Copies a tensor in channel, row, column order.
    #[cfg(test)]
    pub fn fill(&mut self, tensor: &[f32]) {
        for c in 0..self.channels {
            for y in 0..self.height {
                for x in 0..self.width {
                    let at = self.offset(c, x);
                    self.row_mut(y)[at] = tensor[(c * self.height + y) * self.width + x];
                }
            }
        }
    }

    /// Writes the map in channel, row, column order to `tensor`, `channels · height · width` long.
    pub fn copy_to(&self, tensor: &mut [f32]) {
        for (i, values) in tensor.chunks_exact_mut(self.width).enumerate() {
            let (row, c) = (self.row(i % self.height), i / self.height);
            for (x, value) in values.iter_mut().enumerate() {
                *value = row[self.offset(c, x)];
            }
        }
    }
}
