use super::*;
use proptest::prelude::*;

const ALL: [(Neighbor, isize, isize); 4] =
    [(Neighbor::Right, 1, 0), (Neighbor::Below, 0, 1), (Neighbor::BelowRight, 1, 1), (Neighbor::BelowLeft, -1, 1)];

/// What calls cost: the definition, cell by cell.
fn cost(size: Size, cells: &[(i32, i32)], joins: &[[i32; 4]], inside: impl Fn(usize, usize) -> bool) -> i64 {
    let mut sum = 0;
    for y in 0..size.height {
        for x in 0..size.width {
            let k = y * size.width + x;
            sum += i64::from(if inside(x, y) { cells[k].0 } else { cells[k].1 });
            for ((_, dx, dy), weight) in ALL.into_iter().zip(joins[k]) {
                let (Some(nx), Some(ny)) = (x.checked_add_signed(dx), y.checked_add_signed(dy)) else { continue };
                if nx < size.width && ny < size.height && inside(x, y) != inside(nx, ny) {
                    sum += i64::from(weight);
                }
            }
        }
    }
    sum
}

fn solved(cut: &mut GridCut, size: Size, cells: &[(i32, i32)], joins: &[[i32; 4]]) -> i64 {
    cut.reset(size);
    for y in 0..size.height {
        for x in 0..size.width {
            let k = y * size.width + x;
            cut.add(x, y, cells[k].0, cells[k].1);
            ALL.into_iter().zip(joins[k]).for_each(|((to, ..), weight)| cut.join(x, y, to, weight));
        }
    }
    cut.solve()
}

prop_compose! {
    fn grids(most: usize)(width in 1..=most, height in 1..=most)(
        size in Just(Size::new(width, height)),
        cells in prop::collection::vec((0_i32..12, 0_i32..12), width * height),
        joins in prop::collection::vec(prop::array::uniform4(0_i32..8), width * height),
    ) -> (Size, Vec<(i32, i32)>, Vec<[i32; 4]>) {
        (size, cells, joins)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// The twin tries all calls there are.
    #[test]
    fn no_calls_cost_less((size, cells, joins) in grids(3)) {
        let mut cut = GridCut::default();
        let said = solved(&mut cut, size, &cells, &joins);
        let least = (0_u32..1 << size.area())
            .map(|calls| cost(size, &cells, &joins, |x, y| calls >> (y * size.width + x) & 1 == 1))
            .min();
        prop_assert_eq!(Some(said), least);
        prop_assert_eq!(said, cost(size, &cells, &joins, |x, y| cut.is_inside(x, y)));
    }

    /// On larger grids the flow found and the cost of the calls prove each other: no flow exceeds a cut.
    #[test]
    fn flow_and_cut_are_one_on_large_grids(grids in prop::collection::vec(grids(24), 2)) {
        let mut cut = GridCut::default();
        for (size, cells, joins) in grids {
            let said = solved(&mut cut, size, &cells, &joins);
            prop_assert_eq!(said, cost(size, &cells, &joins, |x, y| cut.is_inside(x, y)));
        }
    }
}
