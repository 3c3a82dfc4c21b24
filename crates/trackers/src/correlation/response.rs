use pursuit_vision::fourier::{
    average_peak_to_correlation_energy, highest, parabola_peak, peak_to_sidelobe_ratio, signed_shift,
};
use serde::{Deserialize, Serialize};

/// What a response plane says: where its peak is and how clearly it stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponsePeak {
    /// Displacement in cells along x, between minus and plus half the plane, with a fraction.
    pub dx: f64,
    /// Displacement in cells along y.
    pub dy: f64,
    /// Largest value.
    pub value: f64,
}

/// How clearly a response's peak stands out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PeakQuality {
    /// Largest value.
    pub peak: f64,
    /// Peak-to-sidelobe ratio (bolme2010, section 3.5).
    pub psr: f64,
    /// Average peak-to-correlation energy (wang2017, eq. 9).
    pub apce: f64,
}

/// Half the side of the square around the peak that does not count as sidelobe, as a share of the plane's shorter side
/// (bolme2010, section 3.5: 11 of 64 pixels).
const PEAK_SHARE: f64 = 5.5 / 64.0;

impl ResponsePeak {
    /// Reads a response with rows of `width` whose first entry means no displacement. `None` where there is no finite value.
    pub fn of(response: &[f32], width: usize) -> Option<Self> {
        let (x, y, value) = highest(response, width);
        if !value.is_finite() {
            return None;
        }
        let fine = parabola_peak(response, width, x, y);
        let height = response.len() / width.max(1);
        let shift = |cell: usize, fine: f64, n: usize| signed_shift(cell, n) as f64 + fine - cell as f64;
        Some(Self { dx: shift(x, fine.x, width), dy: shift(y, fine.y, height), value: f64::from(value) })
    }
}

impl PeakQuality {
    /// Measures a response with rows of `width`.
    pub fn of(response: &[f32], width: usize) -> Self {
        let shorter = width.min(response.len() / width.max(1));
        Self {
            peak: f64::from(highest(response, width).2),
            psr: peak_to_sidelobe_ratio(response, width, (PEAK_SHARE * shorter as f64).ceil() as usize),
            apce: average_peak_to_correlation_energy(response),
        }
    }
}
