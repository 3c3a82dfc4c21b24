//! Moving a covariance through a transition that leaves most of a state as it is.

use nalgebra::{SMatrix, SVector};

use crate::Transition;

/// What of a transition differs from the identity, found once when it is made so that no step has to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shear<const N: usize> {
    /// A bit for every row of `F` that is not the identity's.
    rows: u64,
    /// For each row, a bit for every entry that is not zero.
    entries: [u64; N],
    /// The largest sum of magnitudes in a row of `F`.
    growth: f64,
    /// The sum of what a step adds: the trace of `Q` and the magnitudes of `B u`.
    added: f64,
}

/// Results below this cannot have overflowed on the way.
pub(crate) const SAFE: f64 = 1e300;

impl<const N: usize> Shear<N> {
    /// The structure of an upper triangular transition, as those of integrators in the order `[position, velocity, …]`
    /// are; `None` for any other.
    #[inline]
    pub(crate) fn of(
        matrix: &SMatrix<f64, N, N>,
        noise: &SMatrix<f64, N, N>,
        offset: &SVector<f64, N>,
    ) -> Option<Self> {
        if N > u64::BITS as usize {
            return None;
        }
        let mut shear = Self { rows: 0, entries: [0; N], growth: 0.0, added: 0.0 };
        for r in 0..N {
            let mut sum = 0.0;
            for k in 0..N {
                let entry = matrix.data.0[k][r];
                if entry != 0.0 {
                    if k < r {
                        return None;
                    }
                    shear.entries[r] |= 1 << k;
                }
                sum += entry.abs();
            }
            if shear.entries[r] != 1 << r || matrix.data.0[r][r] != 1.0 {
                shear.rows |= 1 << r;
            }
            shear.growth = shear.growth.max(sum);
            shear.added += noise.data.0[r][r] + offset.data.0[0][r].abs();
        }
        Some(shear)
    }

    /// The structure of a step that moves `axes` axes alike, each by the upper triangular `matrix` of `K` orders.
    #[inline]
    pub(crate) fn of_axes<const K: usize>(
        matrix: &SMatrix<f64, K, K>,
        noise: &SMatrix<f64, K, K>,
        axes: usize,
    ) -> Option<Self> {
        if N > u64::BITS as usize {
            return None;
        }
        let mut shear = Self { rows: 0, entries: [0; N], growth: 0.0, added: 0.0 };
        for r in 0..K {
            let mut sum = 0.0;
            // Every order above, whether or not a tiny step has made its entry zero.
            let mut entries = 0;
            for k in r..K {
                sum += matrix.data.0[k][r].abs();
                entries |= 1 << (k * axes);
            }
            let differs = r + 1 < K || matrix.data.0[r][r] != 1.0;
            for axis in 0..axes {
                shear.entries[r * axes + axis] = entries << axis;
                shear.rows |= u64::from(differs) << (r * axes + axis);
            }
            shear.growth = shear.growth.max(sum);
            shear.added += noise.data.0[r][r] * axes as f64;
        }
        Some(shear)
    }

    /// The structure of a step of `[x, y, vx, vy, …]` by `dt_s` that leaves all other components where they are.
    #[inline]
    pub(crate) fn moving_centre(dt_s: f64, noise_trace: f64) -> Option<Self> {
        if N > u64::BITS as usize {
            return None;
        }
        let entries = std::array::from_fn(|r| if r < 2 { 1 << r | 1 << (r + 2) } else { 1 << r });
        Some(Self { rows: 0b11, entries, growth: 1.0 + dt_s, added: noise_trace })
    }

    /// Whether a belief of this size can be moved without looking for overflow: no entry of a covariance is larger than
    /// its trace.
    #[inline]
    pub(crate) fn is_safe(&self, mean: &SVector<f64, N>, covariance: &SMatrix<f64, N, N>) -> bool {
        let (mut trace, mut size) = (0.0, 0.0);
        for a in 0..N {
            trace += covariance.data.0[a][a];
            size += mean.data.0[0][a].abs();
        }
        self.growth * (self.growth * trace + size) + self.added < SAFE
    }

