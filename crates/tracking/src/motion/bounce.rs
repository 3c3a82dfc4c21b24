use super::{MotionFilter, MotionParams, RelativeNoise, Sight, box_covariance, box_of, extent_px, measured};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector};
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, Result, Switching, Transition};
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// The three modes of the motion model `bounce`.
    pub struct BounceParams {
        /// *Steady*: spectral density of the white acceleration.
        pub steady_acceleration: f64 = 0.01, in 0.0.., unit "sizes²/s³", source "ours";
        /// *Flight*: spectral density of the white jerk.
        pub flight_jerk: f64 = 2500.0, in 0.0.., unit "sizes²/s⁵", source "ours";
        /// Standard deviation of the acceleration when a flight begins.
        pub flight_acceleration: f64 = 100.0, in above(0.0), unit "sizes/s²", source "ours";
        /// *Jump*: standard deviation of the change of velocity, added to `jump_of_speed` times the speed.
        pub jump_speed: f64 = 3.0, in above(0.0), unit "sizes/s", source "ours";
        /// *Jump*: standard deviation of the change of velocity as a share of the speed (a bounce turns it round).
        pub jump_of_speed: f64 = 1.0, in 0.0.., source "ours";
        /// Mean time between jumps.
        pub between_jumps_s: f64 = 1.0, in above(0.0), unit "s", source "ours";
        /// Mean time in a mode, steady motion or flight.
        pub sojourn_s: f64 = 1.5, in above(0.0), unit "s", source "ours";
        /// Probability that flight, not steady motion, follows a jump.
        pub flight_after_jump: f64 = 0.7, in 0.0..=1.0, source "ours";
        /// Probability of flight at the start.
        pub flight_at_start: f64 = 0.4, in 0.0..=0.5, source "ours";
        /// Probability of a jump at the start.
        pub jump_at_start: f64 = 0.1, in 0.0..=0.5, source "ours";
        /// A side shorter than this share of the expected one may be cut by what hides the target.
        pub cut_below: f64 = 0.85, in 0.0..=1.0, source "ours";
        /// Sides that shrink in step, to within this ratio, mean a smaller (more distant) target, not a cut one.
        pub in_step: f64 = 0.8, in 0.0..=1.0, source "ours";
    }
}

/// Components of the state `[x, y, vx, vy, ax, ay, w, h]`.
const STATES: usize = 8;
/// Where the size stands in it.
const SIZE: usize = 6;
/// Motion models: steady, flight, jump.
const MODES: usize = 3;

/// A box that moves steadily, flies (constant acceleration: gravity) or jumps (its velocity changes at some instant
/// within the step: a bounce, a hit): three models over one state, interacting (Blom and Bar-Shalom 1988).
///
/// The acceleration survives a jump, so that after a bounce the flight is predicted well again as soon as the new
/// velocity has been seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ManoeuvringBox {
    params: BounceParams,
    noise: RelativeNoise,
    models: Imm<STATES, MODES>,
    /// Whether the last prediction has been followed by a measurement.
    measured: bool,
}

impl ManoeuvringBox {
    /// A filter at rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite or a noise is out of range.
    pub fn new(params: &MotionParams, bbox: BBox) -> Result<Self> {
        let (params, noise) = (params.bounce.clone(), RelativeNoise::from(params));
        Ok(Self { models: start(&params, &noise, bbox)?, params, noise, measured: true })
    }

    /// The belief of the whole about `[x, y, vx, vy, ax, ay, w, h]`.
    pub fn belief(&self) -> Gaussian<8> {
        self.models.combined()
    }

    /// Probabilities of steady motion, flight and a jump in the last step.
    pub fn mode_probabilities(&self) -> [f64; 3] {
        (*self.models.probabilities()).into()
    }

