use super::L1CodeParams;
use super::templates::Templates;
use multiversion::multiversion;
use pursuit_vision::patch::dot;

/// Writes patches as sums of templates and pixels, by the accelerated proximal gradient (bao2012, algorithm 1). Owns its scratch.
#[derive(Debug, Clone, Default)]
pub(super) struct Coder {
    /// Coefficients of templates and of pixels: of the last step, and where the next begins.
    templates: Vec<f32>,
    pixels: Vec<f32>,
    ahead_templates: Vec<f32>,
    ahead_pixels: Vec<f32>,
    /// T a + e − y there.
    rest: Vec<f32>,
}

impl Coder {
    /// Coefficients of the templates and of the pixels of the patch `y` of length one.
    pub fn code(&mut self, known: &Templates, y: &[f32], params: &L1CodeParams, mu: f64) -> (&[f32], &[f32]) {
        let Self { templates, pixels, ahead_templates, ahead_pixels, rest } = self;
        let (n, d) = (known.count(), y.len());
        let all = [(&mut *templates, n), (ahead_templates, n), (pixels, d), (ahead_pixels, d), (rest, d)];
        for (values, count) in all {
            values.clear();
            values.resize(count, 0.0);
        }
        let Self { templates, pixels, ahead_templates, ahead_pixels, rest } = self;
        // The gradient changes by no more than this times a step: the greatest eigenvalue of [T I]ᵀ[T I] is 1 more than that of TᵀT.
        let step = (1.0 / (known.bound() + 1.0 + mu)) as f32;
        let (lambda, pixel_lambda, mu) = (params.lambda as f32, params.pixel_lambda as f32, mu as f32);
        let mut t = 1.0_f32;
        for _ in 0..params.iterations {
            rest.iter_mut().zip(&*ahead_pixels).zip(y).for_each(|((r, e), y)| *r = e - y);
            for (row, a) in known.rows().zip(&*ahead_templates).filter(|(_, a)| **a != 0.0) {
                add_scaled(row, *a, rest);
            }
            let after = 0.5 * (1.0 + (1.0 + 4.0 * t * t).sqrt());
            let lead = (t - 1.0) / after;
            for ((row, last), ahead) in known.rows().zip(&mut *templates).zip(&mut *ahead_templates) {
                let next = (*ahead - step * (dot(row, rest) + lambda)).max(0.0);
                *ahead = next + lead * (next - *last);
                *last = next;
            }
            step_pixels(rest, pixels, ahead_pixels, [step, mu, step * pixel_lambda, lead]);
            t = after;
        }
        (&self.templates, &self.pixels)
    }

    /// ‖y − T a‖² of the last patch coded, `y`.
    pub fn error(&mut self, known: &Templates, y: &[f32]) -> f64 {
        let Self { templates, rest, .. } = self;
        rest.copy_from_slice(y);
        known.rows().zip(&*templates).for_each(|(row, a)| add_scaled(row, -a, rest));
        f64::from(dot(rest, rest))
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_scaled(row: &[f32], by: f32, out: &mut [f32]) {
    for (out, v) in out.iter_mut().zip(row) {
        *out += by * v;
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn step_pixels(rest: &[f32], pixels: &mut [f32], ahead: &mut [f32], [step, mu, shrink, lead]: [f32; 4]) {
    for ((rest, last), ahead) in rest.iter().zip(pixels).zip(ahead) {
        let v = *ahead - step * (rest + mu * *ahead);
        let next = v - v.clamp(-shrink, shrink);
        *ahead = next + lead * (next - *last);
        *last = next;
    }
}

#[cfg(test)]
mod tests {
    use super::super::templates::tests::{patch, templates};
    use super::*;

    /// The objective, by its definition.
    fn objective(known: &Templates, y: &[f32], a: &[f64], e: &[f64], params: &L1CodeParams, mu: f64) -> f64 {
        let rows: Vec<&[f32]> = known.rows().collect();
        let fit: f64 = (0..y.len())
            .map(|i| {
                let sum: f64 = rows.iter().zip(a).map(|(row, a)| a * f64::from(row[i])).sum();
                (f64::from(y[i]) - sum - e[i]).powi(2)
            })
            .sum();
        let sizes =
            params.lambda * a.iter().sum::<f64>() + params.pixel_lambda * e.iter().map(|v| v.abs()).sum::<f64>();
        0.5 * fit + sizes + 0.5 * mu * e.iter().map(|v| v * v).sum::<f64>()
    }

    /// Plain proximal gradients, one step like the other.
    fn plain(known: &Templates, y: &[f32], params: &L1CodeParams, mu: f64, steps: usize) -> (Vec<f64>, Vec<f64>) {
        let rows: Vec<Vec<f64>> = known.rows().map(|r| r.iter().copied().map(f64::from).collect()).collect();
        let bound = rows.len() as f64 + 1.0 + mu;
        let (mut a, mut e) = (vec![0.0; rows.len()], vec![0.0; y.len()]);
        for _ in 0..steps {
            let rest: Vec<f64> = (0..y.len())
                .map(|i| rows.iter().zip(&a).map(|(row, a)| a * row[i]).sum::<f64>() + e[i] - f64::from(y[i]))
                .collect();
            for (a, row) in a.iter_mut().zip(&rows) {
                let slope: f64 = row.iter().zip(&rest).map(|(t, r)| t * r).sum();
                *a = (*a - (slope + params.lambda) / bound).max(0.0);
            }
            for (e, r) in e.iter_mut().zip(&rest) {
                let v = *e - (r + mu * *e) / bound;
                *e = v.signum() * (v.abs() - params.pixel_lambda / bound).max(0.0);
            }
        }
        (a, e)
    }

    fn doubles(v: &[f32]) -> Vec<f64> {
        v.iter().copied().map(f64::from).collect()
    }

    #[test]
    fn accelerated_gradients_reach_what_plain_ones_do() {
        let known = templates();
        for (mu, pixel_lambda) in [(0.0, 0.03), (10.0, 0.001)] {
            let params = L1CodeParams { iterations: 400, pixel_lambda, ..L1CodeParams::default() };
            for seed in [3, 4, 50] {
                let y = patch(seed);
                let (a, e) = plain(&known, &y, &params, mu, 20_000);
                let want = objective(&known, &y, &a, &e, &params, mu);
                let mut coder = Coder::default();
                let (a, e) = coder.code(&known, &y, &params, mu);
                let (a, e) = (doubles(a), doubles(e));
                let got = objective(&known, &y, &a, &e, &params, mu);
                assert!((got - want).abs() < 1e-3 * want, "μ = {mu}, patch {seed}: {got} is not {want}");
                assert!(a.iter().all(|v| *v >= 0.0));
            }
        }
    }

    #[test]
    fn few_iterations_are_nearer_than_as_many_plain_ones() {
        let (known, y) = (templates(), patch(4));
        let params = L1CodeParams { iterations: 20, ..L1CodeParams::default() };
        let value = |a: &[f64], e: &[f64]| objective(&known, &y, a, e, &params, params.mu);
        let (a, e) = plain(&known, &y, &params, params.mu, 20_000);
        let least = value(&a, &e);
        let (a, e) = plain(&known, &y, &params, params.mu, 20);
        let slow = value(&a, &e) - least;
        let mut coder = Coder::default();
        let (a, e) = coder.code(&known, &y, &params, params.mu);
        let (a, e) = (doubles(a), doubles(e));
        let quick = value(&a, &e) - least;
        assert!(quick < 0.5 * slow, "{quick} beside {slow}");
    }
}
