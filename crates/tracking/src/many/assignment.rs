//! Which detection is whose: gated global nearest neighbour.

use super::AssociationParams;
use crate::BoxCovariance;
use crate::motion::MotionParams;
use crate::roles::Prior;
use nalgebra::{Cholesky, Vector4};
use pursuit_estimation::EstimationError;
use pursuit_estimation::association::Assignment;
use pursuit_geometry::BBox;

/// A target's expectation, ready to be compared with any number of detections.
pub(super) struct Expectation {
    bbox: BBox,
    factor: Option<Cholesky<f64, nalgebra::U4>>,
    log_determinant: f64,
    reach_px: f64,
}

impl Expectation {
    /// From the motion model's prior.
    pub fn new(prior: &Prior, params: &AssociationParams) -> Self {
        let covariance = prior.innovation_covariance.unwrap_or_else(|| unmodelled(prior, &params.motion));
        let factor = Cholesky::new(covariance);
        let log_determinant = factor.as_ref().map_or(0.0, |f| 2.0 * f.l_dirty().diagonal().map(f64::ln).sum());
        Self { bbox: prior.bbox, factor, log_determinant, reach_px: params.reach * extent_px(&prior.bbox) }
    }

    /// Squared Mahalanobis distance νᵀ S⁻¹ ν of a box's centre and size; infinite where S is no covariance.
    pub fn distance2(&self, bbox: &BBox) -> f64 {
        let Some(factor) = &self.factor else { return f64::INFINITY };
        let (expected, seen) = (self.bbox.center(), bbox.center());
        let innovation = Vector4::new(
            seen.x - expected.x,
            seen.y - expected.y,
            bbox.width() - self.bbox.width(),
            bbox.height() - self.bbox.height(),
        );
        innovation.dot(&factor.solve(&innovation))
    }

    /// Minus twice the log-likelihood of the box, but for a constant, and what the overlap adds; `None` outside the gate.
    /// `other_class`: the detection is of another class than the target, which counts as distance does.
    pub fn cost(&self, bbox: &BBox, other_class: bool, params: &AssociationParams) -> Option<f64> {
        let mistaken = if other_class { -2.0 * params.other_class.ln() } else { 0.0 };
        let distance2 = self.distance2(bbox) + mistaken;
        let near = self.bbox.center().distance(bbox.center()) <= self.reach_px;
        let overlap = params.iou_weight * (1.0 - self.bbox.iou(bbox));
        // Written so that NaN is outside.
        (near && distance2 <= params.gate).then_some(distance2 + self.log_determinant + overlap)
    }
}

/// The innovation covariance of a target whose motion is not modelled: anything the speed at the start allows.
fn unmodelled(prior: &Prior, motion: &MotionParams) -> BoxCovariance {
    let extent = extent_px(&prior.bbox);
    let square = |parts: [f64; 3]| parts.iter().map(|p| p * p).sum::<f64>();
    let floor = motion.noise_floor_px;
    let center = square([motion.position_noise * extent, motion.start_speed * extent * prior.dt_s, floor]);
    let size = square([motion.size_noise * extent, motion.size_change * extent * prior.dt_s.sqrt(), floor]);
    BoxCovariance::from_diagonal(&Vector4::new(center, center, size, size))
}

fn extent_px(bbox: &BBox) -> f64 {
    bbox.area().sqrt()
}

