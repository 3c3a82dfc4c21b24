use super::super::twins::{canvas, canvas_at, ratings};
use super::*;

/// The function by its definition.
fn slow(struck: &Struck, x: &[f32]) -> f64 {
    let kernel = |row: &[f32]| {
        let distance: f64 = x.iter().zip(row).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (-struck.params.sigma * distance).exp()
    };
    struck.vectors.iter().zip(struck.rows.chunks(FEATURES)).map(|(v, row)| v.weight * kernel(row)).sum()
}

fn taught(params: &StruckParams, frames: usize) -> (Shape, Struck) {
    let (shape, _) = canvas();
    let mut struck = Struck::new(params, &shape);
    (0..frames).for_each(|k| struck.learn(&shape, &canvas_at(k as f64).1, shape.middle()));
    (shape, struck)
}

#[test]
fn ratings_and_gradients_are_by_their_definition() {
    let (shape, mut struck) = taught(&StruckParams::default(), 8);
    let canvas = canvas_at(3.0).1;
    let (best, all) = ratings(&mut struck, &shape, &canvas);
    assert!(best.x.abs_diff(shape.middle().x) <= 1 && best.y.abs_diff(shape.middle().y) <= 1, "{best:?}");
    for place in [best, Place { x: 0, y: 0 }, Place { x: 40, y: 7 }, Place { x: 63, y: 63 }] {
        let mut x = vec![0.0; FEATURES];
        struck.bank.values(&canvas, place, &mut x);
        let (got, want) = (f64::from(all[place.y * shape.windows() + place.x]), slow(&struck, &x));
        assert!((got - want).abs() < 1e-2 * (1.0 + want.abs()), "{place:?}: {got} is not {want}");
    }
    for (k, v) in struck.vectors.iter().enumerate() {
        let want =
            -struck.patterns[v.pattern].losses[v.sample] - slow(&struck, &struck.rows[k * FEATURES..][..FEATURES]);
        assert!((v.gradient - want).abs() < 1e-2 * (1.0 + want.abs()), "{k}: {} is not {want}", v.gradient);
    }
}

#[test]
fn the_dual_keeps_its_constraints_and_its_budget() {
    let params = StruckParams { budget: 12, ..StruckParams::default() };
    let (shape, struck) = taught(&params, 25);
    assert!(struck.is_sound(&shape) && struck.vectors.len() <= 12 && !struck.vectors.is_empty());
    for pattern in 0..struck.patterns.len() {
        let own = || struck.vectors.iter().filter(|v| v.pattern == pattern);
        assert!(own().map(|v| v.weight).sum::<f64>().abs() < 1e-6, "weights of a frame add up to nothing");
        assert!(own().all(|v| if v.sample == 0 { v.weight <= params.c + 1e-9 } else { v.weight <= 1e-9 }));
    }
}

#[test]
fn optimization_raises_the_dual() {
    let objective = |s: &Struck| {
        let linear: f64 = s.vectors.iter().map(|v| -s.patterns[v.pattern].losses[v.sample] * v.weight).sum();
        let norm: f64 = (0..s.vectors.len())
            .flat_map(|i| (0..s.vectors.len()).map(move |j| (i, j)))
            .map(|(i, j)| s.vectors[i].weight * s.vectors[j].weight * s.k(i, j))
            .sum();
        linear - 0.5 * norm
    };
    let (_, mut struck) = taught(&StruckParams { reprocess: 0, ..StruckParams::default() }, 6);
    let before = objective(&struck);
    (0..20).for_each(|_| struck.process_old());
    (0..100).for_each(|_| struck.optimize());
    assert!(objective(&struck) > before, "{} is not above {before}", objective(&struck));
}

#[test]
fn restored_kernels_are_as_they_were() {
    let (shape, struck) = taught(&StruckParams::default(), 5);
    let again = Struck { kernel: Vec::new(), ..struck.clone() }.restored(&shape).unwrap();
    for (i, j) in (0..struck.vectors.len()).flat_map(|i| (0..struck.vectors.len()).map(move |j| (i, j))) {
        assert!((again.k(i, j) - struck.k(i, j)).abs() < 1e-6);
    }
}

#[test]
fn states_out_of_order_are_refused_or_keep_the_budget() {
    let params = StruckParams { budget: 8, ..StruckParams::default() };
    let (shape, struck) = taught(&params, 20);
    let mut huge = struck.clone();
    huge.params.budget = usize::MAX;
    assert!(huge.restored(&shape).is_none(), "its kernel would fill any memory");
    // No weight below zero: there is nothing that the rule of the budget may remove.
    let mut odd = struck;
    odd.vectors.iter_mut().for_each(|v| v.weight = v.weight.abs());
    let mut odd = odd.restored(&shape).unwrap();
    for k in 0..30 {
        odd.learn(&shape, &canvas_at(f64::from(k)).1, shape.middle());
        assert!(odd.vectors.len() <= 8, "{}", odd.vectors.len());
    }
}
