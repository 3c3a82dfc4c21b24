use super::LANES;
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

/// How many outputs are summed up together at most.
pub const TOGETHER: usize = 8;

/// Of `M` outputs at `P` places.
pub type Sums<S, const P: usize, const M: usize> = [[f32x16<S>; M]; P];

/// How many outputs are summed up together, sixteen columns of each: as many as there are registers for, beside what they are made
/// from. [`by_registers!`] says at how many places.
#[inline(always)]
pub const fn outputs<S: Simd>(_: S) -> usize {
    match S::f32s::LEN {
        LANES.. => 8,
        8 => 6,
        _ => 4,
    }
}

/// Runs `$kernel::<S, P, M>` for the places `P` and outputs `M` that are summed up together.
macro_rules! by_registers {
    ($simd:ident => $kernel:ident($($argument:expr),* $(,)?)) => {
        match $crate::kernels::panels::outputs($simd) {
            8 => $kernel::<_, 2, 8>($simd, $($argument),*),
            6 => $kernel::<_, 1, 6>($simd, $($argument),*),
            _ => $kernel::<_, 1, 4>($simd, $($argument),*),
        }
    };
}
pub(super) use by_registers;

/// Weights and biases of outputs: of those that are summed up together, a panel, the weights of one tap stand side by side.
/// Outputs that are missing from the last panel have zeros.
#[derive(Debug, Clone)]
pub struct Panels {
    outputs: usize,
    taps: usize,
    weights: Vec<f32>,
    bias: Vec<f32>,
    together: usize,
}

impl Panels {
    /// `weight` says what an output takes of a tap.
    pub fn new(bias: &[f32], taps: usize, weight: impl Fn(usize, usize) -> f32) -> Self {
        Self::of(dispatch!(Level::new(), simd => outputs(simd)), bias, taps, weight)
    }

    /// With `together` outputs in a panel.
    fn of(together: usize, bias: &[f32], taps: usize, weight: impl Fn(usize, usize) -> f32) -> Self {
        let padded = bias.len().next_multiple_of(together);
        let mut weights = vec![0.0; padded * taps];
        for o in 0..bias.len() {
            for t in 0..taps {
                weights[(o / together * taps + t) * together + o % together] = weight(o, t);
            }
        }
        let outputs = bias.len();
        let mut bias = bias.to_vec();
        bias.resize(padded, 0.0);
        Self { outputs, taps, weights, bias, together }
    }

    /// The same with panels of so many outputs, as another instruction set would have them.
    #[cfg(test)]
    pub fn regrouped(&self, together: usize) -> Self {
        let Self { taps, together: now, .. } = *self;
        let weight = |o: usize, t| self.weights[(o / now * taps + t) * now + o % now];
        Self::of(together, &self.bias[..self.outputs], taps, weight)
    }

    /// All outputs.
    pub const fn outputs(&self) -> usize {
        self.outputs
    }

    /// What each output is made from.
    pub const fn taps(&self) -> usize {
        self.taps
    }

    /// Outputs of a panel.
    pub const fn together(&self) -> usize {
        self.together
    }

    /// How many panels there are.
    pub const fn count(&self) -> usize {
        self.bias.len() / self.together
    }

    /// Of panel `n`, tap by tap.
    #[inline(always)]
    pub fn weights<const M: usize>(&self, n: usize) -> &[[f32; M]] {
        debug_assert_eq!(M, self.together);
        &self.weights.as_chunks().0[n * self.taps..][..self.taps]
    }

    /// Of panel `n`, sixteen times each at each place.
    #[inline(always)]
    pub fn biases<S: Simd, const P: usize, const M: usize>(&self, simd: S, n: usize) -> Sums<S, P, M> {
        let bias: &[f32; M] = &self.bias.as_chunks().0[n];
        [splat(simd, bias); P]
    }
}

/// Each number sixteen times.
#[inline(always)]
fn splat<S: Simd, const M: usize>(simd: S, numbers: &[f32; M]) -> [f32x16<S>; M] {
    let mut lanes = [f32x16::splat(simd, 0.0); M];
    for i in 0..M {
        lanes[i] = f32x16::splat(simd, numbers[i]);
    }
    lanes
}

/// sums[p][i] += weights[i] · x[p].
#[inline(always)]
pub fn add<S: Simd, const P: usize, const M: usize>(
    simd: S,
    weights: &[f32; M],
    x: [&[f32; LANES]; P],
    sums: &mut Sums<S, P, M>,
) {
    let mut columns = [f32x16::splat(simd, 0.0); P];
    for p in 0..P {
        columns[p] = f32x16::load_array_ref(simd, x[p]);
    }
    for i in 0..M {
        for p in 0..P {
            sums[p][i] = columns[p].mul_add(weights[i], sums[p][i]);
        }
    }
}
