//! The predictor of qu2010: a constant-acceleration filter, or extrapolation, on positions taken every 200 ms.

use super::{MotionFilter, SMALLEST_SIDE_PX, Sight};
use crate::roles::Prior;
use crate::{BoxCovariance, NextSample, Velocity};
use nalgebra::SVector;
use pursuit_estimation::qu2010::{Extrapolator, Points, Qu2010Params};
use pursuit_estimation::{EstimationError, Gaussian, MotionModel as _, Result};
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// The predictor of qu2010.
    pub struct SamplingParams {
        /// Time between samples. 0: every frame is one.
        pub sample_s: f64 = 0.2, in 0.0..=60.0, unit "s", source "qu2010, section 4: 200 ms";
        /// q of `Q = q I`, added at each sample.
        pub process_variance: f64 = 0.3, in 0.0.., source "qu2010, section 4";
        /// r of `R = r I`.
        pub measurement_variance_px2: f64 = 2.0, in above(0.0), unit "px²", source "qu2010, section 4";
    }
}

pursuit_parameters::parameters! {
    /// The predictor of qu2010 without noise.
    pub struct ExtrapolationParams {
        /// Extrapolate from three samples (follows acceleration, triples the noise), not from two.
        pub three_points: bool = false, source "qu2010, section 5; Table 1 agrees with two";
    }
}

/// A frame this much early, as a share of the sampling interval, is still a sample: clocks round.
const EARLY: f64 = 1e-3;

/// A box whose centre is sampled, filtered and predicted a sample ahead; the box itself is the one measured last, carried on by
/// the filter's velocity and, for one sample, its acceleration.
///
/// The filter counts time in samples, as the paper's numbers do: `Q = .3 I`, `R = 2 I`, one sample a time unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct SampledBox {
    params: SamplingParams,
    /// How it extrapolates, where it does not filter.
    simplified: Option<ExtrapolationParams>,
    /// `[x, y, vx, vy, ax, ay]` at the last sample, pixels and samples; equations (4) to (9).
    belief: Gaussian<6>,
    /// Section 5.
    points: Extrapolator,
    /// Seconds that a sample stands for.
    unit_s: f64,
    /// Seconds since the start, since the last sample, and since the last measurement.
    time_s: f64,
    since_sample_s: f64,
    unseen_s: f64,
    measured: BBox,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: SamplingParams,
    simplified: Option<ExtrapolationParams>,
    belief: Gaussian<6>,
    points: Extrapolator,
    unit_s: f64,
    time_s: f64,
    since_sample_s: f64,
    unseen_s: f64,
    measured: BBox,
}

impl TryFrom<Raw> for SampledBox {
    type Error = &'static str;

    fn try_from(raw: Raw) -> std::result::Result<Self, Self::Error> {
        let Raw { params, simplified, belief, points, unit_s, time_s, since_sample_s, unseen_s, measured } = raw;
        let time = |s: f64| s.is_finite() && s >= 0.0;
        if !(unit_s > 0.0 && unit_s.is_finite() && time(time_s) && time(since_sample_s) && time(unseen_s)) {
            return Err("a time is not a finite number");
        }
        if !measured.is_finite() {
            return Err("its box is not finite");
        }
        Ok(Self { params, simplified, belief, points, unit_s, time_s, since_sample_s, unseen_s, measured })
    }
}

impl SampledBox {
    /// At rest at `bbox`, which is the first sample; `simplified`: without noise, by that extrapolation.
    ///
    /// # Errors
    /// When the box is not finite or a variance is out of range.
    pub fn new(params: SamplingParams, simplified: Option<ExtrapolationParams>, bbox: BBox) -> Result<Self> {
        if !bbox.is_finite() {
            return Err(EstimationError::NotFinite { what: "the box" });
        }
        let at = SVector::from([bbox.center().x, bbox.center().y]);
        let mean = SVector::from([at[0], at[1], 0.0, 0.0, 0.0, 0.0]);
        let three_points = simplified.as_ref().is_some_and(|s| s.three_points);
        let mut points = Extrapolator::new(if three_points { Points::Three } else { Points::Two });
        points.observe(0.0, &at)?;
        Ok(Self {
            // The paper's start, P₀ = I.
            belief: Gaussian::from_variances(mean, SVector::repeat(1.0))?,
            simplified,
            points,
            unit_s: if params.sample_s > 0.0 { params.sample_s } else { 1.0 },
            params,
            time_s: 0.0,
            since_sample_s: 0.0,
            unseen_s: 0.0,
            measured: bbox,
        })
    }

