use super::reference::Reference;
use super::*;
use pursuit_testkit::SplitMix;

const GRID: Size = Size::new(12, 10);
const CHANNELS: usize = 3;
const SIGMA: f64 = 0.8;
const PARAMS: ReliabilityParams =
    ReliabilityParams { lambda: 0.3, penalty: 0.7, penalty_growth: 2.5, iterations: 3, rate: 0.25, distinct: true };

fn noise(seed: u64) -> Planes {
    let mut numbers = SplitMix::after(seed);
    let mut planes = Planes::new(GRID, CHANNELS);
    planes.as_mut_slice().iter_mut().for_each(|v| *v = numbers.unit() as f32 - 0.5);
    planes
}

fn doubles(plane: &[f32]) -> Vec<f64> {
    plane.iter().copied().map(f64::from).collect()
}

fn untaught() -> ReliableFilter {
    ReliableFilter::new(PARAMS, GRID, CHANNELS, (4.0, 4.0), SIGMA)
}

fn reference() -> Reference {
    Reference {
        width: GRID.width,
        label: doubles(&gaussian_label(GRID.width, GRID.height, SIGMA, SIGMA)),
        lambda: PARAMS.lambda,
        penalty: PARAMS.penalty,
        growth: PARAMS.penalty_growth,
        iterations: PARAMS.iterations,
    }
}

/// An L in the middle of the grid.
fn some_cells() -> Vec<f32> {
    let inside = |x, y| (4..8).contains(&x) && (3..7).contains(&y) && (x < 6 || y > 4);
    (0..GRID.area()).map(|k| if inside(k % GRID.width, k / GRID.width) { 1.0 } else { 0.0 }).collect()
}

fn highest(plane: &[f64]) -> f64 {
    plane.iter().copied().fold(0.0, f64::max)
}

/// The second local peak of a plane that wraps around, by sorting all.
fn second(plane: &[f64]) -> f64 {
    let (w, h) = (GRID.width, GRID.height);
    let is_peak = |k: usize| {
        let around = |dx: usize, dy: usize| plane[(k / w + dy + h - 1) % h * w + (k % w + dx + w - 1) % w];
        (0..3).all(|dy| (0..3).all(|dx| around(dx, dy) <= plane[k]))
    };
    let mut peaks: Vec<f64> = (0..w * h).filter(|&k| is_peak(k)).map(|k| plane[k]).collect();
    peaks.sort_by(f64::total_cmp);
    peaks.iter().rev().nth(1).copied().unwrap_or(0.0).max(0.0)
}

#[test]
fn equals_the_equations_over_three_updates_and_two_sets_of_cells() {
    let (mut filter, slow, rate) = (untaught(), reference(), 0.3);
    let rectangle = doubles(&filter.cells);
    assert_eq!(rectangle.iter().sum::<f64>(), 16.0);
    let shape = some_cells();
    let mut kept: Vec<Vec<f64>> = Vec::new();
    let mut reliability = vec![0.0; CHANNELS];
    let mut response = vec![0.0; GRID.area()];
    for (step, seed) in [1, 2, 5].into_iter().enumerate() {
        let sample = noise(seed);
        if step == 1 {
            filter.confine(&shape);
        }
        filter.learn(&sample, rate);
        let cells = if step == 0 { rectangle.clone() } else { doubles(&shape) };
        let mut heights = Vec::new();
        for c in 0..CHANNELS {
            let x = doubles(sample.plane(c));
            let new = slow.train(&x, &cells, kept.get(c).map(Vec::as_slice));
            heights.push(highest(&slow.respond(&new, &x)));
            match kept.get_mut(c) {
                Some(old) => old.iter_mut().zip(&new).for_each(|(old, new)| *old += rate * (new - *old)),
                None => kept.push(new),
            }
        }
        let whole: f64 = heights.iter().sum();
        let share = if step == 0 { 1.0 } else { PARAMS.rate };
        reliability.iter_mut().zip(&heights).for_each(|(old, new)| *old += share * (new / whole - *old));
        for (got, want) in filter.reliability().iter().zip(&reliability) {
            assert!((f64::from(*got) - want).abs() < 1e-5, "{got} is not {want}");
        }

        let search = noise(3);
        filter.respond(&search, &mut response);
        let (mut want, mut weights) = (vec![0.0; GRID.area()], 0.0);
        for c in 0..CHANNELS {
            let answer = slow.respond(&kept[c], &doubles(search.plane(c)));
            let weight = reliability[c] * (1.0 - (second(&answer) / highest(&answer)).min(0.5));
            weights += weight;
            want.iter_mut().zip(&answer).for_each(|(want, answer)| *want += weight * answer);
        }
        want.iter_mut().for_each(|want| *want /= weights);
        let scale = want.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (got, want) in response.iter().zip(&want) {
            assert!((f64::from(*got) - want).abs() < 1e-4 * scale, "{got} is not {want}");
        }
    }
}

