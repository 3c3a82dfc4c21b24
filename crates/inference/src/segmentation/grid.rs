//! What comes out of a network: a grid of numbers over its picture, read between its cells.

use super::picture::Shown;
use std::ops::Range;

/// Numbers over all of a network's picture, row by row; the target's where they are above 0.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    pub columns: usize,
    pub rows: usize,
    pub values: Vec<f32>,
    /// Width and height of the picture that it covers.
    pub picture: (usize, usize),
}

/// Two neighbouring cells, and how near a place is to the second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tap {
    first: usize,
    second: usize,
    part: f32,
}

impl Tap {
    /// A place counted in cells from the first one's edge: middles of cells at one half, the border goes on.
    fn at(place: f64, cells: usize) -> Self {
        let at = (place - 0.5).clamp(0.0, cells.saturating_sub(1) as f64);
        let first = at as usize;
        Self { first, second: (first + 1).min(cells.saturating_sub(1)), part: (at - first as f64) as f32 }
    }
}

impl Grid {
    /// Whether each pixel of a window of the frame has a number above 0 at its middle, bilinear between the cells (as `align_corners=False`
    /// has it); none that is outside of what was shown has.
    pub fn read(
        &self,
        shown: &Shown,
        (columns, rows): (Range<usize>, Range<usize>),
        taps: &mut Vec<Tap>,
        cells: &mut Vec<bool>,
    ) {
        let (across, down) = (self.columns as f64 / self.picture.0 as f64, self.rows as f64 / self.picture.1 as f64);
        let tap_x = |x: usize| Tap::at(shown.place(x as f64 + 0.5, 0.0).0 * across, self.columns);
        taps.clear();
        taps.extend(columns.clone().map(tap_x));
        let within = |at: usize, from: i64, side: i64| (from..from + side).contains(&(at as i64));
        let window = shown.window;
        for y in rows {
            let tap = Tap::at(shown.place(0.0, y as f64 + 0.5).1 * down, self.rows);
            let row = |y: usize| self.values.get(y * self.columns..(y + 1) * self.columns).unwrap_or_default();
            let (above, below) = (row(tap.first), row(tap.second));
            let is_row = within(y, window.top, window.height) && !above.is_empty() && !below.is_empty();
            cells.extend(columns.clone().zip(taps.iter()).map(|(x, across)| {
                let along = |row: &[f32]| row[across.first] + across.part * (row[across.second] - row[across.first]);
                // Not-a-number is not above.
                is_row && within(x, window.left, window.width) && {
                    let upper = along(above);
                    upper + tap.part * (along(below) - upper) > 0.0
                }
            }));
        }
    }
}
