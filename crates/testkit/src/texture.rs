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
}
