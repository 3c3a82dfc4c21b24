use super::Answer;
use std::f64::consts::TAU;

/// Responses of a network that gives no boxes, at several scales (SiamFC: Bertinetto et al. 2016, arXiv:1606.09549, section
/// 2.2 and "tracking algorithm"): each is enlarged by cubic convolution, the best one by its penalised peak is chosen, and
/// its peak, put to the window, says where the target is.
#[derive(Debug, Clone)]
pub(super) struct ScaleSearch {
    /// Rows and columns of a response, and of one enlarged.
    side: usize,
    large: usize,
    /// Of each enlarged column (or row): the columns it is made of and their weights.
    taps: Vec<[(usize, f64); 4]>,
    /// Outer product of two Hann windows; the sum is one.
    window: Vec<f64>,
    /// The response enlarged along its columns alone.
    rows: Vec<f64>,
    /// The enlarged response of this scale, and of the best so far.
    response: Vec<f64>,
    best: Vec<f64>,
    chosen: Option<Chosen>,
}

/// The best scale.
#[derive(Debug, Clone, Copy)]
struct Chosen {
    factor: f64,
    penalty: f64,
    rank: f64,
}

/// Where the best response has its peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peaked {
    /// How many times larger the window was in which the target was found.
    pub factor: f64,
    /// The penalty of that scale, in (0, 1].
    pub penalty: f64,
    /// From the middle of the response, in its points.
    pub shift: (f64, f64),
    /// Row and column of the nearest point.
    pub point: (usize, usize),
    /// The response there, as the network gave it.
    pub response: f64,
}

impl ScaleSearch {
    /// For responses of `side` × `side`, enlarged `times` each way.
    pub(super) fn new(side: usize, times: usize) -> Self {
        let large = side * times;
        let hann = |i: usize| 0.5 - 0.5 * (TAU * i as f64 / (large - 1).max(1) as f64).cos();
        let mut window: Vec<f64> = (0..large * large).map(|i| hann(i / large) * hann(i % large)).collect();
        let sum: f64 = window.iter().sum();
        window.iter_mut().for_each(|w| *w /= sum.max(f64::MIN_POSITIVE));
        Self {
            side,
            large,
            taps: (0..large).map(|i| taps(i, side, times)).collect(),
            window,
            rows: vec![0.0; side * large],
            response: vec![0.0; large * large],
            best: vec![0.0; large * large],
            chosen: None,
        }
    }

    /// Forgets the scales of the frame before.
    pub(super) const fn begin(&mut self) {
        self.chosen = None;
    }

    /// Takes the response of a window `factor` times as large, to be penalised; whether it is the best so far. A response that
    /// is not finite is none.
    pub(super) fn add(&mut self, answer: Answer<'_>, factor: f64, penalty: f64) -> bool {
        let Self { side, large, taps, rows, response, best, chosen, .. } = self;
        for (row, given) in rows.chunks_exact_mut(*large).zip(answer.scores.chunks_exact(*side)) {
            for (out, taps) in row.iter_mut().zip(&*taps) {
                *out = taps.iter().map(|&(at, weight)| weight * f64::from(given[at])).sum();
            }
        }
        for (line, taps) in response.chunks_exact_mut(*large).zip(&*taps) {
            for (x, out) in line.iter_mut().enumerate() {
                *out = taps.iter().map(|&(at, weight)| weight * rows[at * *large + x]).sum();
            }
        }
        let peak = response.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // A penalty lowers whatever sign it meets.
        let rank = if peak > 0.0 { peak * penalty } else { peak / penalty };
        let is_better = response.iter().all(|v| v.is_finite()) && chosen.is_none_or(|best| rank > best.rank);
        if is_better {
            *chosen = Some(Chosen { factor, penalty, rank });
            std::mem::swap(response, best);
        }
        is_better
    }

    /// The peak at the best scale, the window weighing `share`.
    pub(super) fn peak(&self, share: f64) -> Option<Peaked> {
        let Chosen { factor, penalty, .. } = self.chosen?;
        let least = self.best.iter().copied().fold(f64::INFINITY, f64::min);
        let sum: f64 = self.best.iter().map(|v| v - least).sum();
        let rank = |(value, window): (&f64, &f64)| (1.0 - share) * (value - least) / sum.max(1e-12) + share * window;
        let mut found = (0, f64::NEG_INFINITY);
        for (i, rank) in self.best.iter().zip(&self.window).map(rank).enumerate() {
            if rank > found.1 {
                found = (i, rank);
            }
        }
        let (y, x) = (found.0 / self.large, found.0 % self.large);
        let times = (self.large / self.side) as f64;
        let shift = |i: usize| (i as f64 - (self.large - 1) as f64 / 2.0) / times;
        let point = |i: usize| i * self.side / self.large;
        let response = self.best[found.0];
        Some(Peaked { factor, penalty, shift: (shift(x), shift(y)), point: (point(y), point(x)), response })
    }
}

