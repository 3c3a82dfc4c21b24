//! Which of several shifts most of the picture made: blocks of the first image vote for the shift that finds them again.

use pursuit_imaging::ImageView;

/// Most shifts that can stand for election.
pub(super) const MOST: usize = 8;
/// Side of a block, pixels.
const BLOCK: usize = 8;
/// A difference of two codes a pixel is noise; as much is added to the differences before they are compared.
const NOISE: u32 = 2 * (BLOCK * BLOCK) as u32;

/// A shift in whole pixels: right, down.
pub(super) type Shift = (isize, isize);

/// Index of the shift for which most blocks of `first` vote, the first of equals; 0 when no block can tell. The images
/// are equally large; only the first [`MOST`] shifts stand.
pub(super) fn elect(first: ImageView<'_, u8>, second: ImageView<'_, u8>, shifts: &[Shift]) -> usize {
    let mut votes = [0usize; MOST];
    for y in (0..=first.height().saturating_sub(BLOCK)).step_by(BLOCK) {
        for x in (0..=first.width().saturating_sub(BLOCK)).step_by(BLOCK) {
            if let Some(votes) = choice(first, second, (x, y), shifts).and_then(|i| votes.get_mut(i)) {
                *votes += 1;
            }
        }
    }
    let mut best = 0;
    for (i, count) in votes.iter().enumerate() {
        if *count > votes[best] {
            best = i;
        }
    }
    best
}

/// The shift that finds the block at `corner` of `first` again, where one is clearly better than the others: it leaves less
/// than two thirds of the difference that the second best leaves. Plain blocks and repeating patterns fit several.
fn choice(
    first: ImageView<'_, u8>,
    second: ImageView<'_, u8>,
    corner: (usize, usize),
    shifts: &[Shift],
) -> Option<usize> {
    let from = first.crop(corner.0, corner.1, BLOCK, BLOCK)?;
    let (mut best, mut next) = ((None, u32::MAX), u32::MAX);
    for (i, &(dx, dy)) in shifts.iter().enumerate().take(MOST) {
        let at = corner.0.checked_add_signed(dx).zip(corner.1.checked_add_signed(dy));
        let Some(to) = at.and_then(|(x, y)| second.crop(x, y, BLOCK, BLOCK)) else { continue };
        let difference = difference(from, to) + NOISE;
        if difference < best.1 {
            next = best.1;
            best = (Some(i), difference);
        } else {
            next = next.min(difference);
        }
    }
    best.0.filter(|_| next != u32::MAX && u64::from(best.1) * 3 < u64::from(next) * 2)
}

/// Sum of the absolute differences of two blocks.
fn difference(a: ImageView<'_, u8>, b: ImageView<'_, u8>) -> u32 {
    let rows = a.rows().zip(b.rows());
    rows.map(|(a, b)| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::noise;
    use pursuit_imaging::Image;

    /// Noise in which `moves` says how far the pixel that is at (x, y) of the second image has come.
    fn pair(moves: impl Fn(usize, usize) -> Shift) -> [Image<u8>; 2] {
        let at = |x: isize, y: isize| noise((x + 500) as usize, (y + 500) as usize, 3) as u8;
        let first = Image::from_fn(64, 48, |x, y| at(x as isize, y as isize)).unwrap();
        let second = Image::from_fn(64, 48, |x, y| {
            let (dx, dy) = moves(x, y);
            at(x as isize - dx, y as isize - dy)
        });
        [first, second.unwrap()]
    }

    #[test]
    fn the_majority_shift_is_elected() {
        let elected = |columns: usize, shifts: &[Shift]| {
            let [first, second] = pair(|x, _| if x < columns { (5, -3) } else { (-2, 4) });
            elect(first.view(), second.view(), shifts)
        };
        let shifts = [(0, 0), (5, -3), (-2, 4)];
        assert_eq!([64, 44, 20, 0].map(|columns| elected(columns, &shifts)), [1, 1, 2, 2]);
        // One that is not among the candidates has no votes, and one alone is taken.
        assert_eq!((elected(40, &[(9, 9), (8, 8), (-2, 4)]), elected(40, &[(9, 9)]), elected(40, &[])), (2, 0, 0));
        // No more than so many stand.
        let mut many = [(9, 9); MOST + 1];
        many[MOST] = (5, -3);
        assert_eq!(elected(64, &many), 0);
        many[MOST - 1] = (5, -3);
        assert_eq!(elected(64, &many), MOST - 1);
    }

    #[test]
    fn blocks_vote_only_where_they_can_tell() {
        let [first, second] = pair(|_, _| (5, -3));
        let choose = |x, y, shifts: &[Shift]| choice(first.view(), second.view(), (x, y), shifts);
        assert_eq!(choose(8, 8, &[(1, 1), (5, -3)]), Some(1));
        assert_eq!(choose(8, 8, &[(5, -3), (1, 1)]), Some(0));
        // Its twin is as good; none is good; the right one cannot be compared; only one can.
        assert_eq!(choose(8, 8, &[(5, -3), (1, 1), (5, -3)]), None);
        assert_eq!(choose(8, 8, &[(2, 1), (1, 1), (0, 1)]), None);
        assert_eq!(choose(8, 0, &[(5, -3), (1, 1), (2, 0)]), None);
        assert_eq!(choose(8, 8, &[(5, -3), (70, 0)]), None);
        // What differs by noise alone fits all.
        let flat = Image::from_fn(64, 48, |x, _| 100 + (x % 2) as u8).unwrap();
        assert_eq!(choice(flat.view(), flat.view(), (8, 8), &[(0, 0), (1, 0)]), None);
    }

    #[test]
    fn differences_are_summed_over_the_block() {
        let [a, b] = [0, 1].map(|k| Image::from_fn(8, 8, |x, y| (100 + k * (x * 8 + y)) as u8).unwrap());
        assert_eq!((difference(a.view(), b.view()), difference(b.view(), a.view())), (2016, 2016));
    }
}
