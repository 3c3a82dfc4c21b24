use super::super::twins::{canvas, canvas_at, ratings};
use super::*;

fn taught(params: &DlssvmParams, shape: &Shape, frames: usize) -> Dlssvm {
    let mut it = Dlssvm::new(params, shape, false);
    (0..frames).for_each(|k| it.learn(shape, &canvas_at(k as f64).1, shape.middle()));
    it
}

/// The features of a window, by their definition.
fn features(it: &Dlssvm, grid: &Grid, pattern: usize, window: Place) -> Vec<f64> {
    let mut row = Vec::new();
    maps::bits(&it.patterns[pattern].levels, grid, window, &mut row);
    row.iter().map(|v| f64::from(*v) / (grid.features() as f64).sqrt()).collect()
}

/// Ψ of a window.
fn psi(it: &Dlssvm, grid: &Grid, pattern: usize, window: Place) -> Vec<f64> {
    let target = features(it, grid, pattern, it.patterns[pattern].target);
    target.iter().zip(features(it, grid, pattern, window)).map(|(a, b)| a - b).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// w by its definition, over all support vectors.
fn weights(it: &Dlssvm, grid: &Grid) -> Vec<f64> {
    let mut w = vec![0.0; grid.features()];
    for v in &it.vectors {
        w.iter_mut().zip(psi(it, grid, v.pattern, v.window)).for_each(|(w, p)| *w += v.weight * p);
    }
    w
}

fn dual(it: &Dlssvm, grid: &Grid) -> f64 {
    let w = weights(it, grid);
    it.vectors.iter().map(|v| v.loss * v.weight).sum::<f64>() - 0.5 * dot(&w, &w)
}

#[test]
fn ratings_and_margins_are_by_their_definition() {
    let (shape, canvas) = canvas();
    let mut it = taught(&DlssvmParams::default(), &shape, 6);
    let grid = Grid::new(&shape, &it.params, false);
    it.look(&canvas);
    let (best, all) = ratings(&mut it, &shape, &canvas);
    assert!(best.x.abs_diff(shape.middle().x) <= 1 && best.y.abs_diff(shape.middle().y) <= 1, "{best:?}");
    let w = weights(&it, &grid);
    let mut levels = Vec::new();
    it.scratch.maps.pattern(&grid, &mut levels);
    it.patterns.push(Pattern { levels, target: grid.window_at(shape.middle()) });
    let last = it.patterns.len() - 1;
    for window in [Place { x: 0, y: 0 }, Place { x: 16, y: 16 }, Place { x: 31, y: 5 }, Place { x: 9, y: 31 }] {
        let at = grid.on_canvas(window);
        let want = dot(&w, &features(&it, &grid, last, window));
        let got = f64::from(all[at.y * shape.windows() + at.x]);
        assert!((got - want).abs() < 1e-4 * (1.0 + want.abs()), "{window:?}: {got} is not {want}");
    }
    for v in &it.vectors {
        let want = dot(&w, &psi(&it, &grid, v.pattern, v.window));
        assert!((v.margin - want).abs() < 1e-4 * (1.0 + want.abs()), "{} is not {want}", v.margin);
    }
}

#[test]
fn no_step_lowers_the_dual() {
    let (shape, _) = canvas();
    let mut it = taught(&DlssvmParams { reprocess: 0, c: 2.0, ..DlssvmParams::default() }, &shape, 6);
    let mut derived = it.derived.take().unwrap();
    let grid = derived.grid;
    let mut last = dual(&it, &grid);
    let first = last;
    let mut rises = |it: &Dlssvm, what: &str| {
        let now = dual(it, &grid);
        assert!(now >= last - 1e-6 * last.abs(), "{what}: {now} is below {last}");
        last = now;
    };
    for k in 0..12 {
        it.take_worst(k % it.patterns.len(), &shape, &mut derived);
        derived.is_current = false;
        rises(&it, "a new support vector");
        for l in 0..it.vectors.len() {
            it.step(l, &derived);
            rises(&it, "an old one");
        }
    }
    assert!(dual(&it, &grid) > first);
}

#[test]
fn constraints_and_budget_are_kept() {
    let (shape, _) = canvas();
    let it = taught(&DlssvmParams { budget: 12, c: 0.5, ..DlssvmParams::default() }, &shape, 25);
    assert!(it.is_sound(&shape) && it.vectors.len() <= 12 && !it.vectors.is_empty());
    for pattern in 0..it.patterns.len() {
        let sum: f64 = it.vectors.iter().filter(|v| v.pattern == pattern).map(|v| v.weight).sum();
        assert!(sum > 0.0 && sum <= 0.5 + 1e-9, "{sum}");
    }
}

/// The dual over all windows of all frames, by projected gradients with momentum: another method, and no working set.
fn dense(it: &Dlssvm, shape: &Shape, grid: &Grid) -> f64 {
    let side = grid.windows;
    let windows: Vec<(usize, Place)> = (0..it.patterns.len())
        .flat_map(|p| (0..side * side).map(move |k| (p, Place { x: k % side, y: k / side })))
        .collect();
    let rows: Vec<Vec<f64>> = windows.iter().map(|(p, w)| psi(it, grid, *p, *w)).collect();
    let loss: Vec<f64> = windows
        .iter()
        .map(|(p, w)| 1.0 - shape.overlap(grid.on_canvas(it.patterns[*p].target), grid.on_canvas(*w)))
        .collect();
    let gram: Vec<Vec<f64>> = rows.iter().map(|a| rows.iter().map(|b| dot(a, b)).collect()).collect();
    let bound = gram.iter().map(|row| row.iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    let (mut alpha, mut ahead, mut t) = (vec![0.0; rows.len()], vec![0.0; rows.len()], 1.0_f64);
    for _ in 0..6000 {
        let mut next: Vec<f64> =
            (0..rows.len()).map(|k| ahead[k] + (loss[k] - dot(&gram[k], &ahead)) / bound).collect();
        next.chunks_exact_mut(side * side).for_each(|of_frame| project(of_frame, it.params.c));
        let after = (1.0 + (1.0 + 4.0 * t * t).sqrt()) / 2.0;
        ahead = next.iter().zip(&alpha).map(|(n, a)| n + (t - 1.0) / after * (n - a)).collect();
        (alpha, t) = (next, after);
    }
    let quadratic: f64 = alpha.iter().zip(&gram).map(|(a, row)| a * dot(row, &alpha)).sum();
    dot(&loss, &alpha) - 0.5 * quadratic
}

/// The nearest point that is nowhere negative and adds up to `most` at most.
fn project(values: &mut [f64], most: f64) {
    let clipped: f64 = values.iter().map(|v| v.max(0.0)).sum();
    let mut by = 0.0;
    if clipped > most {
        // By bisection of what is taken from all.
        let (mut low, mut high) = (0.0, values.iter().copied().fold(0.0, f64::max));
        for _ in 0..60 {
            by = 0.5 * (low + high);
            let sum: f64 = values.iter().map(|v| (v - by).max(0.0)).sum();
            if sum > most { low = by } else { high = by }
        }
    }
    values.iter_mut().for_each(|v| *v = (*v - by).max(0.0));
}

#[test]
fn coordinate_descent_reaches_the_solution_of_the_whole_problem() {
    let shape = Shape { width: 12, height: 12, reach: 16 };
    for c in [0.3, 100.0] {
        // Windows four pixels apart: few enough for the whole problem.
        let params = DlssvmParams { cell_px: 4, c, budget: 1000, reprocess: 0, ..DlssvmParams::default() };
        let mut it = Dlssvm::new(&params, &shape, false);
        let frames = [0.0, 9.0].map(|k| {
            let mut canvas = Canvas::default();
            canvas.look(&super::super::twins::frame_at(k), &shape, &BBox::from_ltwh(58.0, 58.0, 12.0, 12.0));
            canvas
        });
        frames.iter().for_each(|canvas| it.learn(&shape, canvas, shape.middle()));
        let mut derived = it.derived.take().unwrap();
        for k in 0..400 {
            it.take_worst(k % it.patterns.len(), &shape, &mut derived);
            (0..20).for_each(|_| it.pass(&derived));
            derived.is_current = false;
        }
        assert_eq!(it.patterns.len(), 2);
        let (got, want) = (dual(&it, &derived.grid), dense(&it, &shape, &derived.grid));
        assert!((got - want).abs() < 2e-3 * want, "C = {c}: {got} is not {want}");
    }
}

#[test]
fn restored_states_go_on_alike() {
    let (shape, canvas) = canvas();
    let mut it = taught(&DlssvmParams { budget: 20, ..DlssvmParams::default() }, &shape, 12);
    let bytes = postcard::to_stdvec(&it).unwrap();
    let mut again = postcard::from_bytes::<Dlssvm>(&bytes).unwrap().restored(&shape).unwrap();
    for k in 12..15 {
        let next = canvas_at(f64::from(k)).1;
        it.learn(&shape, &next, shape.middle());
        again.learn(&shape, &next, shape.middle());
        it.look(&canvas);
        again.look(&canvas);
        assert_eq!(ratings(&mut it, &shape, &canvas), ratings(&mut again, &shape, &canvas), "frame {k}");
    }
}

#[test]
fn states_that_cannot_be_are_refused() {
    let (shape, _) = canvas();
    let whole = taught(&DlssvmParams::default(), &shape, 3);
    assert!(whole.clone().restored(&shape).is_some());
    let with = |change: &dyn Fn(&mut Dlssvm)| {
        let mut it = whole.clone();
        change(&mut it);
        it.restored(&shape)
    };
    assert!(with(&|it| it.params.budget = usize::MAX).is_none(), "its kernel would fill any memory");
    assert!(with(&|it| it.vectors[0].pattern = 99).is_none());
    assert!(with(&|it| it.vectors[0].window.x = 32).is_none());
    assert!(with(&|it| it.vectors[0].weight = f64::NAN).is_none());
    assert!(with(&|it| it.patterns[0].levels.truncate(1)).is_none());
    assert!(with(&|it| it.patterns[0].levels[0] = 0xffff).is_none());
    // Weights beyond the frame's constraint are brought back by the first step.
    let mut odd = with(&|it| it.vectors.iter_mut().for_each(|v| v.weight = 100.0)).unwrap();
    (0..3).for_each(|k| odd.learn(&shape, &canvas_at(f64::from(k)).1, shape.middle()));
    assert!(odd.is_sound(&shape));
}
