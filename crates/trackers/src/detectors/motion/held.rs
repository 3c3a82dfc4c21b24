//! How long something has stood out of the background, block by block: what has not done so for long is not learnt, followed or
//! not, so that nobody melts into the background who walks slowly or was not confirmed yet.

use pursuit_imaging::Image;

/// Pixels across a block, and down.
const BLOCK: usize = 8;
/// How fast the time of a block runs back where nothing stands out, against how fast it runs.
const DECAY: f64 = 0.5;

/// For how long something stood out in each block, in seconds.
#[derive(Debug, Clone, Default)]
pub(super) struct Held {
    columns: usize,
    seconds: Vec<f64>,
    /// Which blocks something stands out in; scratch.
    busy: Vec<bool>,
}

impl Held {
    /// A frame later by `dt_s` in which `mask` stands out.
    pub fn count(&mut self, mask: &Image<u8>, dt_s: f64) {
        let (columns, rows) = (mask.width().div_ceil(BLOCK), mask.height().div_ceil(BLOCK));
        if (self.columns, self.seconds.len()) != (columns, columns * rows) {
            self.columns = columns;
            self.seconds.clear();
            self.seconds.resize(columns * rows, 0.0);
            self.busy.resize(columns * rows, false);
        }
        self.busy.fill(false);
        for y in 0..mask.height() {
            let busy = &mut self.busy[(y / BLOCK) * columns..][..columns];
            for (busy, pixels) in busy.iter_mut().zip(mask.row(y).chunks(BLOCK)) {
                // All are looked at, which is quicker than to stop at the first.
                *busy |= pixels.iter().fold(0, |all, v| all | v) != 0;
            }
        }
        for (seconds, busy) in self.seconds.iter_mut().zip(&self.busy) {
            *seconds = if *busy { *seconds + dt_s } else { (*seconds - DECAY * dt_s).max(0.0) };
        }
    }

    /// Marks in `protect` what stands out in `mask` where that has not been so for `hold_s` yet.
    pub fn protect(&self, mask: &Image<u8>, hold_s: f64, protect: &mut Image<u8>) {
        if self.columns != mask.width().div_ceil(BLOCK) || protect.size() != mask.size() {
            return;
        }
        for y in 0..mask.height() {
            let Some(seconds) = self.seconds.get((y / BLOCK) * self.columns..) else { return };
            let blocks = mask.row(y).chunks(BLOCK).zip(protect.row_mut(y).chunks_mut(BLOCK));
            for ((pixels, protect), _) in blocks.zip(seconds).filter(|(_, seconds)| **seconds < hold_s) {
                protect.iter_mut().zip(pixels).for_each(|(p, v)| *p |= *v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_out_is_held_for_a_time() {
        let mut held = Held::default();
        let mask = Image::from_fn(20, 12, |x, y| if (4..10).contains(&x) && y < 5 { 255u8 } else { 0 }).unwrap();
        let marked = |held: &Held| {
            let mut protect = Image::filled(20, 12, 0u8).unwrap();
            held.protect(&mask, 1.0, &mut protect);
            protect
        };
        for _ in 0..9 {
            held.count(&mask, 0.1);
        }
        assert_eq!(marked(&held), mask);
        held.count(&mask, 0.2);
        assert!(marked(&held).as_slice().iter().all(|v| *v == 0), "long enough");
        // Time runs back at half the speed.
        let empty = Image::filled(20, 12, 0u8).unwrap();
        held.count(&empty, 0.3);
        assert_eq!(marked(&held), mask);
        // A picture of another size begins anew.
        held.count(&Image::filled(64, 64, 255u8).unwrap(), 5.0);
        assert!(marked(&held).as_slice().iter().all(|v| *v == 0), "not of this size");
    }
}
