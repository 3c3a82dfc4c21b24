mod belief;

use super::{MotionFilter, MotionParams, SMALLEST_SIDE_PX, Sight, box_covariance, extent_px, measured};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use belief::{BoxBelief, Mover};
use nalgebra::SVector;
use pursuit_estimation::motion::{ApartBox, PhysicalBox, StepBox};
use pursuit_estimation::{Gaussian, Result};
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// Where the size stands in the state `[x, y, vx, vy, w, h]`.
const SIZE: usize = 4;
/// Where the velocity stands in it.
const VELOCITY: std::ops::Range<usize> = 2..4;

/// How well a localizer measures: standard deviations, relative to the box, with a floor in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeasurementNoise {
    /// Standard deviation of the centre as a fraction of the box's extent, used unless the measurement says its own; ≥ 0.
    pub position: f64,
    /// Standard deviation of width and height as a fraction of the extent; ≥ 0.
    pub size: f64,
    /// Added to both in quadrature: pixels are not finer than this; > 0.
    pub floor_px: f64,
}

impl MeasurementNoise {
    /// Variances of centre and size, in square pixels, for a box of extent `extent_px`.
    pub(super) fn variances(&self, extent_px: f64, sigma_px: Option<f64>) -> (f64, f64) {
        let floor = self.floor_px * self.floor_px;
        let position = sigma_px.filter(|s| s.is_finite()).unwrap_or(self.position * extent_px);
        let size = self.size * extent_px;
        (position * position + floor, size * size + floor)
    }
}

/// Noise relative to the size of the box, in continuous time: the same settings suit a distant and a near target, and any
/// frame rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RelativeNoise {
    /// Spectral density of the centre's white acceleration, in extents²/s³; ≥ 0.
    pub acceleration: f64,
    /// Growth of the standard deviation of the centre beside what its velocity brings about, in extents per √s; ≥ 0.
    pub wander: f64,
    /// The acceleration of a target that manoeuvres; `None`: that of others.
    pub agile: Option<Agile>,
    /// Growth of the standard deviation of the size, in extents per √s; ≥ 0.
    pub size_change: f64,
    /// Standard deviation of the velocity at the start, in extents/s; > 0.
    pub start_speed: f64,
    /// What a measurement is worth.
    pub measurement: MeasurementNoise,
}

impl RelativeNoise {
    /// The motion of a box that is so long, with this acceleration.
    fn moving(&self, extent_px: f64, acceleration: f64) -> PhysicalBox {
        PhysicalBox {
            acceleration_density: acceleration * extent_px * extent_px,
            size_density: (self.size_change * extent_px).powi(2),
            position_density: (self.wander * extent_px).powi(2),
        }
    }
}

impl From<&MotionParams> for MeasurementNoise {
    fn from(p: &MotionParams) -> Self {
        Self { position: p.position_noise, size: p.size_noise, floor_px: p.noise_floor_px }
    }
}

impl From<&MotionParams> for RelativeNoise {
    fn from(p: &MotionParams) -> Self {
        Self {
            acceleration: p.acceleration,
            wander: p.wander,
            agile: (p.agile > 0.0).then_some(Agile { acceleration: p.agile, surprise: p.agile_from }),
            size_change: p.size_change,
            start_speed: p.start_speed,
            measurement: p.into(),
        }
    }
}

/// Adjustable process noise (Bar-Shalom, Li and Kirubarajan 2001, section 11.2.2): what surprises is explained by a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Agile {
    /// Spectral density of the centre's white acceleration in a manoeuvre, in extents²/s³; > 0.
    pub acceleration: f64,
    /// A measured centre whose squared Mahalanobis distance exceeds this is of a manoeuvre; > 0.
    pub surprise: f64,
}

/// Where the noise of a [`BoxFilter`] comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum BoxNoise {
    /// Fixed variances in pixels, added at every step whatever its length, as `ball` prints them.
    PerStep(StepBox),
    /// Scaled to the box and to the time that passed.
    Relative(RelativeNoise),
}

/// A Kalman filter of `[x, y, vx, vy, w, h]`: the centre moves with constant velocity, the size stays (ball, equations
/// (1) to (5)).
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct BoxFilter {
    noise: BoxNoise,
    belief: BoxBelief,
    /// What was believed before the last step, and how long that was, where a step may be taken again.
    before: Option<(BoxBelief, f64)>,
}

