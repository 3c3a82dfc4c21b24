//! Motion of boxes: a centre that moves and a size that changes slowly.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::{require, require_time_step};
use crate::matrix::is_finite;
use crate::{EstimationError, LinearMeasurement, MotionModel, Result, Transition};

use super::ConstantVelocity;
use super::apart::Moving;

/// Indices of `[x, y, w, h]` in the state `[x, y, vx, vy, w, h]`.
const MEASURED: [usize; 4] = [0, 1, 4, 5];

/// The box filter of `ball` (equations (1) to (5)): state `[x, y, vx, vy, w, h]` with velocities in px/s, and process
/// noise per **step**, whatever the step's length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepBox {
    /// Diagonal of `Q`, added at every step: px², px², (px/s)², (px/s)², px², px². ≥ 0.
    pub variances: [f64; 6],
    /// `R = r I₄`: variance of each of the measured `x, y, w, h`, px². ≥ 0.
    pub measurement_variance_px2: f64,
}

impl StepBox {
    /// The values of `ball`: `Q = diag(.01, .01, 5, 5, .01, .01)`, `R = .1 I₄`.
    pub const fn ball() -> Self {
        Self { variances: [0.01, 0.01, 5.0, 5.0, 0.01, 0.01], measurement_variance_px2: 0.1 }
    }

    /// The sensor of `[x, y, w, h]`.
    ///
    /// # Errors
    /// Where the variance is negative or not finite.
    pub fn measurement(&self) -> Result<LinearMeasurement<4, 6>> {
        LinearMeasurement::select(MEASURED, [self.measurement_variance_px2; 4])
    }
}

impl MotionModel<6> for StepBox {
    #[inline]
    fn over(&self, dt_s: f64) -> Result<Transition<6>> {
        require_time_step(dt_s)?;
        for variance in self.variances {
            require("a process noise variance", variance, variance >= 0.0, "zero or more")?;
        }
        Ok(Transition::moving_centre(dt_s, SMatrix::from_diagonal(&SVector::from(self.variances))))
    }
}

/// A box in physical units: white-noise acceleration moves the centre and a random walk changes the size, both
/// integrated exactly over any step. State `[x, y, vx, vy, w, h]`, measured `[x, y, w, h]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PhysicalBox {
    /// Power spectral density of the centre's acceleration, px²/s³. ≥ 0.
    pub acceleration_density: f64,
    /// Growth of the variance of width and height, px²/s. ≥ 0.
    pub size_density: f64,
    /// Growth of the variance of the centre beside what its velocity brings about, px²/s: a centre that wanders about its path. ≥ 0.
    pub position_density: f64,
}

impl PhysicalBox {
    /// The sensor of `[x, y, w, h]` with the variances given, px².
    ///
    /// # Errors
    /// Where a variance is negative or not finite.
    pub fn measurement(position_variance_px2: f64, size_variance_px2: f64) -> Result<LinearMeasurement<4, 6>> {
        let (p, s) = (position_variance_px2, size_variance_px2);
        LinearMeasurement::select(MEASURED, [p, p, s, s])
    }

    /// What a step adds to each axis of the centre, and to the variance of each side.
    #[inline]
    pub(super) fn added(&self, dt_s: f64) -> Result<(Moving, f64)> {
        let (_, centre) = ConstantVelocity::<2>::white(self.acceleration_density).axis(dt_s)?;
        let Self { size_density, position_density, .. } = *self;
        if !(size_density >= 0.0 && position_density >= 0.0) {
            require("size_density", size_density, size_density >= 0.0, "zero or more")?;
            require("position_density", position_density, position_density >= 0.0, "zero or more")?;
        }
        let (size, wander) = (self.size_density * dt_s, self.position_density * dt_s);
        // The six numbers of the noise are looked at here, not the 36 of the matrix.
        if !(is_finite(&centre) && size.is_finite() && wander.is_finite()) {
            return Err(EstimationError::Overflow { what: "the transition of a motion model" });
        }
        Ok((Moving { place: centre[(0, 0)] + wander, both: centre[(0, 1)], speed: centre[(1, 1)] }, size))
    }
}

impl MotionModel<6> for PhysicalBox {
    #[inline]
    fn over(&self, dt_s: f64) -> Result<Transition<6>> {
        let (centre, size) = self.added(dt_s)?;
        let mut noise = SMatrix::<f64, 6, 6>::zeros();
        for axis in 0..2 {
            noise[(axis, axis)] = centre.place;
            noise[(axis, axis + 2)] = centre.both;
            noise[(axis + 2, axis)] = centre.both;
            noise[(axis + 2, axis + 2)] = centre.speed;
            noise[(axis + 4, axis + 4)] = size;
        }
        Ok(Transition::moving_centre(dt_s, noise))
    }
}

/// The box of SORT (Bewley et al., ICIP 2016): state `[cx, cy, s, r, vcx, vcy, vs]` with area `s` in px² and aspect
/// ratio `r = w / h` constant; measured `[cx, cy, s, r]`. Velocities are per second.
///
/// The noise is per second too, so that the published per-frame filter is the value at `dt_s` = one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SortBox {
    /// Growth of the variance of `[cx, cy, s, r, vcx, vcy, vs]` per second. ≥ 0.
    pub variance_rates: [f64; 7],
    /// Measurement variance of `[cx, cy, s, r]`. ≥ 0.
    pub measurement_variances: [f64; 4],
}

impl SortBox {
    /// The values of the published tracker, `Q = diag(1, 1, 1, 1, .01, .01, .0001)` and `R = diag(1, 1, 10, 10)` with
    /// velocities per **frame**, converted to velocities per second for frames of `frame_s` seconds.
    ///
    /// # Errors
    /// Where `frame_s` is not positive and finite.
    pub fn sort2016(frame_s: f64) -> Result<Self> {
        require_time_step(frame_s)?;
        let per_frame = [1.0, 1.0, 1.0, 1.0, 0.01, 0.01, 0.0001];
        let variance_rates = std::array::from_fn(|i| {
            // A velocity per frame is `frame_s` velocities per second, so its variance is divided by frame_s² more.
            let scale = if i < 4 { 1.0 } else { frame_s * frame_s };
            per_frame[i] / (scale * frame_s)
        });
        Ok(Self { variance_rates, measurement_variances: [1.0, 1.0, 10.0, 10.0] })
    }

    /// The sensor of `[cx, cy, s, r]`.
    ///
    /// # Errors
    /// Where a variance is negative or not finite.
    pub fn measurement(&self) -> Result<LinearMeasurement<4, 7>> {
        LinearMeasurement::select([0, 1, 2, 3], self.measurement_variances)
    }
}

impl MotionModel<7> for SortBox {
    fn over(&self, dt_s: f64) -> Result<Transition<7>> {
        require_time_step(dt_s)?;
        let mut matrix = SMatrix::<f64, 7, 7>::identity();
        for i in 0..3 {
            matrix[(i, i + 4)] = dt_s;
        }
        let mut noise = SMatrix::<f64, 7, 7>::zeros();
        for (i, rate) in self.variance_rates.into_iter().enumerate() {
            require("a variance rate", rate, rate >= 0.0, "zero or more")?;
            noise[(i, i)] = rate * dt_s;
        }
        Transition::computed(matrix, noise)
    }
}