    const fn constants(&self) -> Qu2010Params {
        Qu2010Params {
            process_variance: self.params.process_variance,
            measurement_variance_px2: self.params.measurement_variance_px2,
        }
    }

    /// The belief now, `since_sample_s` after the last sample.
    fn belief_now(&self) -> Result<Gaussian<6>> {
        let samples = self.since_sample_s / self.unit_s;
        if samples > 0.0 { self.belief.predicted(&self.constants().motion().over(samples)?) } else { Ok(self.belief) }
    }

    /// Velocity at the last measurement and acceleration, in pixels and samples.
    fn rates(&self) -> ([f64; 2], [f64; 2]) {
        if self.simplified.is_some() {
            let sampled_s = self.time_s - self.since_sample_s;
            let at = |s: f64| self.points.predict(s);
            let (Some(now), Some(next)) = (at(sampled_s), at(sampled_s + self.unit_s)) else {
                return ([0.0; 2], [0.0; 2]);
            };
            return ([next[0] - now[0], next[1] - now[1]], [0.0; 2]);
        }
        let m = self.belief.mean();
        let measured_at = (self.since_sample_s - self.unseen_s).max(0.0) / self.unit_s;
        ([m[2] + m[4] * measured_at, m[3] + m[5] * measured_at], [m[4], m[5]])
    }

    fn center(&self) -> Point {
        let seen = self.measured.center();
        if self.unseen_s == 0.0 {
            return seen;
        }
        let ([vx, vy], [ax, ay]) = self.rates();
        let ahead = self.unseen_s / self.unit_s;
        // Held on, an acceleration runs away.
        let bent = ahead.min(1.0) * (ahead - 0.5 * ahead.min(1.0));
        Point::new(seen.x + vx * ahead + ax * bent, seen.y + vy * ahead + ay * bent)
    }

    /// Takes the measured position for a sample.
    fn sample(&mut self, at: &SVector<f64, 2>) -> Result<()> {
        let every_frame = self.params.sample_s == 0.0;
        let samples = if every_frame { 1.0 } else { self.since_sample_s / self.unit_s };
        let mut belief = self.belief.predicted(&self.constants().motion().over(samples)?)?;
        belief.update(&self.constants().measurement()?, at)?;
        self.points.observe(self.time_s, at)?;
        if every_frame {
            self.unit_s = self.since_sample_s;
        }
        self.belief = belief;
        self.since_sample_s = 0.0;
        Ok(())
    }

    fn spread(&self, added: f64) -> Option<BoxCovariance> {
        let belief = self.belief_now().ok()?;
        // Unseen for a sample, the size is as uncertain again.
        let size = self.params.measurement_variance_px2 * (1.0 + self.unseen_s / self.unit_s) + added;
        Some(BoxCovariance::from_fn(|i, j| match (i, j) {
            (0 | 1, 0 | 1) => belief.covariance()[(i, j)] + if i == j { added } else { 0.0 },
            _ if i == j => size,
            _ => 0.0,
        }))
    }
}