impl Clone for BoxFilter {
    fn clone(&self) -> Self {
        Self { noise: self.noise, belief: self.belief.clone(), before: self.before.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.noise = source.noise;
        self.belief.clone_from(&source.belief);
        match (&mut self.before, &source.before) {
            (Some((own, step_s)), Some((other, other_s))) => {
                own.clone_from(other);
                *step_s = *other_s;
            }
            (own, other) => *own = other.clone(),
        }
    }
}

impl BoxFilter {
    /// A filter at rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite or a noise is out of range.
    pub fn new(noise: BoxNoise, bbox: BBox) -> Result<Self> {
        Ok(Self { noise, belief: start(&noise, bbox)?, before: None })
    }

    /// The whole belief about `[x, y, vx, vy, w, h]`.
    pub fn belief(&self) -> Gaussian<6> {
        self.belief.whole()
    }

    /// What moves a box that is so long.
    fn mover(&self, extent_px: f64) -> Mover {
        match &self.noise {
            BoxNoise::PerStep(model) => Mover::PerStep(*model),
            BoxNoise::Relative(noise) => Mover::Physical(noise.moving(extent_px, noise.acceleration)),
        }
    }

    /// How agile it may be.
    const fn agile(&self) -> Option<(&RelativeNoise, Agile)> {
        match &self.noise {
            BoxNoise::Relative(noise) => match noise.agile {
                Some(agile) => Some((noise, agile)),
                None => None,
            },
            BoxNoise::PerStep(_) => None,
        }
    }

    /// The step before taken again as a manoeuvre, where what is seen surprises.
    fn manoeuvred(&self, variance: f64, seen: &SVector<f64, 4>) -> Result<Option<BoxBelief>> {
        let (Some((noise, agile)), Some((before, dt_s))) = (self.agile(), &self.before) else { return Ok(None) };
        let calm = self.belief.distance2(variance, seen).is_none_or(|distance2| distance2 <= agile.surprise);
        if calm {
            return Ok(None);
        }
        let mut quick = before.clone();
        let extent = extent_px(&boxed(before.mean()));
        quick.predict(&Mover::Physical(noise.moving(extent, agile.acceleration)), *dt_s)?;
        Ok(Some(quick))
    }