    fn transitions(&self, dt: f64) -> Result<[Transition<STATES>; MODES]> {
        let (params, noise) = (&self.params, &self.noise);
        let state = self.models.combined();
        let mean = state.mean();
        let extent = extent_px(&self.bbox());
        let size_variance = (noise.size_change * extent).powi(2) * dt;
        let flight_start = (params.flight_acceleration * extent).powi(2);

        // Steady: the acceleration plays no part; it is kept as unknown, for the moment a flight begins.
        let steady_q = params.steady_acceleration * extent * extent;
        let steady = Matrix2::new(dt.powi(3) / 3.0, dt.powi(2) / 2.0, dt.powi(2) / 2.0, dt) * steady_q;
        let steady = Matrix3::new(
            steady[(0, 0)],
            steady[(0, 1)],
            0.0,
            steady[(1, 0)],
            steady[(1, 1)],
            0.0,
            0.0,
            0.0,
            flight_start,
        );
        let steady_f = Matrix3::new(1.0, dt, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0);

        // Flight: constant acceleration driven by white jerk.
        let flight_f = Matrix3::new(1.0, dt, dt * dt / 2.0, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
        let jerk_q = params.flight_jerk * extent * extent;
        let jerk = |i: i32, over: f64| jerk_q * dt.powi(i) / over;
        let flight = Matrix3::new(
            jerk(5, 20.0),
            jerk(4, 8.0),
            jerk(3, 6.0),
            jerk(4, 8.0),
            jerk(3, 3.0),
            jerk(2, 2.0),
            jerk(3, 6.0),
            jerk(2, 2.0),
            jerk(1, 1.0),
        );

        // Jump: a change D of velocity at an instant uniform within the step moves the position by (1 − τ) dt D, whence
        // dt²/3, dt/2 and 1 times the variance of D.
        let speed = mean[2].hypot(mean[3]);
        let jump_variance = (params.jump_speed * extent + params.jump_of_speed * speed).powi(2);
        let mut jump = flight;
        jump[(0, 0)] += jump_variance * dt * dt / 3.0;
        jump[(0, 1)] += jump_variance * dt / 2.0;
        jump[(1, 0)] += jump_variance * dt / 2.0;
        jump[(1, 1)] += jump_variance;

        let whole = |f: &Matrix3<f64>, q: &Matrix3<f64>| {
            let mut matrix = SMatrix::<f64, STATES, STATES>::identity();
            let mut spread = SMatrix::<f64, STATES, STATES>::zeros();
            for (row, column) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                for axis in 0..2 {
                    matrix[(2 * row + axis, 2 * column + axis)] = f[(row, column)];
                    spread[(2 * row + axis, 2 * column + axis)] = q[(row, column)];
                }
            }
            spread[(SIZE, SIZE)] = size_variance;
            spread[(SIZE + 1, SIZE + 1)] = size_variance;
            Transition::new(matrix, spread)
        };
        Ok([whole(&steady_f, &steady)?, whole(&flight_f, &flight)?, whole(&flight_f, &jump)?])
    }

    fn switching(&self, dt_s: f64) -> Result<Switching<MODES>> {
        let jump = 1.0 - (-dt_s / self.params.between_jumps_s).exp();
        let change = (1.0 - (-dt_s / self.params.sojourn_s).exp()) / 2.0;
        let stay = 1.0 - change;
        // A jump is over within its step.
        Switching::per_step(Matrix3::new(
            (1.0 - jump) * stay,
            (1.0 - jump) * change,
            jump,
            (1.0 - jump) * change,
            (1.0 - jump) * stay,
            jump,
            (1.0 - jump) * (1.0 - self.params.flight_after_jump),
            (1.0 - jump) * self.params.flight_after_jump,
            jump,
        ))
    }

    fn sensor(&self, sigma_px: Option<f64>) -> Result<LinearMeasurement<4, STATES>> {
        let (p, s) = self.noise.measurement.variances(extent_px(&self.bbox()), sigma_px);
        LinearMeasurement::select([0, 1, SIZE, SIZE + 1], [p, p, s, s])
    }
}