/// Pairs as many targets with detections as it can and, of all ways to do that, in the cheapest one. `costs` is target by
/// target; `None` forbids a pair. Returns the detection of every target.
///
/// # Errors
/// When a cost is not a number.
pub(super) fn assign(
    solver: &mut Assignment,
    costs: &[Option<f64>],
    detections: usize,
) -> Result<Vec<Option<usize>>, EstimationError> {
    let targets = costs.len().checked_div(detections).unwrap_or(0);
    let range = costs.iter().flatten().fold(0.0, |most, cost: &f64| cost.abs().max(most));
    // To leave one target out costs more than any number of pairs.
    let alone = (2.0 * range + 1.0) * (targets + 1) as f64;
    let cost = |target: usize, detection: usize| costs[target * detections + detection].unwrap_or(f64::INFINITY);
    Ok(solver.solve(targets, detections, cost, |_| alone)?.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every injective assignment there is: the most pairs, then the least cost.
    fn by_trying_all(costs: &[Option<f64>], rows: usize, columns: usize) -> (usize, f64) {
        fn go(costs: &[Option<f64>], rows: usize, columns: usize, row: usize, taken: u32) -> (usize, f64) {
            if row == rows {
                return (0, 0.0);
            }
            let mut best = go(costs, rows, columns, row + 1, taken);
            for column in (0..columns).filter(|c| taken & (1 << c) == 0) {
                let Some(cost) = costs[row * columns + column] else { continue };
                let (pairs, sum) = go(costs, rows, columns, row + 1, taken | 1 << column);
                let this = (pairs + 1, sum + cost);
                if this.0 > best.0 || (this.0 == best.0 && this.1 < best.1) {
                    best = this;
                }
            }
            best
        }
        go(costs, rows, columns, 0, 0)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn no_assignment_is_better(
            rows in 1usize..5,
            columns in 1usize..6,
            values in proptest::collection::vec(proptest::option::weighted(0.7, -40.0..60.0), 30),
        ) {
            let costs = &values[..rows * columns];
            let assigned = assign(&mut Assignment::new(), costs, columns).unwrap();
            prop_assert_eq!(assigned.len(), rows);
            let mut taken: Vec<usize> = assigned.iter().flatten().copied().collect();
            taken.sort_unstable();
            prop_assert!(taken.windows(2).all(|w| w[0] < w[1]));
            let pairs: Vec<f64> =
                assigned.iter().enumerate().filter_map(|(r, c)| Some(costs[r * columns + (*c)?].unwrap())).collect();
            let (most, least) = by_trying_all(costs, rows, columns);
            prop_assert_eq!(pairs.len(), most);
            prop_assert!((pairs.iter().sum::<f64>() - least).abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_is_assigned_to_nothing() {
        let assign = |costs: &[Option<f64>], detections| assign(&mut Assignment::new(), costs, detections);
        assert_eq!(assign(&[], 0).unwrap(), []);
        assert_eq!(assign(&[], 3).unwrap(), []);
        assert_eq!(assign(&[None, None, None, None], 2).unwrap(), [None, None]);
        assert_eq!(assign(&[Some(5.0)], 1).unwrap(), [Some(0)]);
        assert_eq!(assign(&[Some(0.0), None, None, Some(0.0)], 2).unwrap(), [Some(0), Some(1)], "costs nothing");
        assert!(assign(&[Some(f64::NAN)], 1).is_err());
    }

    fn prior(covariance: Option<BoxCovariance>) -> Prior {
        Prior { bbox: BBox::from_ltwh(100.0, 50.0, 20.0, 20.0), innovation_covariance: covariance, dt_s: 0.25 }
    }

    fn params() -> AssociationParams {
        AssociationParams { gate: 9.0, reach: 2.0, ..AssociationParams::default() }
    }

    #[test]
    fn distances_are_measured_in_standard_deviations() {
        let covariance = BoxCovariance::from_diagonal(&Vector4::new(4.0, 9.0, 16.0, 25.0));
        let expectation = Expectation::new(&prior(Some(covariance)), &params());
        let at = |dx: f64, dy: f64, dw: f64, dh: f64| {
            let center = pursuit_geometry::Point::new(110.0 + dx, 60.0 + dy);
            BBox::from_center_size(center, 20.0 + dw, 20.0 + dh)
        };
        for (bbox, want) in [
            (at(2.0, 0.0, 0.0, 0.0), 1.0),
            (at(0.0, 3.0, 0.0, 0.0), 1.0),
            (at(0.0, 0.0, 4.0, 0.0), 1.0),
            (at(0.0, 0.0, 0.0, -5.0), 1.0),
            (at(4.0, 0.0, 8.0, 0.0), 8.0),
        ] {
            assert!((expectation.distance2(&bbox) - want).abs() < 1e-9);
            let cost = expectation.cost(&bbox, false, &params()).unwrap();
            assert!((cost - want - (4.0f64 * 9.0 * 16.0 * 25.0).ln()).abs() < 1e-9, "{cost}");
        }
        assert_eq!(expectation.cost(&at(4.0, 0.0, 8.0, 5.1), false, &params()), None, "9.04 is beyond the gate");
        let mistaken = AssociationParams { other_class: (-1.0f64).exp(), ..params() };
        let far = at(4.0, 0.0, 4.0, 5.0);
        let (plain, other) = (expectation.cost(&far, false, &mistaken), expectation.cost(&far, true, &mistaken));
        assert!((other.unwrap() - plain.unwrap() - 2.0).abs() < 1e-9, "a class that one in e detections has wrong");
        assert_eq!(expectation.cost(&at(4.0, 0.0, 8.0, 0.0), true, &mistaken), None, "8 and 2 are beyond the gate");
        let with_overlap = AssociationParams { iou_weight: 3.0, ..params() };
        let (bbox, plain) =
            (at(2.0, 0.0, 0.0, 0.0), expectation.cost(&at(2.0, 0.0, 0.0, 0.0), false, &params()).unwrap());
        let iou = 18.0 / 22.0;
        assert!((expectation.cost(&bbox, false, &with_overlap).unwrap() - plain - 3.0 * (1.0 - iou)).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_found_out_of_reach_or_by_a_covariance_that_is_none() {
        let wide = Expectation::new(&prior(Some(BoxCovariance::identity() * 1e6)), &params());
        let moved = |dx: f64| prior(None).bbox.translated(dx, 0.0);
        assert!(wide.cost(&moved(40.0), false, &params()).is_some());
        assert_eq!(wide.cost(&moved(40.5), false, &params()), None, "reach is two sizes of 20 px");
        let broken = Expectation::new(&prior(Some(BoxCovariance::identity() * -1.0)), &params());
        assert_eq!((broken.distance2(&moved(0.0)), broken.cost(&moved(0.0), false, &params())), (f64::INFINITY, None));
    }

    #[test]
    fn without_a_motion_model_the_speed_at_the_start_is_the_measure() {
        let motion = MotionParams {
            position_noise: 0.0,
            size_noise: 0.1,
            size_change: 0.2,
            start_speed: 0.4,
            noise_floor_px: 0.5,
            ..MotionParams::default()
        };
        let covariance = unmodelled(&prior(None), &motion);
        // 0.4 sizes/s for a quarter of a second are 2 px; sizes: 2 px and 0.2 · 20 · ½ = 2 px.
        let want = Vector4::new(4.25, 4.25, 8.25, 8.25);
        assert!((covariance - BoxCovariance::from_diagonal(&want)).norm() < 1e-9, "{covariance}");
        let params = AssociationParams { motion, ..params() };
        let expectation = Expectation::new(&prior(None), &params);
        assert!((expectation.distance2(&prior(None).bbox.translated(2.0, 0.0)) - 4.0 / 4.25).abs() < 1e-9);
    }
}
