//! Where in a picture something stands out, and what is near: all of the background that anybody looks at.

use pursuit_imaging::Image;
use pursuit_vision::PixelWindow;
use pursuit_vision::background::FOREGROUND;

/// Pixels across a block, and down: no less than this, and no less than the reach.
const LEAST_SIDE: usize = 16;

/// The blocks of a picture in which something stands out, and those about them.
#[derive(Debug, Clone, Default)]
pub(super) struct Surroundings {
    /// Which blocks something stands out in.
    busy: Vec<bool>,
    windows: Vec<PixelWindow>,
}

impl Surroundings {
    /// Windows that hold every pixel no farther than `reach_px`, across and down, from one that stands out of `mask`.
    pub fn windows(&mut self, mask: &Image<u8>, reach_px: usize) -> &[PixelWindow] {
        let side = reach_px.max(LEAST_SIDE);
        let (columns, rows) = (mask.width().div_ceil(side), mask.height().div_ceil(side));
        self.busy.clear();
        self.busy.resize(columns * rows, false);
        for y in 0..mask.height() {
            let busy = &mut self.busy[(y / side) * columns..][..columns];
            for (busy, pixels) in busy.iter_mut().zip(mask.row(y).chunks(side)).filter(|(busy, _)| !**busy) {
                // All are looked at, which is quicker than to stop at the first.
                *busy = pixels.iter().fold(false, |any, v| any | (*v == FOREGROUND));
            }
        }
        self.windows.clear();
        for row in 0..rows {
            let near = |column: usize| {
                let columns_near = column.saturating_sub(1)..(column + 2).min(columns);
                (row.saturating_sub(1)..(row + 2).min(rows))
                    .any(|row| self.busy[row * columns..][columns_near.clone()].contains(&true))
            };
            let (y, height) = (row * side, side.min(mask.height() - row * side));
            let mut column = 0;
            while column < columns {
                let first = column;
                while column < columns && near(column) {
                    column += 1;
                }
                if column > first {
                    let (x, right) = (first * side, (column * side).min(mask.width()));
                    self.windows.push(PixelWindow { x, y, width: right - x, height });
                }
                column += 1;
            }
        }
        &self.windows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::Noise;
    use pursuit_vision::background::SHADOW;

    #[test]
    fn whatever_is_near_is_in_a_window_once() {
        let mut surroundings = Surroundings::default();
        let mut noise = Noise::new(5);
        for (width, height, reach) in [(97, 61, 5), (40, 40, 16), (130, 70, 23), (7, 3, 40), (1, 1, 0)] {
            for some in [0, 1, 3] {
                let mut mask = Image::from_fn(width, height, |_, _| if noise.byte() < 9 { SHADOW } else { 0 }).unwrap();
                let mut out = Vec::new();
                for _ in 0..some {
                    let at = |side: usize, byte: u8| usize::from(byte) % side;
                    out.push((at(width, noise.byte()), at(height, noise.byte())));
                }
                out.iter().for_each(|&(x, y)| mask.row_mut(y)[x] = FOREGROUND);
                let mut held = Image::filled(width, height, 0u8).unwrap();
                for w in surroundings.windows(&mask, reach) {
                    for y in w.y..w.y + w.height {
                        held.row_mut(y)[w.x..w.x + w.width].iter_mut().for_each(|count| *count += 1);
                    }
                }
                for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                    let away = |a: usize, b: usize| a.abs_diff(b);
                    let nearest = out.iter().map(|o| away(o.0, x).max(away(o.1, y))).min().unwrap_or(usize::MAX);
                    let (count, side) = (held.row(y)[x], reach.max(LEAST_SIDE));
                    assert!(count <= 1 && (nearest > reach || count == 1), "{width} {some}: {x} {y} {nearest}");
                    assert!(nearest < 2 * side || count == 0, "{width} {some}: {x} {y} {nearest}");
                }
            }
        }
    }
}
