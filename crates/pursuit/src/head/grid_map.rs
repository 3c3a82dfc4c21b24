use pursuit_charts::HeatMap;
use pursuit_ptz::simulation::{Cell, Pair};

/// By how many points the judged controller of a [`Grid`](pursuit_ptz::simulation::Grid) is better than the other
/// ([`Pair::gain`]): a row for each walk and loss, a column for each delay and jitter.
pub fn grid_map(title: &str, pairs: &[Pair]) -> HeatMap {
    const FULL_COLOUR: f64 = 20.0;
    let column = |cell: &Cell| format!("{:.1}±{:.1}", cell.delay_s, cell.jitter_s);
    let row = |cell: &Cell| format!("{}, {:.0} % lost", cell.walk.name(), 100.0 * cell.loss);
    let mut columns: Vec<String> = Vec::new();
    let mut rows: Vec<String> = Vec::new();
    for pair in pairs {
        for (names, name) in [(&mut columns, column(&pair.cell)), (&mut rows, row(&pair.cell))] {
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    let gain = |of_row: &str, of_column: &str| {
        let pair = pairs.iter().find(|pair| row(&pair.cell) == of_row && column(&pair.cell) == of_column);
        pair.map_or(f64::NAN, |pair| 100.0 * pair.gain())
    };
    let values: Vec<(String, Vec<f64>)> =
        rows.iter().map(|row| (row.clone(), columns.iter().map(|column| gain(row, column)).collect())).collect();
    let map = HeatMap::new(title, columns, FULL_COLOUR);
    values.into_iter().fold(map, |map, (name, values)| map.with_row(name, values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_ptz::simulation::{Figures, Walk};

    #[test]
    fn gains_are_shown_and_losses_count_more() {
        let pair = |delay_s, central, shown| Pair {
            cell: Cell { walk: Walk::Pacing, delay_s, jitter_s: 0.3, loss: 0.05 },
            judged: Figures { central, shown, ..Figures::default() },
            other: Figures { central: 0.5, shown: 0.9, ..Figures::default() },
            errors: None,
        };
        let svg =
            grid_map("gains", &[pair(0.1, 0.9, 0.9), pair(0.3, 0.9, 0.7), pair(0.8, 0.47, 1.0)]).to_svg().unwrap();
        for shown in ["0.1±0.3", "0.8±0.3", "pacing, 5 % lost", "+40.0", "-20.0", "-3.0"] {
            assert!(svg.contains(shown), "{shown}");
        }
        assert_eq!(grid_map("none", &[]).to_svg(), None);
    }
}
