use super::{CameraParams, Contender, Figures, Study, Walk};
use crate::Result;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Conditions under which contenders are compared: each delay with each jitter, each loss and each walk.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// From a command to when its effect arrives in a picture, seconds: half of it in the head, half of it in the camera.
    pub delays_s: Vec<f64>,
    /// By how much longer each command may take, and by how much longer each picture, seconds.
    pub jitters_s: Vec<f64>,
    /// Which fraction of the commands gets lost, and which fraction of the pictures.
    pub losses: Vec<f64>,
    /// The walks.
    pub walks: Vec<Walk>,
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            delays_s: vec![0.1, 0.2, 0.3, 0.5, 0.8],
            jitters_s: vec![0.0, 0.1, 0.2, 0.3],
            losses: vec![0.0, 0.05, 0.2],
            walks: Walk::ALL.to_vec(),
        }
    }
}

/// One set of conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// How the target moves.
    pub walk: Walk,
    /// The whole delay, seconds.
    pub delay_s: f64,
    /// The jitter of commands and of pictures, seconds.
    pub jitter_s: f64,
    /// The fraction of commands and of pictures that gets lost.
    pub loss: f64,
}

/// What two contenders did under the same conditions and the same seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The conditions.
    pub cell: Cell,
    /// The figures of the one that is judged.
    pub judged: Figures,
    /// The figures of the one that it is compared with.
    pub other: Figures,
    /// The standard errors of both [`gains`](Self::gains), by how they differ from seed to seed; none of a single seed.
    pub errors: Option<(f64, f64)>,
}

impl Pair {
    /// By how much more often the judged one kept its target central, and in the picture: fractions, negative where the
    /// other did so more often.
    pub fn gains(&self) -> (f64, f64) {
        (self.judged.central - self.other.central, self.judged.shown - self.other.shown)
    }

    /// A loss of more than this fraction counts.
    const COUNTS: f64 = 0.02;

    /// Whether the other one was better by more than two hundredths in either.
    pub fn is_worse(&self) -> bool {
        let (central, shown) = self.gains();
        central.min(shown) < -Self::COUNTS
    }

    /// Whether the other one is better by more than two hundredths in either even where the seeds were unkind by twice the standard
    /// error (by chance in one of forty cells of equals).
    pub fn is_surely_worse(&self) -> bool {
        let (central, shown) = self.gains();
        self.errors.is_some_and(|errors| (central + 2.0 * errors.0).min(shown + 2.0 * errors.1) < -Self::COUNTS)
    }

    /// One figure for both gains: how much more often the target was central, unless it was so much less often in the picture that
    /// it counts; then the lesser of both.
    pub fn gain(&self) -> f64 {
        let (central, shown) = self.gains();
        if shown < -Self::COUNTS { central.min(shown) } else { central }
    }
}