    /// `x ← F x + B u`, `P ← F P Fᵀ + Q` in place, with work only where `F` is not the identity. `P` stays symmetric to the
    /// last bit: only columns are computed, and rows are copied from them.
    #[inline]
    pub(crate) fn apply(
        &self,
        transition: &Transition<N>,
        mean: &mut SVector<f64, N>,
        covariance: &mut SMatrix<f64, N, N>,
    ) {
        let (f, q) = (&transition.matrix().data.0, &transition.noise().data.0);
        let (x, p) = (&mut mean.data.0[0], &mut covariance.data.0);
        // The columns of P Fᵀ that change. In ascending order, as they only draw on later ones.
        for r in 0..N {
            if !bit(self.rows, r) {
                continue;
            }
            let weight = f[r][r];
            let mut column = p[r].map(|value| value * weight);
            let mut position = x[r] * weight;
            for k in r + 1..N {
                if bit(self.entries[r], k) {
                    let weight = f[k][r];
                    for a in 0..N {
                        column[a] += p[k][a] * weight;
                    }
                    position += x[k] * weight;
                }
            }
            (p[r], x[r]) = (column, position);
        }
        for a in 0..N {
            x[a] += transition.offset().data.0[0][a];
        }
        // Where a changed row meets a changed column, F is applied from the left too.
        let mut crossing = [[0.0; N]; N];
        for r in 0..N {
            for c in r..N {
                if bit(self.rows, r) && bit(self.rows, c) {
                    let mut sum = p[r][c] * f[c][c];
                    for k in c + 1..N {
                        if bit(self.entries[c], k) {
                            sum += p[r][k] * f[k][c];
                        }
                    }
                    crossing[r][c] = sum + q[r][c];
                }
            }
        }
        for c in 0..N {
            for a in 0..N {
                p[c][a] += q[c][a];
            }
        }
        for r in 0..N {
            if !bit(self.rows, r) {
                continue;
            }
            for c in 0..N {
                if !bit(self.rows, c) {
                    p[c][r] = p[r][c];
                } else if c >= r {
                    p[r][c] = crossing[r][c];
                    p[c][r] = crossing[r][c];
                }
            }
        }
    }
}

#[inline]
const fn bit(bits: u64, at: usize) -> bool {
    bits >> at & 1 != 0
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::matrix::sandwich;
    use crate::motion::{ConstantAcceleration, ConstantVelocity, KnownTurn, PhysicalBox, Singer, SortBox};
    use crate::{Gaussian, MotionModel};

    fn agree<const N: usize>(step: Transition<N>, sheared: bool) {
        assert_eq!(step.shear().is_some(), sheared);
        let offset = SVector::from_fn(|r, _| 0.1 * r as f64);
        let step = step.with_offset(offset).unwrap();
        let mix = SMatrix::<f64, N, N>::from_fn(|r, c| (0.3 + 1.7 * r as f64 + 0.9 * (c * c) as f64).sin());
        let mut covariance = mix * mix.transpose() + SMatrix::identity() * 0.05;
        covariance = (covariance + covariance.transpose()) * 0.5;
        let mut belief = Gaussian::new(SVector::from_fn(|r, _| r as f64 - 1.0), covariance).unwrap();
        let mean = step.matrix() * belief.mean() + offset;
        let expected = sandwich(step.matrix(), &covariance) + step.noise();
        belief.predict(&step).unwrap();
        assert!((belief.mean() - mean).abs().max() < 1e-13 * mean.abs().max());
        assert!((belief.covariance() - expected).abs().max() < 1e-13 * expected.abs().max());
        assert_eq!(*belief.covariance(), belief.covariance().transpose());
    }

    #[test]
    fn every_shape_of_transition_agrees_with_the_product() {
        for dt_s in [1e-3, 0.04, 1.0, 30.0] {
            agree(ConstantVelocity::<2>::white(3.0).over(dt_s).unwrap(), true);
            agree(ConstantAcceleration::<2>::white(3.0).over(dt_s).unwrap(), true);
            agree(Singer::<1> { rate_per_s: 0.7, acceleration_variance: 2.0 }.over(dt_s).unwrap(), true);
            agree(
                PhysicalBox { acceleration_density: 5.0, size_density: 1.0, position_density: 0.0 }.over(dt_s).unwrap(),
                true,
            );
            agree(SortBox::sort2016(1.0).unwrap().over(dt_s).unwrap(), true);
            agree(KnownTurn { rate_rad_per_s: 0.4, acceleration_density: 1.0 }.over(dt_s).unwrap(), false);
        }
        // Upper triangular and full, with a diagonal that is not one and a row of zeros.
        let mut full = SMatrix::<f64, 5, 5>::from_fn(|r, c| if c >= r { 0.5 + (r * 5 + c) as f64 } else { 0.0 });
        full.row_mut(3).fill(0.0);
        agree(Transition::new(full, SMatrix::identity()).unwrap(), true);
        agree(Transition::new(full.transpose(), SMatrix::identity()).unwrap(), false);
        agree(Transition::new(SMatrix::<f64, 3, 3>::identity(), SMatrix::zeros()).unwrap(), true);
    }

    #[test]
    fn numbers_that_might_overflow_are_looked_at() {
        let step = ConstantVelocity::<1>::white(1.0).over(1.0).unwrap();
        let shear = step.shear().unwrap();
        let at = |position: f64, variance: f64| {
            shear.is_safe(&SVector::from([position, 0.0]), &(SMatrix::<f64, 2, 2>::identity() * variance))
        };
        assert!(at(1e9, 1e12));
        assert!(!at(1e301, 1.0));
        assert!(!at(0.0, 1e301));
        assert!(!at(f64::NAN, 1.0));
    }
}
