//! The slow, obvious filter of danelljan2017 and what it must agree with.

use super::{CHANNELS, CompressedFilter, Compression};
use crate::correlation::filters::{MosseFilter, ResponseFilter};
use crate::correlation::reference::{C, conj, dft, mul, real};
use nalgebra::DMatrix;
use pursuit_geometry::Size;
use pursuit_testkit::SplitMix;
use pursuit_vision::fourier::gaussian_label;
use pursuit_vision::sampling::Planes;

const GRID: Size = Size::new(10, 8);
const SIGMA: f64 = 0.9;
const LAMBDA: f64 = 0.01;

/// Features that vary in some directions much more than in others.
fn features(seed: u64) -> Planes {
    let mut numbers = SplitMix::after(seed);
    let mut planes = Planes::new(GRID, CHANNELS);
    for (c, plane) in planes.planes_mut().enumerate() {
        for v in plane.iter_mut() {
            *v = (numbers.unit() as f32 - 0.5) / (1.0 + 0.3 * c as f32);
        }
    }
    planes
}

/// Channels as rows, cells as columns.
fn matrix(planes: &Planes) -> DMatrix<f64> {
    DMatrix::from_row_slice(CHANNELS, GRID.area(), planes.as_slice()).map(f64::from)
}

/// Spectra of the rows.
fn spectra(planes: &DMatrix<f64>) -> Vec<Vec<C>> {
    let row = |r: usize| real(&planes.row(r).iter().copied().collect::<Vec<_>>());
    (0..planes.nrows()).map(|r| dft(&row(r), (GRID.height, GRID.width), false)).collect()
}

/// The response to `z` after learning `samples` with `rate`.
fn slow(samples: &[Planes], rate: f64, dimensions: usize, z: &Planes) -> Vec<f64> {
    let label: Vec<f64> = gaussian_label(GRID.width, GRID.height, SIGMA, SIGMA).into_iter().map(f64::from).collect();
    let label = dft(&real(&label), (GRID.height, GRID.width), false);
    let n = GRID.area();
    let (mut template, mut power) = (DMatrix::zeros(CHANNELS, n), vec![0.0; n]);
    let mut projection = DMatrix::zeros(dimensions, CHANNELS);
    for (t, sample) in samples.iter().enumerate() {
        let (rate, x) = (if t == 0 { 1.0 } else { rate }, matrix(sample));
        template = &template * (1.0 - rate) + &x * rate;
        // The left singular vectors of the template with the largest singular values (sorted by nalgebra).
        let vectors = template.clone().svd(true, false).u.unwrap();
        projection = vectors.columns(0, dimensions).transpose();
        for (k, power) in power.iter_mut().enumerate() {
            let energy: f64 = spectra(&(&projection * &x)).iter().map(|s| s[k].0.powi(2) + s[k].1.powi(2)).sum();
            *power = (1.0 - rate) * *power + rate * energy;
        }
    }
    let lambda = LAMBDA * power.iter().sum::<f64>() / n as f64;
    let (u, z) = (spectra(&(&projection * template)), spectra(&(&projection * matrix(z))));
    let bin = |k: usize| {
        let terms = u.iter().zip(&z).map(|(u, z)| mul(mul(label[k], conj(u[k])), z[k]));
        let sum = terms.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        (sum.0 / (power[k] + lambda), sum.1 / (power[k] + lambda))
    };
    let response: Vec<C> = (0..n).map(bin).collect();
    dft(&response, (GRID.height, GRID.width), true).into_iter().map(|v| v.0).collect()
}

fn respond(filter: &mut impl ResponseFilter, samples: &[Planes], rate: f64, z: &Planes) -> Vec<f32> {
    for (t, sample) in samples.iter().enumerate() {
        filter.learn(sample, if t == 0 { 1.0 } else { rate });
    }
    let mut response = vec![0.0; GRID.area()];
    filter.respond(z, &mut response);
    response
}

#[test]
fn the_filter_is_that_of_the_paper() {
    let samples = [features(1), features(2), features(3)];
    for dimensions in [3, 18] {
        let mut filter = CompressedFilter::new(dimensions, LAMBDA, SIGMA, GRID);
        let got = respond(&mut filter, &samples, 0.3, &features(4));
        let want = slow(&samples, 0.3, dimensions, &features(4));
        let scale = want.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (got, want) in got.iter().zip(&want) {
            assert!((f64::from(*got) - want).abs() < 1e-3 * scale, "{dimensions}: {got} is not {want}");
        }
    }
}

#[test]
fn without_compression_it_is_the_filter_of_dsst() {
    let samples = [features(5), features(6)];
    let whole = respond(&mut CompressedFilter::new(CHANNELS, LAMBDA, SIGMA, GRID), &samples, 0.2, &features(7));
    let plain = respond(&mut MosseFilter::new(LAMBDA, SIGMA, GRID, CHANNELS), &samples, 0.2, &features(7));
    for (a, b) in whole.iter().zip(&plain) {
        assert!((a - b).abs() < 1e-4, "{a} is not {b}");
    }
}

#[test]
fn the_subcell_peak_is_the_series_peak() {
    let mut filter = CompressedFilter::new(18, LAMBDA, SIGMA, GRID);
    let response = respond(&mut filter, &[features(8)], 1.0, &features(8));
    let (x, y, _) = pursuit_vision::fourier::highest(&response, GRID.width);
    let (plan, series) = filter.series();
    let peak = pursuit_vision::fourier::newton_peak(plan, series, x as f64, y as f64, 3);
    // The response to what was learned is the label, whose peak stands on a cell.
    assert!(peak.x.abs() < 0.02 && peak.y.abs() < 0.02, "{peak:?}");
}

#[test]
fn compression_keeps_the_directions_of_the_largest_energy() {
    let template = features(9);
    let mut compression = Compression::new(18);
    compression.fit(template.as_slice());
    let mut kept = Planes::default();
    compression.apply(template.as_slice(), GRID, &mut kept);
    let energy = |values: &[f32]| values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    let values = matrix(&template).singular_values();
    let want: f64 = values.iter().take(18).map(|v| v * v).sum();
    assert!((energy(kept.as_slice()) - want).abs() < 1e-4 * want);
    // Without numbers the projection stays.
    let before = compression.clone();
    compression.fit(&vec![f32::NAN; CHANNELS * GRID.area()]);
    assert!(compression == before && compression.is_consistent());
}
