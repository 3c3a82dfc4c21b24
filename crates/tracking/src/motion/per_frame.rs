//! The filters of boxes that association by overlap is published with: velocities per frame, noise added at every frame.

use super::{MotionFilter, SMALLEST_SIDE_PX, Sight};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use nalgebra::{Matrix4, SMatrix, SVector, Vector4};
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, Result, Transition};
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

pursuit_parameters::choices! {
    /// By which four numbers a box is described.
    pub enum BoxState {
        /// Left, top, right, bottom, each with a velocity; noise in pixels.
        Corners = "corners",
        /// Centre, area and aspect ratio; the ratio stays (bewley2016, section 3.2).
        Area = "area",
        /// Centre, width and height; noise in parts of width and height (aharon2022, section 3.1).
        Size = "size",
    }
}

pursuit_parameters::parameters! {
    /// A Kalman filter of a box with constant velocities, whose noise is given per frame. The first step is one frame; longer ones are as many frames as it
    /// goes into them.
    pub struct PerFrameParams {
        /// What describes the box.
        pub state: BoxState = BoxState::Size, source "aharon2022, section 3.1";
        /// Of `corners`: variance that each coordinate and each velocity gains in a frame.
        pub corner_process: f64 = 0.01, in above(0.0), unit "px²", source "bewley2016: .01 of velocities";
        /// Of `corners`: variance of each measured coordinate.
        pub corner_measurement: f64 = 0.1, in above(0.0), unit "px²", source "ours";
        /// Of `corners`: variance of each coordinate and velocity at the start.
        pub corner_start: f64 = 1.0, in above(0.0), unit "px²", source "ours";
        /// Of `area`: variance that the centre's velocity gains in a frame; that of the area gains a hundredth of it.
        pub velocity_process: f64 = 0.01, in above(0.0), unit "px²", source "bewley2016, its program";
        /// Of `area`: variance of the measured area and ratio; that of the centre is 1.
        pub shape_measurement: f64 = 10.0, in above(0.0), source "bewley2016, its program";
        /// Of `area`: variance of velocities at the start; that of everything else is a thousandth of it.
        pub start_velocity: f64 = 1e4, in above(0.0), source "bewley2016, its program";
        /// Of `size`: σ_p, what centre and size gain in a frame.
        pub position_weight: f64 = 0.05, in above(0.0), unit "sides", source "aharon2022, equations 3 and 4";
        /// Of `size`: σ_v, what velocities gain in a frame.
        pub velocity_weight: f64 = 0.00625, in above(0.0), unit "sides", source "aharon2022, equation 3";
        /// Of `size`: σ_m, how well centre and size are measured.
        pub measurement_weight: f64 = 0.05, in above(0.0), unit "sides", source "aharon2022, equation 4";
    }
}

/// A filter of four numbers and their velocities per frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PerFrameBox {
    params: PerFrameParams,
    belief: Gaussian<8>,
    /// How long a frame takes, in seconds: as long as the first step.
    frame_s: Option<f64>,
}

impl PerFrameBox {
    /// At rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite.
    pub fn new(params: PerFrameParams, bbox: BBox) -> Result<Self> {
        let belief = start(&params, &bbox)?;
        Ok(Self { params, belief, frame_s: None })
    }

    /// The transition over so many frames; the ratio of `area` has no velocity.
    fn transition(&self, frames: f64) -> Result<Transition<8>> {
        let mut matrix = SMatrix::<f64, 8, 8>::identity();
        for i in 0..self.moving() {
            matrix[(i, i + 4)] = frames;
        }
        let noise = process(&self.params, &self.sides()) * frames;
        Transition::new(matrix, SMatrix::from_diagonal(&noise))
    }

    /// How many of the four numbers have velocities.
    const fn moving(&self) -> usize {
        match self.params.state {
            BoxState::Corners | BoxState::Size => 4,
            BoxState::Area => 3,
        }
    }

    fn sides(&self) -> [f64; 2] {
        let bbox = self.bbox();
        [bbox.width(), bbox.height()]
    }

    fn sensor(&self) -> Result<LinearMeasurement<4, 8>> {
        let [w, h] = self.sides();
        let p = &self.params;
        let variances = match p.state {
            BoxState::Corners => [p.corner_measurement; 4],
            BoxState::Area => [1.0, 1.0, p.shape_measurement, p.shape_measurement],
            BoxState::Size => [w, h, w, h].map(|side| (p.measurement_weight * side).powi(2)),
        };
        LinearMeasurement::select([0, 1, 2, 3], variances)
    }

    /// The covariance of centre, width and height that belongs to one of the four numbers.
    fn in_picture(&self, covariance: &Matrix4<f64>) -> BoxCovariance {
        let slope = slope(self.params.state, &self.sides());
        slope * covariance * slope.transpose()
    }