fn start(params: &BounceParams, noise: &RelativeNoise, bbox: BBox) -> Result<Imm<STATES, MODES>> {
    let extent = extent_px(&bbox);
    let z = measured(&bbox);
    let (position, size) = noise.measurement.variances(extent, None);
    let velocity = (noise.start_speed * extent).powi(2);
    let acceleration = (params.flight_acceleration * extent).powi(2);
    let belief = Gaussian::from_variances(
        SVector::from([z[0], z[1], 0.0, 0.0, 0.0, 0.0, z[2], z[3]]),
        SVector::from([position, position, velocity, velocity, acceleration, acceleration, size, size]),
    )?;
    let (flight, jump) = (params.flight_at_start, params.jump_at_start);
    Imm::new(belief, [1.0 - flight - jump, flight, jump])
}

impl MotionFilter for ManoeuvringBox {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let (transitions, switching) = (self.transitions(dt_s)?, self.switching(dt_s)?);
        self.models.predict(&transitions, &switching)?;
        // Right after a measurement the gate must let pass what a jump can do, however unlikely a jump is. In a long
        // blind stretch, jump upon jump is not to be expected: there the mixture of the modes says what is.
        let [_, _, jump] = self.models.beliefs();
        let belief = if self.measured { *jump } else { self.models.combined() };
        self.measured = false;
        let noise: SMatrix<f64, 4, 4> = *self.sensor(None)?.noise();
        let innovation_covariance = Some(box_covariance(belief.covariance(), SIZE) + noise);
        Ok(Prior { bbox: self.bbox(), innovation_covariance, dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let sensor = self.sensor(sight.sigma_px)?;
        self.models.update(&sensor, &measured(&sight.bbox))?;
        self.measured = true;
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        // The noise was accepted when the filter was made, so only a box that is not finite can fail; it changes nothing.
        if let Ok(models) = start(&self.params, &self.noise, bbox) {
            self.models = models;
            self.measured = true;
        }
    }

    fn bbox(&self) -> BBox {
        box_of(self.models.combined().mean(), SIZE)
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        Some(box_covariance(self.models.combined().covariance(), SIZE))
    }

    fn velocity(&self) -> Option<Velocity> {
        let belief = self.models.combined();
        Some(Velocity { x: belief.mean()[2], y: belief.mean()[3] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> MotionParams {
        MotionParams {
            size_change: 0.3,
            start_speed: 1.7,
            position_noise: 0.07,
            size_noise: 0.13,
            noise_floor_px: 0.6,
            bounce: BounceParams {
                steady_acceleration: 3.0,
                flight_jerk: 7.0,
                flight_acceleration: 5.0,
                jump_speed: 4.0,
                jump_of_speed: 1.3,
                between_jumps_s: 0.9,
                sojourn_s: 0.6,
                flight_after_jump: 0.7,
                flight_at_start: 0.2,
                jump_at_start: 0.1,
                ..BounceParams::default()
            },
            ..MotionParams::default()
        }
    }

    /// Side of the square of the same area.
    const EXTENT: f64 = 30.0;

    fn filter() -> ManoeuvringBox {
        ManoeuvringBox::new(&params(), BBox::from_ltwh(10.0, 20.0, 20.0, 45.0)).unwrap()
    }

    /// The mean of `f` over `[0, 1]`.
    fn mean(f: impl Fn(f64) -> Matrix3<f64>) -> Matrix3<f64> {
        const STEPS: usize = 20_000;
        (0..STEPS).map(|k| f((k as f64 + 0.5) / STEPS as f64)).sum::<Matrix3<f64>>() / STEPS as f64
    }

    /// Position, velocity and acceleration after `s` seconds of flight.
    fn flown(s: f64) -> Matrix3<f64> {
        Matrix3::new(1.0, s, s * s / 2.0, 0.0, 1.0, s, 0.0, 0.0, 1.0)
    }

    #[test]
    fn noise_is_what_white_noise_and_jumps_add_up_to() {
        let (dt, params) = (0.3, params());
        let bounce = &params.bounce;
        // Moved once, so that jumps know a speed.
        let mut moving = filter();
        moving.predict(dt).unwrap();
        moving.correct(&Sight::of(BBox::from_ltwh(34.0, 11.0, 20.0, 45.0), None)).unwrap();
        let extent = extent_px(&moving.bbox());
        let speed = moving.velocity().unwrap();
        let speed = speed.x.hypot(speed.y);
        assert!(speed > 30.0, "{speed}");
        let of_axis = |whole: &SMatrix<f64, STATES, STATES>, axis: usize| {
            Matrix3::from_fn(|i, j| whole[(2 * i + axis, 2 * j + axis)])
        };
        // Noise that enters as `enters` at any instant is carried along to the end of the step.
        let carried = |density: f64, row: usize| {
            mean(|t| {
                let g = flown(t * dt).column(row).into_owned();
                g * g.transpose()
            }) * density
                * extent.powi(2)
                * dt
        };
        let mut steady = carried(bounce.steady_acceleration, 1);
        steady[(2, 2)] = (bounce.flight_acceleration * extent).powi(2);
        let flight = carried(bounce.flight_jerk, 2);
        let jump_speed = bounce.jump_speed * extent + bounce.jump_of_speed * speed;
        let jump = flight
            + mean(|t| {
                let g = flown(t * dt).column(1) * jump_speed;
                g * g.transpose()
            });
        let mut at_rest = flown(dt);
        (at_rest[(0, 2)], at_rest[(1, 2)], at_rest[(2, 2)]) = (0.0, 0.0, 0.0);
        let transitions = moving.transitions(dt).unwrap();
        for (k, (f, q)) in [(at_rest, steady), (flown(dt), flight), (flown(dt), jump)].iter().enumerate() {
            for axis in 0..2 {
                assert!((of_axis(transitions[k].matrix(), axis) - f).amax() < 1e-12, "{k}");
                let noise = of_axis(transitions[k].noise(), axis);
                assert!(
                    (noise - q).iter().zip(q).all(|(off, q)| off.abs() < 1e-6 * q.abs().max(1e-9)),
                    "{k}: {noise} {q}"
                );
                let side = transitions[k].noise()[(SIZE + axis, SIZE + axis)];
                assert!((side - (params.size_change * extent).powi(2) * dt).abs() < 1e-9, "{k}");
            }
        }
    }

    #[test]
    fn modes_change_as_waiting_times_say() {
        let dt = 0.25;
        let switching = filter().switching(dt).unwrap();
        let jump = 1.0 - (-dt / 0.9_f64).exp();
        // Where half of all changes lead to the other mode, they are as many as end in a sojourn without a jump.
        let change = (1.0 - jump) * (1.0 - (-dt / 0.6_f64).exp()) / 2.0;
        let rest = 1.0 - jump;
        let want = Matrix3::new(rest - change, change, jump, change, rest - change, jump, rest * 0.3, rest * 0.7, jump);
        assert!((switching.matrix() - want).amax() < 1e-12, "{} {want}", switching.matrix());
        assert_eq!(filter().mode_probabilities(), [1.0 - 0.2 - 0.1, 0.2, 0.1]);
    }

    #[test]
    fn it_starts_and_starts_again_at_rest_as_uncertain_as_it_is_told() {
        let mut filter = filter();
        let position = (0.07 * EXTENT).powi(2) + 0.36;
        let size = (0.13 * EXTENT).powi(2) + 0.36;
        let (speed, acceleration) = ((1.7 * EXTENT).powi(2), (5.0 * EXTENT).powi(2));
        let want = [position, position, speed, speed, acceleration, acceleration, size, size];
        let fresh = filter.clone();
        for (k, want) in want.into_iter().enumerate() {
            assert!((filter.belief().covariance()[(k, k)] - want).abs() < 1e-9 * want, "{k}");
        }
        filter.predict(0.1).unwrap();
        filter.correct(&Sight::of(BBox::from_ltwh(60.0, 20.0, 20.0, 45.0), None)).unwrap();
        filter.predict(0.1).unwrap();
        let gone = filter.clone();
        filter.restart(BBox::from_ltwh(f64::NAN, 0.0, 1.0, 1.0));
        assert_eq!(filter, gone);
        filter.restart(BBox::from_ltwh(10.0, 20.0, 20.0, 45.0));
        assert_eq!(filter, fresh);
    }
}
