use super::L1UpdateParams;
use pursuit_vision::patch::dot;
use serde::{Deserialize, Serialize};

/// Templates of the target, of length one and without their mean, and how much each has been used. The first one stays.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Templates")]
pub(super) struct Templates {
    pixels: usize,
    /// One after the other.
    rows: Vec<f32>,
    weights: Vec<f64>,
    #[serde(skip)]
    derived: Derived,
}

pursuit_estimation::checked!(Templates);

/// What follows from the templates.
#[derive(Debug, Clone, Default)]
struct Derived {
    /// An orthonormal basis of what they span.
    basis: Vec<f32>,
    /// The greatest eigenvalue of TᵀT is no greater.
    bound: f64,
    sorted: Vec<f64>,
}

/// What is left of a template beside the others, that is no direction of its own.
const NOTHING: f32 = 1e-3;

impl Templates {
    fn restored(self) -> Result<Self, &'static str> {
        let (count, pixels) = (self.weights.len(), self.pixels);
        let whole = (1..=32).contains(&count) && (1..=1024).contains(&pixels) && self.rows.len() == count * pixels;
        let sound = self.rows.iter().all(|v| v.abs() <= 1.001) && self.weights.iter().all(|w| (0.0..=1.0).contains(w));
        if !whole || !sound {
            return Err("its templates are not sound");
        }
        let mut all = self;
        all.derive();
        Ok(all)
    }

    /// Of patches of length one, all of `pixels` values, one after the other.
    pub fn new(rows: Vec<f32>, pixels: usize) -> Self {
        let count = rows.len() / pixels.max(1);
        let mut all = Self { pixels, rows, weights: vec![1.0 / count as f64; count], derived: Derived::default() };
        all.derive();
        all
    }

    pub const fn count(&self) -> usize {
        self.weights.len()
    }

    pub const fn pixels(&self) -> usize {
        self.pixels
    }

    pub fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.rows.chunks_exact(self.pixels)
    }

    /// No less than the greatest eigenvalue of TᵀT.
    pub const fn bound(&self) -> f64 {
        self.derived.bound
    }

    /// What no sum of the templates explains of a patch of length one: the error of least squares, below that of any code (mei2011,
    /// section 4).
    pub fn least_error(&self, y: &[f32]) -> f64 {
        let explained: f64 = self.derived.basis.chunks_exact(self.pixels).map(|q| f64::from(dot(q, y)).powi(2)).sum();
        (f64::from(dot(y, y)) - explained).max(0.0)
    }

    fn derive(&mut self) {
        let (n, pixels) = (self.count(), self.pixels);
        let Derived { basis, bound, sorted } = &mut self.derived;
        sorted.reserve(n);
        // No eigenvalue is greater than the greatest sum of a row's absolute values (Gershgorin).
        let row = |i: usize| &self.rows[i * pixels..(i + 1) * pixels];
        let sum = |i: usize| (0..n).map(|j| f64::from(dot(row(i), row(j)).abs())).sum::<f64>();
        *bound = (0..n).map(sum).fold(1.0, f64::max);
        basis.clear();
        for i in 0..n {
            let start = basis.len();
            basis.extend_from_slice(row(i));
            // Twice, so that rounding leaves nothing of the others.
            for _ in 0..2 {
                let (known, new) = basis.split_at_mut(start);
                for q in known.chunks_exact(pixels) {
                    let along = dot(q, new);
                    new.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
                }
            }
            let length = dot(&basis[start..], &basis[start..]).sqrt();
            if length > NOTHING {
                basis[start..].iter_mut().for_each(|v| *v /= length);
            } else {
                basis.truncate(start);
            }
        }
    }

    /// Takes in that the target looked like `y`, coded by the coefficients `code` (mei2011, algorithm 1): templates that are used
    /// weigh more, and a new look takes the place of the one that weighs least.
    pub fn update(&mut self, y: &[f32], code: &[f32], params: &L1UpdateParams) {
        for (weight, a) in self.weights.iter_mut().zip(code) {
            *weight *= f64::from(*a).min(10.0).exp();
        }
        let best = (0..code.len()).max_by(|a, b| code[*a].total_cmp(&code[*b])).unwrap_or(0);
        let alike = f64::from(dot(y, &self.rows[best * self.pixels..][..self.pixels])).clamp(-1.0, 1.0);
        if alike.acos() > params.angle_rad
            && let Some(least) = (1..self.count()).min_by(|a, b| self.weights[*a].total_cmp(&self.weights[*b]))
        {
            let sorted = &mut self.derived.sorted;
            sorted.clear();
            sorted.extend_from_slice(&self.weights);
            sorted.sort_unstable_by(f64::total_cmp);
            self.weights[least] = sorted[sorted.len() / 2];
            self.rows[least * self.pixels..][..self.pixels].copy_from_slice(y);
            self.derive();
        }
        let sum: f64 = self.weights.iter().sum();
        self.weights.iter_mut().for_each(|w| *w = (*w / sum).min(params.most_weight));
        let sum: f64 = self.weights.iter().sum();
        self.weights.iter_mut().for_each(|w| *w = (*w / sum).min(1.0));
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;
    use pursuit_vision::patch::normalize;

    const PIXELS: usize = 60;

    /// A patch of length one: up to 9 near the template of that number, then anything.
    pub fn patch(seed: u64) -> Vec<f32> {
        let mut numbers = SplitMix::after(if seed < 10 { 99 } else { seed });
        let mut own = SplitMix::after(1000 + seed);
        let mut y: Vec<f32> = (0..PIXELS).map(|_| numbers.unit() as f32 + 0.4 * own.unit() as f32).collect();
        normalize(&mut y);
        y
    }

    pub fn templates() -> Templates {
        Templates::new((0..5).flat_map(patch).collect(), PIXELS)
    }

    #[test]
    fn no_code_is_below_the_least_error() {
        let known = templates();
        let mut coder = super::super::apg::Coder::default();
        for seed in [0, 3, 7, 20, 21] {
            let (y, params) = (patch(seed), super::super::L1CodeParams::default());
            let bound = known.least_error(&y);
            for mu in [0.0, 10.0] {
                coder.code(&known, &y, &params, mu);
                let error = coder.error(&known, &y);
                assert!(bound <= error + 1e-5, "patch {seed}: {bound} is above {error}");
            }
            assert!(if seed < 5 { bound < 1e-5 } else { bound > 0.01 }, "patch {seed}: {bound}");
        }
    }

    #[test]
    fn new_looks_replace_what_is_least_used() {
        let mut known = templates();
        let (params, before) = (L1UpdateParams::default(), known.rows.clone());
        known.update(&patch(3), &[0.1, 0.0, 0.3, 0.5, 0.2], &params);
        assert_eq!(known.rows, before, "it is no new look");
        assert!(known.weights[3] > known.weights[2] && known.weights[2] > known.weights[1]);
        let new = patch(40);
        known.update(&new, &[0.0, 0.0, 0.1, 0.1, 0.1], &params);
        assert_eq!(known.rows[PIXELS..2 * PIXELS], new[..]);
        assert_eq!((&known.rows[..PIXELS], &known.rows[2 * PIXELS..]), (&before[..PIXELS], &before[2 * PIXELS..]));
        assert!((known.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        assert!(known.least_error(&new) < 1e-5);
    }

    #[test]
    fn states_that_cannot_be_are_refused() {
        let back = |t: &Templates| postcard::from_bytes::<Templates>(&postcard::to_stdvec(t).unwrap());
        let known = templates();
        let again = back(&known).unwrap();
        assert_eq!(again.derived.basis, known.derived.basis);
        assert!(back(&Templates { pixels: 0, ..known.clone() }).is_err());
        assert!(back(&Templates { rows: vec![5.0; 5 * PIXELS], ..known.clone() }).is_err());
        assert!(back(&Templates { weights: vec![-1.0; 5], ..known }).is_err());
    }
}