    /// Variances of a measured centre and size of a box that is so long, in square pixels.
    fn sensor_variances(&self, extent_px: f64, sigma_px: Option<f64>) -> [f64; 2] {
        match &self.noise {
            BoxNoise::PerStep(model) => [model.measurement_variance_px2; 2],
            BoxNoise::Relative(noise) => noise.measurement.variances(extent_px, sigma_px).into(),
        }
    }
}

/// The box of a mean.
fn boxed(&[x, y, _, _, w, h]: &[f64; 6]) -> BBox {
    BBox::from_center_size(Point::new(x, y), w.max(SMALLEST_SIDE_PX), h.max(SMALLEST_SIDE_PX))
}

fn start(noise: &BoxNoise, bbox: BBox) -> Result<BoxBelief> {
    let z = measured(&bbox);
    let mean = [z[0], z[1], 0.0, 0.0, z[2], z[3]];
    let variances = match noise {
        // The source of the printed constants starts with P = I.
        BoxNoise::PerStep(_) => [1.0; 6],
        BoxNoise::Relative(noise) => {
            let extent = extent_px(&bbox);
            let (position, size) = noise.measurement.variances(extent, None);
            let velocity = (noise.start_speed * extent).powi(2);
            [position, position, velocity, velocity, size, size]
        }
    };
    ApartBox::from_variances(mean, variances).map(BoxBelief::Apart)
}

impl MotionFilter for BoxFilter {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        // A step leaves the size as it is.
        let extent = extent_px(&self.bbox());
        let mover = self.mover(extent);
        let adjusts = self.agile().is_some();
        match &mut self.before {
            Some((before, step_s)) if adjusts => {
                before.clone_from(&self.belief);
                *step_s = dt_s;
            }
            before => *before = adjusts.then(|| (self.belief.clone(), dt_s)),
        }
        if let Err(error) = self.belief.predict(&mover, dt_s) {
            self.before = None;
            return Err(error);
        }
        let mut innovation_covariance = self.belief.of_box();
        let [position, size] = self.sensor_variances(extent, None);
        for (i, variance) in [position, position, size, size].into_iter().enumerate() {
            innovation_covariance[(i, i)] += variance;
        }
        Ok(Prior { bbox: self.bbox(), innovation_covariance: Some(innovation_covariance), dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let variances = self.sensor_variances(extent_px(&self.bbox()), sight.sigma_px);
        let seen = measured(&sight.bbox);
        let quick = self.manoeuvred(variances[0], &seen)?;
        if quick.is_none() && sight.velocity_share >= 1.0 {
            return self.belief.update(variances, &seen);
        }
        let mut corrected = quick.unwrap_or_else(|| self.belief.clone());
        corrected.update(variances, &seen)?;
        if sight.velocity_share < 1.0 {
            corrected.partly(&self.belief, 1.0 - sight.velocity_share)?;
        }
        self.belief = corrected;
        Ok(())
    }

    fn correct_shared(&mut self, sights: &[(Sight, f64)]) -> Result<()> {
        let values = sights.iter().map(|(sight, probability)| (measured(&sight.bbox), *probability));
        let missed = (1.0 - values.clone().map(|(_, probability)| probability).sum::<f64>()).max(0.0);
        let [position, size] = self.sensor_variances(extent_px(&self.bbox()), None);
        let mut belief = self.belief.whole();
        belief.update_shared(&PhysicalBox::measurement(position, size)?, missed, values)?;
        self.belief.set(belief);
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        // The noise was accepted when the filter was made, so only a box that is not finite can fail; it changes nothing.
        if let Ok(belief) = start(&self.noise, bbox) {
            (self.belief, self.before) = (belief, None);
        }
    }

    fn bbox(&self) -> BBox {
        boxed(self.belief.mean())
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        Some(self.belief.of_box())
    }

    fn velocity(&self) -> Option<Velocity> {
        let [_, _, x, y, _, _] = *self.belief.mean();
        Some(Velocity { x, y })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, Matrix6, SMatrix, Vector4, Vector6};

    /// The filter as textbooks have it, with the inverse written out.
    struct Textbook {
        noise: RelativeNoise,
        mean: Vector6<f64>,
        covariance: Matrix6<f64>,
    }

    impl Textbook {
        fn extent(&self) -> f64 {
            (self.mean[4] * self.mean[5]).sqrt()
        }

        /// Standard deviations of a measurement's centre and size.
        fn sensor(&self, extent: f64, sigma_px: Option<f64>) -> Matrix4<f64> {
            let noise = self.noise.measurement;
            let position = sigma_px.unwrap_or(extent * noise.position).hypot(noise.floor_px).powi(2);
            let size = (extent * noise.size).hypot(noise.floor_px).powi(2);
            Matrix4::from_diagonal(&Vector4::new(position, position, size, size))
        }

        fn start(noise: RelativeNoise, [x, y, w, h]: [f64; 4]) -> Self {
            let mut filter = Self { noise, mean: Vector6::new(x, y, 0.0, 0.0, w, h), covariance: Matrix6::zeros() };
            let (r, speed) = (filter.sensor(filter.extent(), None), (noise.start_speed * filter.extent()).powi(2));
            filter.covariance =
                Matrix6::from_diagonal(&Vector6::new(r[(0, 0)], r[(0, 0)], speed, speed, r[(2, 2)], r[(2, 2)]));
            filter
        }

        fn predict(&mut self, dt: f64) {
            let extent = self.extent();
            let (mut f, mut q) = (Matrix6::identity(), Matrix6::zeros());
            let density = self.noise.acceleration * extent.powi(2);
            for axis in 0..2 {
                let (at, speed, side) = (axis, 2 + axis, 4 + axis);
                f[(at, speed)] = dt;
                q[(at, at)] = density * dt.powi(3) / 3.0 + (self.noise.wander * extent).powi(2) * dt;
                q[(at, speed)] = density * dt.powi(2) / 2.0;
                q[(speed, at)] = q[(at, speed)];
                q[(speed, speed)] = density * dt;
                q[(side, side)] = (self.noise.size_change * extent).powi(2) * dt;
            }
            self.mean = f * self.mean;
            self.covariance = f * self.covariance * f.transpose() + q;
        }

        fn correct(&mut self, z: [f64; 4], sigma_px: Option<f64>) {
            let mut h = SMatrix::<f64, 4, 6>::zeros();
            [(0, 0), (1, 1), (2, 4), (3, 5)].into_iter().for_each(|at| h[at] = 1.0);
            let s = h * self.covariance * h.transpose() + self.sensor(self.extent(), sigma_px);
            let gain = self.covariance * h.transpose() * s.try_inverse().unwrap();
            self.mean += gain * (Vector4::from(z) - h * self.mean);
            self.covariance = (Matrix6::identity() - gain * h) * self.covariance;
        }
    }

    #[test]
    fn with_noise_relative_to_the_box_it_is_the_filter_of_textbooks() {
        let noise = RelativeNoise {
            acceleration: 3.0,
            wander: 0.2,
            agile: None,
            size_change: 0.3,
            start_speed: 1.7,
            measurement: MeasurementNoise { position: 0.07, size: 0.13, floor_px: 0.6 },
        };
        let boxed = |[x, y, w, h]: [f64; 4]| BBox::from_ltwh(x - w / 2.0, y - h / 2.0, w, h);
        let first = [80.0, 50.0, 24.0, 41.0];
        let (mut twin, mut filter) =
            (Textbook::start(noise, first), BoxFilter::new(BoxNoise::Relative(noise), boxed(first)).unwrap());
        for (k, dt_s) in [0.04, 0.15, 0.04, 0.7].into_iter().enumerate() {
            twin.predict(dt_s);
            let prior = filter.predict(dt_s).unwrap();
            let place = [0, 1, 4, 5];
            let of_box = Matrix4::from_fn(|i, j| twin.covariance[(place[i], place[j])]);
            assert!((filter.covariance().unwrap() - of_box).amax() < 1e-9 * of_box.amax(), "{k}");
            let innovation = of_box + twin.sensor(twin.extent(), None);
            assert!((prior.innovation_covariance.unwrap() - innovation).amax() < 1e-9 * innovation.amax(), "{k}");
            let step = k as f64;
            let seen = [83.0 + 5.0 * step, 49.0 - 2.0 * step, 25.0 + 2.0 * step, 40.0 + step];
            // The localizer says its own error every other time.
            let sigma_px = (k % 2 == 1).then_some(2.5);
            twin.correct(seen, sigma_px);
            filter.correct(&Sight::of(boxed(seen), sigma_px)).unwrap();
            let belief = filter.belief();
            assert!((belief.mean() - twin.mean).amax() < 1e-9 * twin.mean.amax(), "{k}");
            assert!((belief.covariance() - twin.covariance).amax() < 1e-9 * twin.covariance.amax(), "{k}");
        }
        // An error that is no number is as good as none.
        let mut other = filter.clone();
        let seen = boxed([90.0, 44.0, 30.0, 42.0]);
        other.correct(&Sight::of(seen, Some(f64::NAN))).unwrap();
        filter.correct(&Sight::of(seen, None)).unwrap();
        assert_eq!(filter, other);
    }

    #[test]
    fn what_surprises_is_taken_for_a_manoeuvre() {
        let at = |x: f64| BBox::from_ltwh(x, 20.0, 40.0, 30.0);
        let quiet =
            MotionParams { acceleration: 0.1, start_speed: 1.0, position_noise: 0.03, ..MotionParams::default() };
        let agile = MotionParams { agile: 8.0, agile_from: 28.0, ..quiet.clone() };
        let quick = MotionParams { acceleration: 8.0, ..quiet.clone() };
        let after = |params: &MotionParams, jump: f64| {
            let mut filter = BoxFilter::new(BoxNoise::Relative((&quiet).into()), at(10.0)).unwrap();
            for _ in 0..30 {
                filter.predict(0.1).unwrap();
                filter.correct(&Sight::of(at(10.0), None)).unwrap();
            }
            filter.noise = BoxNoise::Relative(params.into());
            filter.predict(0.1).unwrap();
            filter.correct(&Sight::of(at(10.0 + jump), None)).unwrap();
            filter.belief
        };
        assert_eq!(after(&agile, 2.0), after(&quiet, 2.0), "an error of the detector");
        assert_eq!(after(&agile, 20.0), after(&quick, 20.0), "as if it had been agile all along");
        assert_ne!(after(&agile, 20.0), after(&quiet, 20.0));
    }

    #[test]
    fn the_velocity_takes_its_share_of_a_correction_and_the_place_all() {
        let at = |x: f64| BBox::from_ltwh(x, 20.0, 40.0, 30.0);
        let filter = |share: f64| {
            let mut filter = BoxFilter::new(BoxNoise::Relative((&MotionParams::default()).into()), at(10.0)).unwrap();
            filter.predict(0.1).unwrap();
            let before = filter.clone();
            filter.correct(&Sight { velocity_share: share, ..Sight::of(at(18.0), None) }).unwrap();
            (before, filter)
        };
        let ((before, whole), (_, half), (_, none)) = (filter(1.0), filter(0.5), filter(0.0));
        let speed = |f: &BoxFilter| f.velocity().unwrap().x;
        assert!(speed(&whole) > 10.0 && speed(&none) == speed(&before));
        assert!((speed(&half) - 0.5 * speed(&whole)).abs() < 1e-12);
        assert!(whole.bbox() == half.bbox() && whole.bbox() == none.bbox() && whole.bbox() != before.bbox());
        let variance = |f: &BoxFilter, i: usize| f.belief().covariance()[(i, i)];
        // γ² of the variance before, the rest of that after; of the place all is that after.
        assert!((variance(&half, 2) - (0.25 * variance(&before, 2) + 0.75 * variance(&whole, 2))).abs() < 1e-9);
        assert_eq!((variance(&none, 2), variance(&none, 0)), (variance(&before, 2), variance(&whole, 0)));
        assert_eq!(none.belief().covariance()[(0, 2)], whole.belief().covariance()[(0, 2)]);
    }
}