    fn numbers(&self) -> Vector4<f64> {
        self.belief.mean().fixed_rows::<4>(0).into_owned()
    }

    fn measured_covariance(&self) -> Matrix4<f64> {
        self.belief.covariance().fixed_view::<4, 4>(0, 0).into_owned()
    }
}

/// The four numbers of a box.
fn described(state: BoxState, bbox: &BBox) -> Vector4<f64> {
    let (center, w, h) = (bbox.center(), bbox.width().max(SMALLEST_SIDE_PX), bbox.height().max(SMALLEST_SIDE_PX));
    match state {
        BoxState::Corners => Vector4::new(bbox.left(), bbox.top(), bbox.right(), bbox.bottom()),
        BoxState::Area => Vector4::new(center.x, center.y, w * h, w / h),
        BoxState::Size => Vector4::new(center.x, center.y, w, h),
    }
}

/// The box of four numbers; no side is shorter than a pixel.
fn box_of(state: BoxState, n: &Vector4<f64>) -> BBox {
    let (center, w, h) = match state {
        BoxState::Corners => (Point::new((n[0] + n[2]) / 2.0, (n[1] + n[3]) / 2.0), n[2] - n[0], n[3] - n[1]),
        BoxState::Area => {
            let (area, ratio) = (n[2].max(1.0), n[3].max(1e-6));
            (Point::new(n[0], n[1]), (area * ratio).sqrt(), (area / ratio).sqrt())
        }
        BoxState::Size => (Point::new(n[0], n[1]), n[2], n[3]),
    };
    BBox::from_center_size(center, w.max(SMALLEST_SIDE_PX), h.max(SMALLEST_SIDE_PX))
}

/// How centre, width and height change with the four numbers.
fn slope(state: BoxState, [w, h]: &[f64; 2]) -> Matrix4<f64> {
    match state {
        BoxState::Corners => Matrix4::new(
            0.5, 0.0, 0.5, 0.0, //
            0.0, 0.5, 0.0, 0.5, //
            -1.0, 0.0, 1.0, 0.0, //
            0.0, -1.0, 0.0, 1.0,
        ),
        BoxState::Area => {
            let (area, ratio) = (w * h, w / h);
            let mut slope = Matrix4::identity();
            (slope[(2, 2)], slope[(2, 3)]) = (w / (2.0 * area), w / (2.0 * ratio));
            (slope[(3, 2)], slope[(3, 3)]) = (h / (2.0 * area), -h / (2.0 * ratio));
            slope
        }
        BoxState::Size => Matrix4::identity(),
    }
}

/// What the variances gain in a frame.
fn process(p: &PerFrameParams, [w, h]: &[f64; 2]) -> SVector<f64, 8> {
    let numbers = match p.state {
        BoxState::Corners => [p.corner_process; 8],
        BoxState::Area => {
            let velocity = p.velocity_process;
            [1.0, 1.0, 1.0, 1.0, velocity, velocity, 0.01 * velocity, 0.0]
        }
        BoxState::Size => scaled(w, h, p.position_weight, p.velocity_weight),
    };
    SVector::from(numbers)
}

/// Variances of which standard deviations are parts of the sides.
fn scaled(w: &f64, h: &f64, position: f64, velocity: f64) -> [f64; 8] {
    let square = |weight: f64, side: &f64| (weight * side).powi(2);
    let of = |weight: f64| [square(weight, w), square(weight, h), square(weight, w), square(weight, h)];
    let ([a, b, c, d], [e, f, g, i]) = (of(position), of(velocity));
    [a, b, c, d, e, f, g, i]
}

/// At rest at `bbox`.
fn start(p: &PerFrameParams, bbox: &BBox) -> Result<Gaussian<8>> {
    if !bbox.is_finite() {
        return Err(EstimationError::NotFinite { what: "the box" });
    }
    let n = described(p.state, bbox);
    let variances = match p.state {
        BoxState::Corners => [p.corner_start; 8],
        BoxState::Area => {
            let (rest, velocity) = (p.start_velocity / 1e3, p.start_velocity);
            [rest, rest, rest, rest, velocity, velocity, velocity, velocity]
        }
        // Twice and ten times the weights, as the paper's program starts.
        BoxState::Size => {
            let sides = (bbox.width().max(SMALLEST_SIDE_PX), bbox.height().max(SMALLEST_SIDE_PX));
            scaled(&sides.0, &sides.1, 2.0 * p.position_weight, 10.0 * p.velocity_weight)
        }
    };
    let mean = SVector::from([n[0], n[1], n[2], n[3], 0.0, 0.0, 0.0, 0.0]);
    Gaussian::from_variances(mean, SVector::from(variances))
}

