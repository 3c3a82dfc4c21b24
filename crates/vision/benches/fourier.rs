//! Real two-dimensional transforms at the sizes that trackers use.

use criterion::{Criterion, criterion_group, criterion_main};
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, newton_peak, spectra};
use std::hint::black_box;

fn transforms(c: &mut Criterion) {
    let mut group = c.benchmark_group("real_fft2");
    for n in [32, 40, 48, 50, 54, 60, 64, 72, 128] {
        let plan = RealFft2::<f32>::new(n, n);
        let mut plane: Vec<f32> = (0..n * n).map(|i| (i * 7919 % 257) as f32 / 256.0).collect();
        let mut bins = vec![Complex32::default(); plan.spectrum_len()];
        let mut scratch = FftScratch::default();
        group.bench_function(format!("forward {n}"), |b| {
            b.iter(|| plan.forward(black_box(&plane), &mut bins, &mut scratch))
        });
        group.bench_function(format!("inverse {n}"), |b| {
            b.iter(|| plan.inverse(black_box(&bins), &mut plane, &mut scratch))
        });
        group.bench_function(format!("newton {n}"), |b| b.iter(|| newton_peak(&plan, black_box(&bins), 0.0, 0.0, 3)));
        let (a, mut sum) = (bins.clone(), bins.clone());
        group.bench_function(format!("add_conj_product {n}"), |b| {
            b.iter(|| spectra::add_conj_product(&mut sum, black_box(&a), &bins));
        });
    }
    group.finish();
}

criterion_group!(benches, transforms);
criterion_main!(benches);
