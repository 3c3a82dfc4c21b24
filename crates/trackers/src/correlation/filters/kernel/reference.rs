//! The fixtures `kernel_correlation` and `kcf_train_detect`: a slow `f64` reference to 1e-9, and the `f32` path to a tolerance
//! derived from its rounding.

use super::{Kernel, KernelFilter, Work};
use crate::correlation::filters::ResponseFilter;
use crate::correlation::peaks::displacement;
use crate::correlation::reference::{C, assert_close, complex, conj, dft, div, fixture, mul, numbers, real};
use pursuit_geometry::Size;
use pursuit_vision::sampling::Planes;
use serde_json::Value;

struct Case {
    size: (usize, usize),
    channels: usize,
    kernel: Kernel,
    normalised: bool,
    x: Vec<f64>,
    z: Vec<f64>,
}

impl Case {
    fn read(case: &Value) -> Self {
        let shape = numbers(&case["shape"]);
        let param = |name: &str| case["params"][name].as_f64().unwrap();
        let kernel = match case["kernel"].as_str().unwrap() {
            "linear" => Kernel::Linear,
            "gaussian" => Kernel::Gaussian { sigma: param("sigma") },
            "poly" => Kernel::Polynomial { offset: param("a"), power: param("b") },
            other => panic!("unknown kernel {other}"),
        };
        Self {
            size: (shape[0] as usize, shape[1] as usize),
            channels: shape[2] as usize,
            kernel,
            normalised: case["normalised_by_numel"].as_bool().unwrap_or(true),
            x: numbers(&case["x"]),
            z: numbers(&case["z"]),
        }
    }

    fn area(&self) -> usize {
        self.size.0 * self.size.1
    }

    /// The number of values in a patch.
    fn n(&self) -> f64 {
        self.x.len() as f64
    }

    fn channel(&self, patch: &[f64], c: usize) -> Vec<f64> {
        patch.iter().skip(c).step_by(self.channels).copied().collect()
    }

    fn planes(&self, patch: &[f64]) -> Planes {
        let mut planes = Planes::new(Size::new(self.size.1, self.size.0), self.channels);
        let values = (0..self.channels).flat_map(|c| self.channel(patch, c));
        planes.as_mut_slice().iter_mut().zip(values).for_each(|(out, v)| *out = v as f32);
        planes
    }

    /// With values weighted by the symmetric Hann window of the fixture.
    fn windowed(mut self) -> Self {
        let (h, w) = self.size;
        let hann = |i: usize, n: usize| 0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / (n - 1) as f64).cos();
        let channels = self.channels;
        for patch in [&mut self.x, &mut self.z] {
            for (i, v) in patch.iter_mut().enumerate() {
                *v *= hann(i / channels / w, h) * hann(i / channels % w, w);
            }
        }
        self
    }

    /// Kernel correlation by the formulas of the paper, in `f64`.
    fn correlation(&self, x: &[f64], z: &[f64]) -> Vec<f64> {
        let mut sum = vec![(0.0, 0.0); self.area()];
        for c in 0..self.channels {
            let (fx, fz) = (self.spectrum(&self.channel(x, c)), self.spectrum(&self.channel(z, c)));
            sum.iter_mut().zip(fx.into_iter().zip(fz)).for_each(|(s, (a, b))| {
                let product = mul(conj(a), b);
                *s = (s.0 + product.0, s.1 + product.1);
            });
        }
        let n = if self.normalised { self.n() } else { 1.0 };
        let norms: f64 = x.iter().chain(z).map(|v| v * v).sum();
        let value = |c: f64| match self.kernel {
            Kernel::Linear => c / n,
            Kernel::Polynomial { offset, power } => (c / n + offset).powf(power),
            Kernel::Gaussian { sigma } => (-(norms - 2.0 * c).max(0.0) / (sigma * sigma * n)).exp(),
        };
        dft(&sum, self.size, true).into_iter().map(|c| value(c.0)).collect()
    }

    fn spectrum(&self, plane: &[f64]) -> Vec<C> {
        dft(&real(plane), self.size, false)
    }

    /// The kernel whose value on inner products divided by n is the fixture's, where there is one.
    fn kernel_on_means(&self) -> Option<(Kernel, f64)> {
        match self.kernel {
            kernel if self.normalised => Some((kernel, 1.0)),
            Kernel::Linear => Some((Kernel::Linear, self.n())),
            Kernel::Gaussian { sigma } => Some((Kernel::Gaussian { sigma: sigma / self.n().sqrt() }, 1.0)),
            Kernel::Polynomial { .. } => None,
        }
    }

    /// Bound on the error of kernel values in `f32`: rounding of a transform of N values grows with log N and with the
    /// norms; the kernel passes it on with its steepest slope over the values that occur.
    fn kernel_tolerance(&self, x: &[f64], z: &[f64]) -> f64 {
        let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let depth = 4.0 * (self.area() as f64).log2();
        let inner =
            f64::from(f32::EPSILON) * depth * (norm(x) * norm(z) + norm(x).powi(2) + norm(z).powi(2)) / self.n();
        let mean = norm(x) * norm(z) / self.n();
        match self.kernel {
            Kernel::Linear => inner,
            Kernel::Polynomial { offset, power } => inner * power * (mean + offset).powf(power - 1.0),
            Kernel::Gaussian { sigma } => inner * 2.0 / (sigma * sigma) + f64::from(f32::EPSILON),
        }
    }
}

