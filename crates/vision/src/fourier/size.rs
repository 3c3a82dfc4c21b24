/// The smallest even number ≥ `n` whose only prime factors are 2, 3 and 5: sizes that transform fast. At least 2.
pub fn good_size(n: usize) -> usize {
    let smooth = |mut m: usize| {
        for p in [2, 3, 5] {
            while m.is_multiple_of(p) {
                m /= p;
            }
        }
        m == 1
    };
    let first = n.max(2).next_multiple_of(2);
    (first..).step_by(2).find(|&m| smooth(m)).unwrap_or(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_even_five_smooth_number() {
        for (n, good) in
            [(0, 2), (1, 2), (3, 4), (7, 8), (22, 24), (49, 50), (51, 54), (97, 100), (129, 144), (251, 256)]
        {
            assert_eq!(good_size(n), good, "{n}");
        }
    }
}
