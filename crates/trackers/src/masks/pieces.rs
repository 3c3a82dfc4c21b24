/// Keeps the 4-connected pieces of set cells that have at least the share `least` of the largest one's cells; owns its scratch.
#[derive(Debug, Clone, Default)]
pub(super) struct Pieces {
    /// Of each cell the number of its piece, from 1; 0 is none.
    labels: Vec<u32>,
    areas: Vec<u32>,
    stack: Vec<usize>,
}

impl Pieces {
    pub(super) fn keep_large(&mut self, cells: &mut [bool], width: usize, least: f64) {
        let width = width.max(1);
        self.labels.clear();
        self.labels.resize(cells.len(), 0);
        self.areas.clear();
        for start in 0..cells.len() {
            if !cells[start] || self.labels[start] != 0 {
                continue;
            }
            self.areas.push(0);
            let label = self.areas.len() as u32;
            self.labels[start] = label;
            self.stack.push(start);
            while let Some(at) = self.stack.pop() {
                self.areas[label as usize - 1] += 1;
                let column = at % width;
                let neighbours = [
                    (column > 0).then(|| at - 1),
                    (column + 1 < width).then_some(at + 1),
                    at.checked_sub(width),
                    Some(at + width).filter(|below| *below < cells.len()),
                ];
                for next in neighbours.into_iter().flatten() {
                    if cells[next] && self.labels[next] == 0 {
                        self.labels[next] = label;
                        self.stack.push(next);
                    }
                }
            }
        }
        let enough = least * f64::from(self.areas.iter().copied().max().unwrap_or(0));
        for (cell, label) in cells.iter_mut().zip(&self.labels) {
            *cell &= self.areas.get((*label as usize).wrapping_sub(1)).is_some_and(|area| f64::from(*area) >= enough);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pieces_are_left_out() {
        let picture = ["##..#", "##..#", "....#", "#...."];
        let mut cells: Vec<bool> = picture.iter().flat_map(|row| row.chars().map(|c| c == '#')).collect();
        let mut pieces = Pieces::default();
        pieces.keep_large(&mut cells, 5, 0.5);
        let kept: Vec<String> =
            cells.chunks(5).map(|row| row.iter().map(|c| if *c { '#' } else { '.' }).collect()).collect();
        assert_eq!(kept, ["##..#", "##..#", "....#", "....."]);
        pieces.keep_large(&mut cells, 5, 1.0);
        assert_eq!(cells.iter().filter(|c| **c).count(), 4);
        pieces.keep_large(&mut [], 5, 1.0);
    }
}
