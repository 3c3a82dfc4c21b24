/// A number in [0, 1) of a lattice point, without a pattern.
pub const fn lattice(i: i64, j: i64, seed: u64) -> f64 {
    let mut h = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f) ^ seed;
    h = (h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 32)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (h >> 40) as f64 / (1u64 << 24) as f64
}

/// Value noise: what `corner` says of the corners of cells of `cell` pixels, and between them what lies between, by shares
/// that `ease` makes of the place in the cell (both in [0, 1]).
pub fn value_noise((x, y): (f64, f64), cell: f64, ease: impl Fn(f64) -> f64, corner: impl Fn(i64, i64) -> f64) -> f64 {
    let (u, v) = (x / cell, y / cell);
    let (i, j) = (u.floor(), v.floor());
    let (a, b) = (ease(u - i), ease(v - j));
    let at = |di: f64, dj: f64| corner((i + di) as i64, (j + dj) as i64);
    let top = at(0.0, 0.0) * (1.0 - a) + at(1.0, 0.0) * a;
    let bottom = at(0.0, 1.0) * (1.0 - a) + at(1.0, 1.0) * a;
    top * (1.0 - b) + bottom * b
}

/// What a texture is at the middles of pixels, worked out once: for tests that draw the same ground into many frames.
#[derive(Debug, Clone)]
pub struct PixelTable<T> {
    left: i64,
    top: i64,
    width: usize,
    values: Vec<T>,
}

impl<T: Copy> PixelTable<T> {
    /// Of the pixels from `(left, top)` on, `width` across and `height` down.
    pub fn new((left, top): (i64, i64), (width, height): (usize, usize), value: impl Fn(f64, f64) -> T) -> Self {
        let middle = |from: i64, k: usize| from as f64 + k as f64 + 0.5;
        let values = (0..width * height).map(|k| value(middle(left, k % width), middle(top, k / width))).collect();
        Self { left, top, width, values }
    }

    /// At `(x, y)`; `None` beside the table, and where that is not the middle of a pixel.
    pub fn get(&self, x: f64, y: f64) -> Option<T> {
        let (u, v) = (x - 0.5 - self.left as f64, y - 0.5 - self.top as f64);
        let (column, row) = (u as usize, v as usize);
        let is_middle = column as f64 == u && row as f64 == v && column < self.width;
        is_middle.then(|| self.values.get(row * self.width + column).copied()).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_met_and_between_them_noise_is_between() {
        let corner = |i: i64, j: i64| lattice(i, j, 7);
        let at = |x: f64, y: f64| value_noise((x, y), 4.0, |t| t, corner);
        assert_eq!(at(8.0, -4.0), corner(2, -1));
        assert!((at(10.0, 4.0) - 0.5 * (corner(2, 1) + corner(3, 1))).abs() < 1e-12);
        assert!(corner(2, 1) != corner(1, 2) && (0.0..1.0).contains(&corner(5, 5)));
    }

    #[test]
    fn tables_know_the_middles_of_their_pixels() {
        let table = PixelTable::new((-3, 2), (5, 4), |x, y| (x, y));
        assert_eq!(table.get(-2.5, 2.5), Some((-2.5, 2.5)));
        assert_eq!(table.get(1.5, 5.5), Some((1.5, 5.5)));
        let beside = [(-3.5, 2.5), (2.5, 2.5), (1.5, 6.5), (1.5, 1.5), (0.0, 2.5), (0.5, 2.75)];
        assert!(beside.into_iter().all(|(x, y)| table.get(x, y).is_none()));
    }
}
