//! The fixture `mosse`: a slow `f64` reference to 1e-9 and the `f32` path.

use super::MosseFilter;
use crate::correlation::filters::ResponseFilter;
use crate::correlation::reference::{C, assert_close, complex, conj, dft, div, fixture, mul, numbers, real};

/// A = Σ G ⊙ F*, B = Σ F ⊙ F*.
fn sums(samples: &[Vec<C>], label: &[C]) -> (Vec<C>, Vec<C>) {
    let add = |a: C, b: C| (a.0 + b.0, a.1 + b.1);
    let mut sums = (vec![(0.0, 0.0); label.len()], vec![(0.0, 0.0); label.len()]);
    for f in samples {
        for i in 0..label.len() {
            sums.0[i] = add(sums.0[i], mul(label[i], conj(f[i])));
            sums.1[i] = add(sums.1[i], mul(f[i], conj(f[i])));
        }
    }
    sums
}

fn quotient(a: &[C], b: &[C], epsilon: f64) -> Vec<C> {
    a.iter().zip(b).map(|(a, b)| div(*a, (b.0 + epsilon, b.1))).collect()
}

fn parts(v: &[C]) -> Vec<f64> {
    v.iter().flat_map(|c| [c.0, c.1]).collect()
}

#[test]
fn filter_and_response_equal_the_fixture() {
    for case in fixture("mosse") {
        let shape = numbers(&case["shape"]);
        let size = (shape[0] as usize, shape[1] as usize);
        let epsilon = case["eps"].as_f64().unwrap();
        let spectrum = |values: &[f64]| dft(&real(values), size, false);
        let samples: Vec<Vec<f64>> = case["f"].as_array().unwrap().iter().map(numbers).collect();
        let spectra: Vec<_> = samples.iter().map(|f| spectrum(f)).collect();
        let label = spectrum(&numbers(&case["g"]));
        let (a, b) = sums(&spectra, &label);
        let filter = quotient(&a, &b, epsilon);
        assert_close(&parts(&filter), &parts(&complex(&case["H_conj"])), 1e-9, "H*");
        let test = spectrum(&numbers(&case["test"]));
        let product: Vec<C> = test.iter().zip(&filter).map(|(f, h)| mul(*f, *h)).collect();
        let response: Vec<f64> = dft(&product, size, true).into_iter().map(|c| c.0).collect();
        let want = numbers(&case["response"]);
        assert_close(&response, &want, 1e-9, "response");

        // The running average of eqs. 10–12.
        let eta = case["running_eta"].as_f64().unwrap();
        let (first, last) = (sums(&spectra[..1], &label), sums(&spectra[spectra.len() - 1..], &label));
        let mixed = |new: &[C], old: &[C]| -> Vec<C> {
            let mix = |n: f64, o: f64| eta * n + (1.0 - eta) * o;
            new.iter().zip(old).map(|(n, o)| (mix(n.0, o.0), mix(n.1, o.1))).collect()
        };
        let running = quotient(&mixed(&last.0, &first.0), &mixed(&last.1, &first.1), epsilon);
        assert_close(&parts(&running), &parts(&complex(&case["running_H_conj"])), 1e-9, "running H*");

        // The fast path learns the mean of all samples: the same filter with ε divided by their number.
        let (h, w) = size;
        let plane = |values: &[f64]| {
            let mut planes = pursuit_vision::sampling::Planes::new(pursuit_geometry::Size::new(w, h), 1);
            planes.as_mut_slice().iter_mut().zip(values).for_each(|(out, v)| *out = *v as f32);
            planes
        };
        let mean_energy = b.iter().map(|c| c.0).sum::<f64>() / b.len() as f64;
        let mut fast = MosseFilter::with_label(&numbers(&case["g"]), epsilon / mean_energy, (w, h));
        for (k, sample) in samples.iter().enumerate() {
            fast.learn(&plane(sample), 1.0 / (k + 1) as f64);
        }
        let mut got = vec![0.0_f32; h * w];
        fast.respond(&plane(&numbers(&case["test"])), &mut got);
        let got: Vec<f64> = got.into_iter().map(f64::from).collect();
        // Relative error of a quotient of transforms: rounding of each bin against the smallest denominator.
        let smallest = b.iter().map(|c| c.0 + epsilon).fold(f64::INFINITY, f64::min);
        let rounding = f64::from(f32::EPSILON) * 4.0 * ((h * w) as f64).log2();
        let tolerance = rounding * (b.iter().map(|c| c.0).sum::<f64>() / smallest);
        assert!(tolerance < 0.2, "a tolerance of {tolerance} shows nothing");
        assert_close(&got, &want, tolerance, "fast response");
    }
}
