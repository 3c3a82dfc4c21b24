/// The even number nearest to `n` whose only prime factors are 2, 3 and 5, the smaller of two equally near ones: sizes that
/// transform fast. From 2 to 2²⁴.
pub fn good_size(n: usize) -> usize {
    let smooth = |m: &usize| {
        let mut rest = *m;
        for p in [2, 3, 5] {
            while rest.is_multiple_of(p) {
                rest /= p;
            }
        }
        rest == 1
    };
    // Beyond this no transform fits into memory; the search stays short.
    let n = n.clamp(2, 1 << 24);
    // A power of two lies within a factor of two of every number, so both searches end.
    let below = (2..=n).rev().find(|m| m.is_multiple_of(2) && smooth(m)).unwrap_or(2);
    let above = (n..=2 * n).find(|m| m.is_multiple_of(2) && smooth(m)).unwrap_or(below);
    if n - below <= above - n { below } else { above }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_even_five_smooth_number() {
        for (n, good) in [
            (0, 2),
            (1, 2),
            (2, 2),
            (3, 2),
            (7, 6),
            (8, 8),
            (13, 12),
            (22, 20),
            (23, 24),
            (49, 48),
            (51, 50),
            (97, 96),
            (140, 144),
            (251, 250),
        ] {
            assert_eq!(good_size(n), good, "{n}");
        }
    }
}