impl MotionFilter for PerFrameBox {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let frame_s = self.frame_s.unwrap_or(dt_s);
        let frames = if frame_s > 0.0 { dt_s / frame_s } else { 1.0 };
        let mut before = self.belief;
        if self.params.state == BoxState::Area && before.mean()[2] + frames * before.mean()[6] <= 0.0 {
            // An area that would vanish stays.
            let mut mean = *before.mean();
            mean[6] = 0.0;
            before = Gaussian::new(mean, *before.covariance())?;
        }
        self.belief = before.predicted(&self.transition(frames)?)?;
        self.frame_s = Some(frame_s);
        let innovation = self.measured_covariance() + self.sensor()?.noise();
        Ok(Prior { bbox: self.bbox(), innovation_covariance: Some(self.in_picture(&innovation)), dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let sensor = self.sensor()?;
        let mut corrected = self.belief;
        corrected.update(&sensor, &described(self.params.state, &sight.bbox))?;
        self.belief = corrected;
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        if let Ok(belief) = start(&self.params, &bbox) {
            (self.belief, self.frame_s) = (belief, None);
        }
    }

    fn bbox(&self) -> BBox {
        box_of(self.params.state, &self.numbers())
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        Some(self.in_picture(&self.measured_covariance()))
    }

    fn velocity(&self) -> Option<Velocity> {
        let (v, frame_s) = (self.belief.mean(), self.frame_s.filter(|s| *s > 0.0)?);
        let (x, y) = match self.params.state {
            BoxState::Corners => ((v[4] + v[6]) / 2.0, (v[5] + v[7]) / 2.0),
            BoxState::Area | BoxState::Size => (v[4], v[5]),
        };
        Some(Velocity { x: x / frame_s, y: y / frame_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filter(state: BoxState) -> PerFrameBox {
        let params = PerFrameParams { state, ..PerFrameParams::default() };
        PerFrameBox::new(params, BBox::from_ltwh(100.0, 50.0, 20.0, 40.0)).unwrap()
    }

    #[test]
    fn a_box_is_what_describes_it() {
        let bbox = BBox::from_ltwh(3.0, 4.0, 20.0, 40.0);
        for state in BoxState::ALL {
            let back = box_of(*state, &described(*state, &bbox));
            assert!(back.iou(&bbox) > 1.0 - 1e-12, "{state:?}: {back:?}");
        }
    }

    #[test]
    fn slopes_are_those_of_small_steps() {
        let (bbox, step) = (BBox::from_ltwh(3.0, 4.0, 20.0, 40.0), 1e-5);
        let [x, y, w, h] = [bbox.center().x, bbox.center().y, 20.0, 40.0];
        for state in BoxState::ALL {
            let slope = slope(*state, &[w, h]);
            for column in 0..4 {
                let mut numbers = described(*state, &bbox);
                numbers[column] += step;
                let moved = box_of(*state, &numbers);
                let got = [moved.center().x - x, moved.center().y - y, moved.width() - w, moved.height() - h];
                for (row, got) in got.into_iter().enumerate() {
                    assert!((got / step - slope[(row, column)]).abs() < 1e-3, "{state:?} {row} {column}");
                }
            }
        }
    }

    #[test]
    fn steady_motion_is_predicted_at_any_rate() {
        for state in BoxState::ALL {
            for dt_s in [0.02, 0.1] {
                let mut filter = filter(*state);
                for k in 1..40 {
                    filter.predict(dt_s).unwrap();
                    let seen = BBox::from_ltwh(100.0 + 3.0 * f64::from(k), 50.0, 20.0, 40.0);
                    filter.correct(&Sight::of(seen, None)).unwrap();
                }
                let velocity = filter.velocity().unwrap();
                assert!((velocity.x * dt_s - 3.0).abs() < 0.3 && velocity.y.abs() < 1e-6, "{state:?}: {velocity:?}");
                // Two frames at once are two frames.
                let mut twice = filter.clone();
                twice.predict(2.0 * dt_s).unwrap();
                for _ in 0..2 {
                    filter.predict(dt_s).unwrap();
                }
                assert!(twice.bbox().center().distance(filter.bbox().center()) < 1e-9, "{state:?}");
            }
        }
    }

    #[test]
    fn an_area_never_vanishes() {
        let mut filter = filter(BoxState::Area);
        for k in 0..60 {
            filter.predict(0.1).unwrap();
            let side = (40.0 - 4.0 * f64::from(k)).max(1.0);
            if k < 9 {
                filter.correct(&Sight::of(BBox::from_ltwh(100.0, 50.0, side / 2.0, side), None)).unwrap();
            }
            assert!(filter.bbox().is_finite() && filter.bbox().width() >= SMALLEST_SIDE_PX);
        }
    }
}
