use super::params::PeakParams;
use super::score::Evidence;
use pursuit_geometry::Point;
use pursuit_vision::fourier::highest;
#[cfg(test)]
use pursuit_vision::fourier::{parabola_peak, signed_shift};

/// The peak of the response in which a look saw the target.
#[derive(Debug, Clone, Copy)]
pub struct ResponsePeak {
    /// Where, in pixels: exact, where a box rounds its centre.
    pub center: Point,
    /// How many times larger than at the start the target was taken to be.
    pub scale: f64,
    /// Height of the response's peak, by which sizes are compared.
    pub height: f64,
    /// Average peak-to-correlation energy of the response (wang2017, eq. 9).
    pub apce: f64,
    /// What speaks for it.
    pub evidence: Evidence,
    /// ln of p / (1 − p) of the probability p that the box is right.
    pub log_odds: f64,
}

/// Finds the peaks of a response plane that stand apart.
#[derive(Debug, Clone, Default)]
pub struct Peaks {
    rest: Vec<f32>,
}

impl Peaks {
    /// The highest peaks of the plane (rows of `width`, wrapping around), highest first: column, row and value. As many as
    /// `params` ask for, less those lower than the share of the highest that they name.
    pub fn find(
        &mut self,
        plane: &[f32],
        width: usize,
        params: &PeakParams,
    ) -> impl Iterator<Item = (usize, usize, f32)> {
        let (apart, share) = (params.apart, params.runner_up);
        self.rest.clear();
        self.rest.extend_from_slice(plane);
        let height = plane.len() / width.max(1);
        let mut least = f32::NEG_INFINITY;
        let rest = &mut self.rest;
        std::iter::from_fn(move || {
            let (x, y, value) = highest(rest, width);
            if !value.is_finite() || value < least {
                return None;
            }
            least = least.max(share as f32 * value);
            for dy in 0..=2 * apart {
                let row = (y + height + dy - apart.min(height)) % height * width;
                for dx in 0..=2 * apart {
                    if let Some(v) = rest.get_mut(row + (x + width + dx - apart.min(width)) % width) {
                        *v = f32::NEG_INFINITY;
                    }
                }
            }
            Some((x, y, value))
        })
        .take(params.candidates)
    }
}

/// Displacement in cells, with a fraction, of the peak of a response with rows of `width` whose first entry means none.
#[cfg(test)]
pub(super) fn displacement(response: &[f32], width: usize) -> Option<(f64, f64)> {
    let (x, y, value) = highest(response, width);
    let fine = parabola_peak(response, width, x, y);
    let shift = |cell: usize, fine: f64, n: usize| signed_shift(cell, n) as f64 + fine - cell as f64;
    let height = response.len() / width.max(1);
    value.is_finite().then(|| (shift(x, fine.x, width), shift(y, fine.y, height)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_come_highest_first_and_apart() {
        let mut plane = vec![0.0f32; 16 * 12];
        let mut set = |x: usize, y: usize, v: f32| plane[y * 16 + x] = v;
        set(15, 0, 1.0);
        set(1, 11, 0.9); // Beside the first one, around the corner.
        set(8, 6, 0.7);
        set(8, 2, 0.4);
        let params = |candidates| PeakParams { candidates, ..PeakParams::default() };
        let found: Vec<_> = Peaks::default().find(&plane, 16, &params(5)).collect();
        assert_eq!(found, [(15, 0, 1.0), (8, 6, 0.7)]);
        assert_eq!(Peaks::default().find(&plane, 16, &params(1)).count(), 1);
        assert_eq!(Peaks::default().find(&[f32::NAN; 16], 4, &params(3)).count(), 0);
        assert_eq!(Peaks::default().find(&[2.0; 4], 2, &params(3)).count(), 1);
    }
}