impl MotionFilter for SampledBox {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Err(EstimationError::TimeStep { dt_s });
        }
        self.time_s += dt_s;
        self.since_sample_s += dt_s;
        self.unseen_s += dt_s;
        let innovation_covariance = self.spread(self.params.measurement_variance_px2);
        Ok(Prior { bbox: self.bbox(), innovation_covariance, dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        if !sight.bbox.is_finite() {
            return Err(EstimationError::NotFinite { what: "the measured box" });
        }
        let due = self.since_sample_s >= (1.0 - EARLY) * self.params.sample_s && self.since_sample_s > 0.0;
        if due {
            let center = sight.bbox.center();
            self.sample(&SVector::from([center.x, center.y]))?;
        }
        (self.measured, self.unseen_s) = (sight.bbox, 0.0);
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        // The variances were accepted when the filter was made, so only a box that is not finite can fail.
        if let Ok(filter) = Self::new(self.params.clone(), self.simplified.clone(), bbox) {
            *self = filter;
        }
    }

    fn bbox(&self) -> BBox {
        let side = |s: f64| s.max(SMALLEST_SIDE_PX);
        BBox::from_center_size(self.center(), side(self.measured.width()), side(self.measured.height()))
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        self.spread(0.0)
    }

    fn velocity(&self) -> Option<Velocity> {
        let ([x, y], _) = self.rates();
        Some(Velocity { x: x / self.unit_s, y: y / self.unit_s })
    }
    fn next_sample(&self) -> Option<NextSample> {
        let center = if self.simplified.is_some() {
            let sampled_s = self.time_s - self.since_sample_s;
            self.points.predict(sampled_s + self.unit_s)
        } else {
            let step = self.constants().motion().over(1.0).ok();
            step.map(|step| (step.matrix() * self.belief.mean()).fixed_rows::<2>(0).into_owned())
        };
        let center = center.map(|at| Point::new(at[0], at[1]));
        Some(NextSample { in_s: (self.unit_s - self.since_sample_s).max(0.0), center })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> BBox {
        BBox::from_center_size(Point::new(x, y), 20.0, 50.0)
    }

    fn simplified() -> Option<ExtrapolationParams> {
        Some(ExtrapolationParams::default())
    }

    fn go(filter: &mut SampledBox, dt_s: f64, x: f64, y: f64) {
        filter.predict(dt_s).unwrap();
        filter.correct(&Sight::of(at(x, y), None)).unwrap();
    }

    /// Between samples the box goes on from where it was measured last: by the velocity there and, for one sample, by the acceleration.
    #[test]
    fn between_samples_it_goes_on_from_the_last_measurement() {
        let mut filter = SampledBox::new(SamplingParams::default(), None, at(10.0, 80.0)).unwrap();
        let unit = filter.unit_s;
        assert_eq!(unit, 0.2);
        for k in 1..8 {
            let t = f64::from(k);
            go(&mut filter, unit, 10.0 + 6.0 * t + 2.0 * t * t, 80.0 - 4.0 * t);
        }
        let m = *filter.belief.mean();
        assert!(m[2] > 10.0 && m[4] > 1.0, "{m}");
        // Measured 0.4 samples later, and no sample then.
        go(&mut filter, 0.4 * unit, 200.0, 40.0);
        assert_eq!(*filter.belief.mean(), m);
        let speed = [m[2] + 0.4 * m[4], m[3] + 0.4 * m[5]];
        let velocity = filter.velocity().unwrap();
        assert!((velocity.x - speed[0] / unit).abs() < 1e-9 && (velocity.y - speed[1] / unit).abs() < 1e-9);
        // Half a sample on it is bent as t²/2, two samples and a half on only by what the first of them bends.
        for (ahead, bent) in [(0.5, 0.5 * 0.5 * 0.5), (2.5, 0.5 + 1.5)] {
            let mut later = filter.clone();
            let center = later.predict(ahead * unit).unwrap().bbox.center();
            let want = Point::new(200.0 + speed[0] * ahead + m[4] * bent, 40.0 + speed[1] * ahead + m[5] * bent);
            assert!(center.distance(want) < 1e-9, "{ahead}: {center:?} {want:?}");
            let velocity = later.velocity().unwrap();
            assert!((velocity.x - speed[0] / unit).abs() < 1e-9, "the velocity is that of the last measurement");
            let size = later.covariance().unwrap()[(2, 2)];
            let measured = later.params.measurement_variance_px2;
            assert!((size - measured * (1.0 + ahead)).abs() < 1e-9, "unseen for a sample, as uncertain again: {size}");
        }
    }

    /// Table 1 of the paper: what it prints as predicted, for the positions that can be recovered.
    #[test]
    fn the_simplified_mode_gives_the_papers_table() {
        for (path, printed) in [
            ([[12.0, 119.0], [16.0, 116.0], [34.0, 120.0], [59.0, 113.0]], [[20.0, 113.0], [52.0, 124.0]]),
            ([[261.0, 142.0], [277.0, 141.0], [292.0, 140.0], [307.0, 140.0]], [[293.0, 140.0], [307.0, 139.0]]),
        ] {
            let mut filter =
                SampledBox::new(SamplingParams::default(), simplified(), at(path[0][0], path[0][1])).unwrap();
            assert_eq!(filter.next_sample().unwrap(), NextSample { in_s: 0.2, center: None });
            let mut said = Vec::new();
            for [x, y] in &path[1..] {
                go(&mut filter, 0.2, *x, *y);
                said.push(filter.next_sample().unwrap());
            }
            for (said, printed) in said.iter().zip(printed) {
                assert!((said.in_s - 0.2).abs() < 1e-12);
                assert!(
                    said.center.unwrap().distance(Point::new(printed[0], printed[1])) < 1e-9,
                    "{said:?} {printed:?}"
                );
            }
        }
    }

    #[test]
    fn the_filter_is_the_papers_on_samples() {
        let params = SamplingParams::default();
        let mut filter = SampledBox::new(params, None, at(10.0, 20.0)).unwrap();
        let constants = Qu2010Params::printed();
        let step = constants.motion().over(1.0).unwrap();
        let mut belief =
            Gaussian::from_variances(SVector::from([10.0, 20.0, 0.0, 0.0, 0.0, 0.0]), SVector::repeat(1.0)).unwrap();
        for k in 1..=60u32 {
            // Five frames a sample; what is seen between samples is not filtered.
            let (x, y) = (10.0 + 1.5 * f64::from(k), 20.0 - 0.5 * f64::from(k));
            go(&mut filter, 0.04, x, y);
            assert_eq!(filter.bbox(), at(x, y), "what is measured is where it is");
            if k % 5 == 0 {
                belief.predict(&step).unwrap();
                belief.update(&constants.measurement().unwrap(), &SVector::from([x, y])).unwrap();
            }
            let next = filter.next_sample().unwrap();
            let ahead = step.matrix() * belief.mean();
            assert!(next.center.unwrap().distance(Point::new(ahead[0], ahead[1])) < 1e-9, "{k}");
            assert!((next.in_s - 0.04 * f64::from(5 - k % 5)).abs() < 1e-9, "{k} {next:?}");
        }
        // The velocity, per second; nothing accelerates.
        let v = filter.velocity().unwrap();
        assert!((v.x - 37.5).abs() < 1.5 && (v.y + 12.5).abs() < 0.6, "{v:?}");
        // Unseen it goes on from where it was seen.
        let prior = filter.predict(0.2).unwrap();
        assert!(prior.bbox.center().distance(Point::new(100.0 + 7.5, -10.0 - 2.5)) < 0.6, "{prior:?}");
        assert!(prior.innovation_covariance.unwrap()[(0, 0)] > filter.covariance().unwrap()[(0, 0)] + 1.9);
    }

    #[test]
    fn every_frame_may_be_a_sample() {
        let params = SamplingParams { sample_s: 0.0, ..SamplingParams::default() };
        for simplified in [None, simplified()] {
            let mut filter = SampledBox::new(params.clone(), simplified, at(0.0, 0.0)).unwrap();
            for k in 1..=25 {
                go(&mut filter, 0.04, 3.0 * f64::from(k), 0.0);
            }
            let next = filter.next_sample().unwrap();
            assert!((next.in_s - 0.04).abs() < 1e-12 && (next.center.unwrap().x - 78.0).abs() < 0.3, "{next:?}");
            assert!((filter.velocity().unwrap().x - 75.0).abs() < 4.0);
        }
    }

    #[test]
    fn nothing_runs_away_and_what_is_not_whole_is_refused() {
        let mut filter = SampledBox::new(SamplingParams::default(), None, at(0.0, 0.0)).unwrap();
        for k in 1..=10 {
            // It speeds up by 10 px a sample, each sample.
            go(&mut filter, 0.2, 5.0 * f64::from(k * k), 0.0);
        }
        let unseen: Vec<f64> = (0..5).map(|_| filter.predict(0.2).unwrap().bbox.center().x).collect();
        let steps: Vec<f64> = unseen.windows(2).map(|w| w[1] - w[0]).collect();
        assert!((unseen[0] - 605.0).abs() < 12.0, "{unseen:?}");
        assert!(steps.windows(2).all(|w| (w[1] - w[0]).abs() < 1e-9), "at a steady speed: {steps:?}");
        assert!(filter.predict(0.0).is_err() && filter.predict(f64::NAN).is_err());
        assert!(filter.correct(&Sight::of(at(f64::NAN, 0.0), None)).is_err());
        let before = filter.clone();
        filter.restart(at(f64::INFINITY, 0.0));
        assert_eq!(filter, before);
        filter.restart(at(1.0, 2.0));
        assert_eq!(filter.bbox(), at(1.0, 2.0));
        assert!(SampledBox::new(SamplingParams::default(), simplified(), at(f64::NAN, 0.0)).is_err());
        let mut written = serde_json::to_value(&before).unwrap();
        assert_eq!(serde_json::from_value::<SampledBox>(written.clone()).unwrap(), before);
        written["unit_s"] = 0.0.into();
        assert!(serde_json::from_value::<SampledBox>(written).is_err());
    }
}