#[test]
fn kernel_correlation_equals_the_fixture() {
    for case in fixture("kernel_correlation") {
        let want = numbers(&case["k"]);
        let case = Case::read(&case);
        assert_close(&case.correlation(&case.x, &case.z), &want, 1e-9, "reference");

        let Some((kernel, factor)) = case.kernel_on_means() else { continue };
        let mut work = Work::new(Size::new(case.size.1, case.size.0), 1.0, case.channels);
        work.transform(&case.planes(&case.x));
        let model = work.spectra.clone();
        work.transform(&case.planes(&case.z));
        let norms: f64 = case.x.iter().chain(&case.z).map(|v| v * v).sum();
        work.kernel_correlation(kernel, Some(&model), norms);
        let got: Vec<f64> = work.plane.iter().map(|v| f64::from(*v) * factor).collect();
        let tolerance = match (kernel, case.normalised) {
            (Kernel::Gaussian { .. }, false) => case.kernel_tolerance(&case.x, &case.z) * case.n(),
            _ => case.kernel_tolerance(&case.x, &case.z) * factor,
        };
        assert!(tolerance < 0.05, "a tolerance of {tolerance} shows nothing");
        assert_close(&got, &want, tolerance, &format!("fast path, {kernel:?}"));
    }
}

#[test]
fn training_and_detection_equal_the_fixture() {
    for fixture in fixture("kcf_train_detect") {
        let mut case = Case::read(&fixture);
        if fixture["hann_window"].as_bool().unwrap() {
            case = case.windowed();
        }
        let (lambda, label_sigma) = (fixture["lambda"].as_f64().unwrap(), fixture["label_sigma"].as_f64().unwrap());
        let label = numbers(&fixture["label"]);

        let (kxx, kxz) = (case.correlation(&case.x, &case.x), case.correlation(&case.x, &case.z));
        assert_close(&kxx, &numbers(&fixture["kxx"]), 1e-9, "kxx");
        assert_close(&kxz, &numbers(&fixture["kxz"]), 1e-9, "kxz");
        let (fxx, fxz) = (case.spectrum(&kxx), case.spectrum(&kxz));
        let alpha: Vec<C> =
            case.spectrum(&label).into_iter().zip(&fxx).map(|(y, k)| div(y, (k.0 + lambda, k.1))).collect();
        let parts = |v: &[C]| v.iter().flat_map(|c| [c.0, c.1]).collect::<Vec<_>>();
        assert_close(&parts(&alpha), &parts(&complex(&fixture["alpha_hat"])), 1e-9, "alpha");
        let product: Vec<C> = fxz.iter().zip(&alpha).map(|(k, a)| mul(*k, *a)).collect();
        let response: Vec<f64> = dft(&product, case.size, true).into_iter().map(|c| c.0).collect();
        let want = numbers(&fixture["response"]);
        assert_close(&response, &want, 1e-9, "response");

        // The fast path.
        let (h, w) = case.size;
        let mut filter = KernelFilter::new(case.kernel, lambda, label_sigma, Size::new(w, h), case.channels);
        filter.learn(&case.planes(&case.x), 1.0);
        let mut fast = vec![0.0_f32; h * w];
        filter.respond(&case.planes(&case.z), &mut fast);
        // A kernel value off by δ moves a bin of its spectrum by at most N δ; α̂ = ŷ/(k̂ + λ) passes that on.
        let n = case.area() as f64;
        let (dxx, dxz) = (case.kernel_tolerance(&case.x, &case.x), case.kernel_tolerance(&case.x, &case.z));
        let size = |c: &C| c.0.hypot(c.1);
        let moved = |((z, x), a): ((&C, &C), &C)| {
            let below = (x.0 + lambda - n * dxx).max(lambda / 2.0);
            size(a) * (n * dxz + size(z) * n * dxx / below) / n
        };
        let tolerance: f64 = fxz.iter().zip(&fxx).zip(&alpha).map(moved).sum();
        let got: Vec<f64> = fast.iter().map(|v| f64::from(*v)).collect();
        for (g, want) in got.iter().zip(&want) {
            assert!((g - want).abs() <= tolerance, "{:?}: {g} is not {want} within {tolerance}", case.kernel);
        }
        // Where the bound says something, the peak is the same cell.
        let mut sorted = want.clone();
        sorted.sort_by(|a, b| b.total_cmp(a));
        if sorted[0] - sorted[1] > 2.0 * tolerance {
            let (dx, dy) = displacement(&fast, w).unwrap();
            let shift = numbers(&fixture["shift_dy_dx"]);
            let cell = |v: f64, n: usize| v.round().rem_euclid(n as f64);
            assert_eq!((cell(dy, h), cell(dx, w)), (cell(shift[0], h), cell(shift[1], w)));
        }
        // Whatever the bound says, the fast path is close on these small cases.
        assert_close(&got, &want, 2e-2, "fast response");
    }
}