#[test]
fn is_nothing_outside_of_its_cells() {
    let (mut filter, cells) = (untaught(), some_cells());
    filter.confine(&cells);
    filter.learn(&noise(4), 1.0);
    filter.learn(&noise(5), 0.5);
    let Work { plan, plane, fft, .. } = &mut filter.work;
    for spectrum in filter.filter.0.chunks_exact(plan.spectrum_len()) {
        plan.inverse(spectrum, plane, fft);
        let inside = plane.iter().zip(&cells).map(|(v, m)| v.abs() * m).fold(0.0, f32::max);
        let outside = plane.iter().zip(&cells).map(|(v, m)| v.abs() * (1.0 - m)).fold(0.0, f32::max);
        assert!(inside > 0.0 && outside < 1e-5 * inside, "{outside} outside, {inside} inside");
    }
}

#[test]
fn cells_that_cannot_be_are_left_alone() {
    let mut filter = untaught();
    let before = filter.cells.clone();
    filter.confine(&vec![0.0; GRID.area()]);
    filter.confine(&[1.0; 7]);
    assert_eq!(filter.cells, before);
}

#[test]
fn a_flat_picture_teaches_nothing_that_is_no_number() {
    let mut filter = untaught();
    let mut response = vec![1.0; GRID.area()];
    let flat = Planes::new(GRID, CHANNELS);
    filter.learn(&flat, 1.0);
    filter.learn(&flat, 0.02);
    filter.respond(&flat, &mut response);
    assert!(response.iter().chain(filter.reliability()).all(|v| v.is_finite()));
}

#[test]
fn two_peaks_are_told_apart() {
    let mut plane = vec![0.0; GRID.area()];
    assert_eq!(two_peaks(&plane, GRID.width), (0.0, 0.0));
    // A peak in the corner and its slope over the border, and a lower one elsewhere.
    for (x, y, v) in [(0, 0, 1.0), (GRID.width - 1, 0, 0.8), (1, GRID.height - 1, 0.7), (6, 5, 0.3), (6, 6, 0.2)] {
        plane[y * GRID.width + x] = v;
    }
    assert_eq!(two_peaks(&plane, GRID.width), (1.0, 0.3));
}

#[test]
fn states_that_do_not_fit_are_refused() {
    let mut filter = untaught();
    let back = |f: &ReliableFilter| postcard::from_bytes::<ReliableFilter>(&postcard::to_stdvec(f).unwrap());
    assert_eq!(back(&filter).unwrap().shape(), (GRID, CHANNELS));
    filter.channels = 2;
    assert!(back(&filter).is_err());
    filter.channels = CHANNELS;
    filter.params.iterations = 1000;
    assert!(back(&filter).is_err());
    filter.params.iterations = 2;
    assert!(back(&filter).is_ok());
    filter.cells.pop();
    assert!(back(&filter).is_err());
}