/// Of sample `i`, `times` to a point, the points it is made of: cubic convolution with a = −3/4, pixel centres at half-integers,
/// the border replicated, as OpenCV's `resize` has it.
fn taps(i: usize, side: usize, times: usize) -> [(usize, f64); 4] {
    const A: f64 = -0.75;
    let place = (i as f64 + 0.5) / times as f64 - 0.5;
    let (first, t) = (place.floor(), place - place.floor());
    let near = |d: f64| ((A + 2.0) * d - (A + 3.0)) * d * d + 1.0;
    let far = |d: f64| ((A * d - 5.0 * A) * d + 8.0 * A) * d - 4.0 * A;
    let weights = [far(1.0 + t), near(t), near(1.0 - t), far(2.0 - t)];
    std::array::from_fn(|k| ((first + k as f64 - 1.0).clamp(0.0, (side - 1) as f64) as usize, weights[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(scales: &[(f64, f64, [f32; 25])], share: f64) -> Option<Peaked> {
        let mut search = ScaleSearch::new(5, 4);
        for (factor, penalty, scores) in scales {
            search.add(Answer { scores, distances: &[] }, *factor, *penalty);
        }
        search.peak(share)
    }

    fn peaked(at: usize, height: f32) -> [f32; 25] {
        std::array::from_fn(|i| if i == at { height } else { 0.0 })
    }

    #[test]
    fn enlarging_keeps_constants_and_lines() {
        for i in 0..40 {
            let taps = taps(i, 10, 4);
            assert!((taps.iter().map(|t| t.1).sum::<f64>() - 1.0).abs() < 1e-12);
            let place = (i as f64 + 0.5) / 4.0 - 0.5;
            if (1.0..8.0).contains(&place) {
                // With a = −3/4 a line comes back but for t (1 − t) (1 − 2t) / 2.
                let (line, t): (f64, f64) = (taps.iter().map(|&(at, w)| at as f64 * w).sum(), place.fract());
                assert!((line - place - t * (1.0 - t) * (1.0 - 2.0 * t) / 2.0).abs() < 1e-12, "{line} for {place}");
            }
        }
        // `cv2.resize(np.float32([[0, 0, 1, 0, 0]]), (10, 1), interpolation=cv2.INTER_CUBIC)`.
        let want = [0.0, -0.035_156_25, -0.105_468_75, 0.261_718_75, 0.878_906_25, 0.878_906_25, 0.261_718_75];
        for (i, want) in want.into_iter().enumerate() {
            let value: f64 = taps(i, 5, 2).iter().filter(|t| t.0 == 2).map(|t| t.1).sum();
            assert!((value - want).abs() < 1e-6, "{i}: {value} for {want}");
        }
    }

    #[test]
    fn the_peak_is_where_the_response_is_highest() {
        // Row 1, column 3: one point above and one to the right of the middle, on four samples a point.
        let found = search(&[(1.0, 1.0, peaked(8, 2.0))], 0.0).unwrap();
        assert_eq!(found.point, (1, 3));
        assert!((found.shift.0 - 1.0).abs() <= 0.25 && (found.shift.1 + 1.0).abs() <= 0.25, "{found:?}");
        assert!(found.response > 1.5);
        // By the window alone it is in the middle.
        assert_eq!(search(&[(1.0, 1.0, peaked(8, 2.0))], 1.0).unwrap().point, (2, 2));
    }

    #[test]
    fn a_scale_must_be_better_by_more_than_its_penalty() {
        let chosen = |other: f32| search(&[(1.0, 1.0, peaked(12, 2.0)), (1.1, 0.9, peaked(12, other))], 0.2).unwrap();
        assert_eq!(chosen(2.1).factor, 1.0);
        assert_eq!((chosen(2.5).factor, chosen(2.5).penalty), (1.1, 0.9));
        // The same below nought.
        let below = |other: f32| [(1.0, 1.0, [-2.0; 25]), (1.1, 0.9, [other; 25])];
        assert_eq!(search(&below(-1.9), 0.2).unwrap().factor, 1.0);
        assert_eq!(search(&below(-1.5), 0.2).unwrap().factor, 1.1);
    }

    #[test]
    fn a_response_that_is_not_finite_is_none() {
        assert_eq!(search(&[(1.0, 1.0, [f32::NAN; 25])], 0.2), None);
        assert_eq!(
            search(&[(0.9, 0.9, peaked(3, f32::INFINITY)), (1.0, 1.0, peaked(12, 1.0))], 0.2).unwrap().factor,
            1.0
        );
        let flat = search(&[(1.0, 1.0, [0.5; 25])], 0.2).unwrap();
        assert_eq!((flat.point, flat.response), ((2, 2), 0.5));
    }
}