impl Grid {
    /// Every set of conditions, walk by walk.
    pub fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for &walk in &self.walks {
            for &loss in &self.losses {
                for &jitter_s in &self.jitters_s {
                    cells.extend(self.delays_s.iter().map(|&delay_s| Cell { walk, delay_s, jitter_s, loss }));
                }
            }
        }
        cells
    }

    /// Runs both contenders in every cell over all seeds, on as many threads as there are cores. The order of the cells and
    /// every figure are the same for any number of threads.
    ///
    /// # Errors
    /// Where a parameter of the study or of the grid is out of its range.
    pub fn run(&self, study: &Study, judged: Contender, other: Contender, seeds: &Range<u64>) -> Result<Vec<Pair>> {
        let cells = self.cells();
        let next = AtomicUsize::new(0);
        let done = Mutex::new(Vec::<(usize, Result<Pair>)>::with_capacity(cells.len()));
        let work = || {
            while let Some((index, &cell)) = {
                let index = next.fetch_add(1, Ordering::Relaxed);
                cells.get(index).map(|cell| (index, cell))
            } {
                let pair = cell.compare(study, judged, other, seeds);
                done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((index, pair));
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
        let mut pairs = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        pairs.sort_by_key(|(index, _)| *index);
        pairs.into_iter().map(|(_, pair)| pair).collect()
    }
}

impl Cell {
    /// The study under these conditions.
    fn study(&self, study: &Study) -> Result<Study> {
        let mut study = study.clone();
        let mut camera = study.camera.take().map_or_else(CameraParams::usual, Ok)?;
        (study.head.delay_s, camera.age_s) = (0.5 * self.delay_s, 0.5 * self.delay_s);
        (study.head.jitter_s, camera.jitter_s) = (self.jitter_s, self.jitter_s);
        (study.head.dropped, camera.dropped) = (self.loss, self.loss);
        study.camera = Some(camera);
        Ok(study)
    }

    fn compare(&self, study: &Study, judged: Contender, other: Contender, seeds: &Range<u64>) -> Result<Pair> {
        let study = self.study(study)?;
        let (judged, other) =
            (study.run(self.walk, judged, seeds.clone())?, study.run(self.walk, other, seeds.clone())?);
        let error = |figure: fn(&Figures) -> f64| {
            standard_error(judged.iter().zip(&other).map(|(judged, other)| figure(judged) - figure(other)))
        };
        let errors = error(|f| f.central).zip(error(|f| f.shown));
        Ok(Pair { cell: *self, judged: Figures::mean(&judged), other: Figures::mean(&other), errors })
    }
}

/// The standard error of the mean; none of fewer than two values.
fn standard_error(values: impl ExactSizeIterator<Item = f64> + Clone) -> Option<f64> {
    let count = values.len() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares = values.map(|value| (value - mean).powi(2)).sum::<f64>();
    (count > 1.0).then(|| (squares / (count * (count - 1.0))).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_in_order_and_repeat_exactly() {
        let grid = Grid {
            delays_s: vec![0.1, 0.3],
            jitters_s: vec![0.0, 0.2],
            losses: vec![0.1],
            walks: vec![Walk::Passing, Walk::Standing],
        };
        let study = Study { duration_s: 5.0, ..Study::default() };
        let run = || grid.run(&study, Contender::Velocity, Contender::Unpredicted, &(0..2)).unwrap();
        let pairs = run();
        assert_eq!(pairs, run());
        assert_eq!(pairs.iter().map(|pair| pair.cell).collect::<Vec<_>>(), grid.cells());
        assert_eq!(grid.cells().len(), 8);
        let alone = pairs[1].cell.study(&study).unwrap();
        assert_eq!((alone.head.delay_s, alone.head.dropped), (0.15, 0.1));
        let figures = Figures::mean(&alone.run(Walk::Passing, Contender::Velocity, 0..2).unwrap());
        assert_eq!(figures, pairs[1].judged);
        assert_eq!(pairs[1].gains().0, pairs[1].judged.central - pairs[1].other.central);
        let soon = pairs[0].cell.study(&study).unwrap();
        let of = |contender, seed| soon.run(Walk::Passing, contender, seed..seed + 1).unwrap()[0].central;
        let [first, second] = [0, 1].map(|seed| of(Contender::Velocity, seed) - of(Contender::Unpredicted, seed));
        // Of two values it is half of what they differ by.
        assert!((pairs[0].errors.unwrap().0 - 0.5 * (first - second).abs()).abs() < 1e-12);
        assert!(first != second, "or nothing is seen");
    }

    #[test]
    fn a_loss_within_what_seeds_differ_by_is_not_sure() {
        let cell = Cell { walk: Walk::Passing, delay_s: 0.3, jitter_s: 0.0, loss: 0.0 };
        let (judged, other) =
            (Figures { shown: 0.95, ..Figures::default() }, Figures { shown: 1.0, ..Figures::default() });
        let of = |error: Option<f64>| Pair { cell, judged, other, errors: error.map(|error| (0.0, error)) };
        assert!(of(Some(0.01)).is_worse() && of(Some(0.01)).is_surely_worse());
        assert!(of(Some(0.02)).is_worse() && !of(Some(0.02)).is_surely_worse());
        assert!(of(None).is_worse() && !of(None).is_surely_worse());
        assert_eq!(standard_error([1.0, 2.0, 3.0].into_iter()), Some((1.0_f64 / 3.0).sqrt()));
        assert_eq!((standard_error([1.0].into_iter()), standard_error([0.0; 0].into_iter())), (None, None));
    }

    #[test]
    fn conditions_out_of_range_are_refused() {
        let grid = Grid { losses: vec![1.5], ..Grid::default() };
        assert!(grid.run(&Study::default(), Contender::Velocity, Contender::Unpredicted, &(0..1)).is_err());
    }
}
