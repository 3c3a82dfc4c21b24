//! How far a target has come: the lengths from each place to the next, summed.
//!
//! The errors of the smoother's states belong together: `Cov(x_j, x_k) = C_j … C_{k−1} P_k` for `j < k`, with the smoother's own
//! `C_k`. With the slopes `g_j` of the length by each place, `w_{k+1} = C_kᵀ (w_k + g_k)` gathers what all earlier places
//! contribute, and the variance of the whole takes one pass.

use super::State;
use crate::Ruler;
use nalgebra::{SMatrix, SVector, Vector2};

/// Lengths of states whose errors are taken for independent.
pub(super) fn lengths(states: &[Option<State>], ruler: &Ruler) -> Vec<Option<(f64, f64)>> {
    let mut walk = Walk::<6>::new(ruler);
    states.iter().map(|state| state.as_ref().map(|s| walk.on(s.position().into(), *s.covariance(), None))).collect()
}

/// A path, place by place.
pub(super) struct Walk<'a, const N: usize> {
    ruler: &'a Ruler,
    length: f64,
    /// Variance of the length but for what the last place contributes as an end.
    variance: f64,
    /// What the earlier places contribute, brought to the last state.
    earlier: SVector<f64, N>,
    last: Option<Last<N>>,
    /// Direction of the last piece.
    direction: Vector2<f64>,
    /// Length and last place by the ruler with one of its errors turned up.
    further: Vec<(f64, [f64; 2])>,
}

/// The last place with its covariance, and the matrix by which the next belongs to it.
struct Last<const N: usize> {
    at: Vector2<f64>,
    covariance: SMatrix<f64, N, N>,
    gain: Option<SMatrix<f64, N, N>>,
}

/// `2 wᵀ P g + gᵀ P g`, with a `g` that only the place has.
fn contribution<const N: usize>(earlier: &SVector<f64, N>, covariance: &SMatrix<f64, N, N>, g: Vector2<f64>) -> f64 {
    let moved = covariance.fixed_columns::<2>(0) * g;
    2.0 * earlier.dot(&moved) + g.x * moved[0] + g.y * moved[1]
}

impl<'a, const N: usize> Walk<'a, N> {
    pub fn new(ruler: &'a Ruler) -> Self {
        Self {
            ruler,
            length: 0.0,
            variance: 0.0,
            earlier: SVector::zeros(),
            last: None,
            direction: Vector2::zeros(),
            further: vec![(0.0, [0.0; 2]); ruler.error_count()],
        }
    }

    /// Goes on to a place, and says how long the path is and the standard deviation of that. `gain` is the smoother's `C` of the
    /// step that follows; without one errors are independent.
    pub fn on(
        &mut self,
        at: Vector2<f64>,
        covariance: SMatrix<f64, N, N>,
        gain: Option<SMatrix<f64, N, N>>,
    ) -> (f64, f64) {
        let first = self.last.is_none();
        if let Some(last) = self.last.take() {
            let piece = at - last.at;
            let length = piece.norm();
            let direction = if length > 0.0 { piece / length } else { self.direction };
            // The last place was an end and is one no more: the length changes with it by both pieces.
            let g = self.direction - direction;
            self.variance += contribution(&self.earlier, &last.covariance, g);
            (self.earlier[0], self.earlier[1]) = (self.earlier[0] + g.x, self.earlier[1] + g.y);
            self.earlier = last.gain.map_or_else(SVector::zeros, |c| c.transpose() * self.earlier);
            self.length += length;
            self.direction = direction;
        }
        let variance = self.variance + contribution(&self.earlier, &covariance, self.direction);
        let mut of_ruler = 0.0;
        for (i, (length, last)) in self.further.iter_mut().enumerate() {
            let Some(place) = self.ruler.place_with_error(i, [at.x, at.y]) else { continue };
            if !first {
                *length += (place[0] - last[0]).hypot(place[1] - last[1]);
            }
            *last = place;
            of_ruler += (*length - self.length).powi(2);
        }
        self.last = Some(Last { at, covariance, gain });
        (self.length, (variance.max(0.0) + of_ruler).sqrt())
    }
}
